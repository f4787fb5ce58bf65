//! Types of fixtures (GDTF, DIN SPEC 15800): where the light leaves them, how it spreads, and what a mode
//! controls.

use roxmltree::{Document, Node, ParsingOptions};

use super::frame::Frame;

/// Geometries inside geometries.
const DEPTH: usize = 32;
/// Elements of a description.
const NODES: u32 = 2_000_000;

/// What is read of a fixture in one of its modes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fixture {
    /// From the fixture's own origin to the beam's; metres.
    pub beam: Option<Frame>,
    /// How many beams it has; they are one light.
    pub beams: usize,
    /// Full angles, degrees.
    pub beam_angle: Option<f64>,
    pub field_angle: Option<f64>,
    /// Lumens, of all beams.
    pub flux: Option<f64>,
    /// Kelvin.
    pub temperature: Option<f64>,
    /// Offsets of the dimmer, and of red, green and blue, from 1; with those of their lower bytes.
    pub dimmer: Option<(u16, Option<u16>)>,
    pub rgb: [Option<(u16, Option<u16>)>; 3],
    /// It mixes colours in another way, or has more emitters.
    pub mixes_otherwise: bool,
    /// It can turn its head.
    pub moves: bool,
    /// The mode was found.
    pub mode: bool,
}

/// Reads XML without entities of its own.
pub fn parsed(text: &str) -> Result<Document<'_>, roxmltree::Error> {
    let options = ParsingOptions {
        nodes_limit: NODES,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options)
}

/// Reads a `description.xml`.
///
/// # Errors
/// Where it is no XML.
pub fn read(text: &str, mode: &str) -> Result<Fixture, roxmltree::Error> {
    let document = parsed(text)?;
    let root = document.root_element();
    let modes = root.descendants().filter(|n| n.has_tag_name("DMXMode"));
    let modes: Vec<Node<'_, '_>> = modes.collect();
    let named = modes
        .iter()
        .find(|node| node.attribute("Name") == Some(mode));
    let mut fixture = Fixture {
        mode: named.is_some(),
        ..Fixture::default()
    };
    let Some(chosen) = named.or(modes.first()) else {
        return Ok(fixture);
    };
    channels(*chosen, &mut fixture);
    let geometries = root.descendants().find(|n| n.has_tag_name("Geometries"));
    if let Some(geometries) = geometries {
        let first = geometries.children().filter(Node::is_element);
        let name = chosen.attribute("Geometry");
        let start = first
            .clone()
            .find(|n| n.attribute("Name") == name)
            .or(first.clone().next());
        if let Some(start) = start {
            beams(start, geometries, Frame::default(), DEPTH, &mut fixture);
        }
    }
    Ok(fixture)
}

fn channels(mode: Node<'_, '_>, fixture: &mut Fixture) {
    for channel in mode.descendants().filter(|n| n.has_tag_name("DMXChannel")) {
        let logical = channel
            .children()
            .find(|n| n.has_tag_name("LogicalChannel"));
        let attribute = logical.and_then(|n| n.attribute("Attribute")).unwrap_or("");
        let offsets = channel.attribute("Offset").unwrap_or("");
        let mut offsets = offsets
            .split(',')
            .filter_map(|word| word.trim().parse().ok());
        let offset = offsets.next().map(|coarse| (coarse, offsets.next()));
        let emitter = match attribute {
            "Dimmer" => {
                fixture.dimmer = fixture.dimmer.or(offset);
                continue;
            }
            "ColorAdd_R" | "ColorRGB_Red" => 0,
            "ColorAdd_G" | "ColorRGB_Green" => 1,
            "ColorAdd_B" | "ColorRGB_Blue" => 2,
            "Pan" | "Tilt" => {
                fixture.moves |= offset.is_some();
                continue;
            }
            other => {
                fixture.mixes_otherwise |= other.starts_with("Color") || other == "CTO";
                continue;
            }
        };
        if let Some(place) = fixture.rgb.get_mut(emitter) {
            *place = place.or(offset);
        }
    }
}

/// Goes down from a geometry to its beams.
fn beams(node: Node<'_, '_>, all: Node<'_, '_>, frame: Frame, depth: usize, fixture: &mut Fixture) {
    if depth == 0 {
        return;
    }
    let own = node.attribute("Position").and_then(Frame::of_rows);
    let frame = own.map_or(frame, |own| frame.then(own));
    if node.has_tag_name("Beam") {
        let number = |name: &str| {
            node.attribute(name)?
                .trim()
                .parse()
                .ok()
                .filter(|v: &f64| *v > 0.0)
        };
        fixture.beams += 1;
        fixture.beam = fixture.beam.or(Some(frame));
        fixture.beam_angle = fixture.beam_angle.or(number("BeamAngle"));
        fixture.field_angle = fixture.field_angle.or(number("FieldAngle"));
        fixture.temperature = fixture.temperature.or(number("ColorTemperature"));
        if let Some(flux) = number("LuminousFlux") {
            fixture.flux = Some(fixture.flux.unwrap_or(0.0) + flux);
        }
    }
    if node.has_tag_name("GeometryReference") {
        let name = node.attribute("Geometry");
        let meant = all
            .children()
            .find(|n| n.is_element() && n.attribute("Name") == name);
        if let Some(meant) = meant {
            beams(meant, all, frame, depth - 1, fixture);
        }
    }
    for child in node.children().filter(Node::is_element) {
        beams(child, all, frame, depth - 1, fixture);
    }
}
