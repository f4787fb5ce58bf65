//! Fixture types (GDTF, DIN SPEC 15800): position and angles of their beams, and the channels of a
//! mode.

use roxmltree::{Document, Node};

use super::frame::Frame;
use super::{Fault, said};
use footlight_host::work::Work;

/// Most nested geometries.
const DEPTH: usize = 32;
/// Most geometries of a type, counting references.
const GEOMETRIES: usize = 100_000;
/// Most attributes of an element: the parser compares each with all others. Real descriptions have
/// ten.
const ATTRIBUTES: usize = 250;
/// Most namespaces of a document: each element inherits all. Real descriptions have none.
const NAMESPACES: usize = 20;
/// Types of beams that are spots; a beam without a type is a wash.
const BEAMS: [&str; 6] = ["", "Wash", "Spot", "Rectangle", "PC", "Fresnel"];
/// Largest angle of a channel, degrees.
const MOST: f64 = 900.0;
/// Bytes of an element in memory, with its text.
const ELEMENT_BYTES: usize = 400;
/// Bytes of an attribute in memory.
const ATTRIBUTE_BYTES: usize = 80;

/// Properties of a fixture in one of its modes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fixture {
    /// From the fixture's origin to the beam's, metres.
    pub beam: Option<Frame>,
    /// Number of beams, which become one light.
    pub beams: usize,
    /// Full angles, degrees.
    pub beam_angle: Option<f64>,
    pub field_angle: Option<f64>,
    /// Lumens, of all beams.
    pub flux: Option<f64>,
    /// Kelvin.
    pub temperature: Option<f64>,
    /// Offsets of the dimmer, and of red, green and blue, from 1; with the offsets of their lower
    /// bytes.
    pub dimmer: Option<(u16, Option<u16>)>,
    pub rgb: [Option<(u16, Option<u16>)>; 3],
    /// True when it mixes colours differently, or has more emitters.
    pub mixes_otherwise: bool,
    /// Channels of its head's axes and of its field.
    pub pan: Option<Turn>,
    pub tilt: Option<Turn>,
    pub zoom: Option<Turn>,
    /// From the fixture's origin to the tilt axis of its head.
    pub pivot: Option<Frame>,
    /// True when a lamp makes no beam.
    pub is_without_beam: bool,
    /// An unknown beam type.
    pub unknown_type: Option<String>,
    /// True when the mode was found; `None` for a type that is not read.
    pub mode: Option<bool>,
}

/// A channel of an angle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Turn {
    /// Its offset, from 1, with that of its lower byte; `None` for a channel without address.
    pub offset: Option<(u16, Option<u16>)>,
    /// Degrees at 0 and at full.
    pub physical: Option<[f64; 2]>,
    /// The geometry that turns.
    geometry: String,
}

impl Turn {
    fn of(channel: Node<'_, '_>, attribute: &str, offset: Option<(u16, Option<u16>)>) -> Turn {
        let functions = channel.descendants();
        let function = functions
            .filter(|n| n.has_tag_name("ChannelFunction"))
            .find(|n| n.attribute("Attribute").is_none_or(|a| a == attribute));
        let end = |name: &str| {
            let end: Option<f64> = function?.attribute(name)?.trim().parse().ok();
            end.filter(|degrees| degrees.abs() <= MOST)
        };
        let ends = end("PhysicalFrom").zip(end("PhysicalTo"));
        Turn {
            offset,
            // GDTF's default is from 0 to 1.
            physical: ends
                .filter(|(a, b)| (a - b).abs() > 1.0)
                .map(|(a, b)| [a, b]),
            geometry: channel.attribute("Geometry").unwrap_or_default().to_owned(),
        }
    }
}

/// Parses XML without entity declarations, within the memory of `work`.
///
/// # Errors
/// For malformed XML, an exceeded limit, or a cancel.
pub fn parsed<'t>(text: &'t str, work: Work<'_>) -> Result<Document<'t>, Fault> {
    work.check()?;
    let mut needed = 0_usize;
    // After each `<`: an element with its attributes, then text.
    for element in text.split('<') {
        let equals = element.bytes().filter(|byte| *byte == b'=').count();
        if equals > ATTRIBUTES && !element.starts_with(['!', '?', '/']) {
            return said(format!("an element has more than {ATTRIBUTES} attributes"));
        }
        needed = needed.saturating_add(ELEMENT_BYTES + equals * ATTRIBUTE_BYTES);
    }
    if needed > work.memory {
        let why = "it does not fit into the memory allowed";
        return Err(Fault::Memory(why.to_owned()));
    }
    if text.matches("xmlns").count() > NAMESPACES {
        return said(format!("it names more than {NAMESPACES} namespaces"));
    }
    Document::parse(text).or_else(|error| said(error.to_string()))
}

/// Reads a `description.xml`.
///
/// # Errors
/// As [`parsed`], and for endless geometries.
pub fn read(text: &str, mode: &str, work: Work<'_>) -> Result<Fixture, Fault> {
    let document = parsed(text, work)?;
    let root = document.root_element();
    let modes = root.descendants().filter(|n| n.has_tag_name("DMXMode"));
    let modes: Vec<Node<'_, '_>> = modes.collect();
    let named = modes
        .iter()
        .find(|node| node.attribute("Name") == Some(mode));
    let mut fixture = Fixture {
        mode: Some(named.is_some()),
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
            let mut tree = Geometries {
                all: geometries,
                left: GEOMETRIES,
                fixture: &mut fixture,
                work,
            };
            tree.beams(start, Frame::default(), DEPTH)?;
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
            "Pan" | "Tilt" | "Zoom" => {
                let place = match attribute {
                    "Pan" => &mut fixture.pan,
                    "Tilt" => &mut fixture.tilt,
                    _ => &mut fixture.zoom,
                };
                place.get_or_insert_with(|| Turn::of(channel, attribute, offset));
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

/// Collects the beams of a type's geometries.
struct Geometries<'n, 'd, 'w> {
    all: Node<'n, 'd>,
    /// Geometries left to visit.
    left: usize,
    fixture: &'w mut Fixture,
    work: Work<'w>,
}

impl Geometries<'_, '_, '_> {
    /// Descends from a geometry to its beams.
    fn beams(&mut self, node: Node<'_, '_>, frame: Frame, depth: usize) -> Result<(), Fault> {
        if depth == 0 {
            return Ok(());
        }
        self.work.check()?;
        let Some(left) = self.left.checked_sub(1) else {
            return said(format!(
                "it has more than {GEOMETRIES} geometries with those that refer to others"
            ));
        };
        self.left = left;
        let own = node.attribute("Position").and_then(Frame::of_rows);
        let frame = own.map_or(frame, |own| frame.then(own));
        // These types glow without a beam.
        let is_dark = matches!(node.attribute("BeamType"), Some("None" | "Glow"));
        self.fixture.is_without_beam |= is_dark;
        let tilted = self.fixture.tilt.as_ref().map(|tilt| &tilt.geometry);
        if tilted.is_some_and(|name| node.attribute("Name") == Some(name)) {
            self.fixture.pivot = self.fixture.pivot.or(Some(frame));
        }
        if node.has_tag_name("Beam") && !is_dark {
            self.beam(node, frame);
        }
        if node.has_tag_name("GeometryReference") {
            let name = node.attribute("Geometry");
            let meant = self
                .all
                .children()
                .find(|n| n.is_element() && n.attribute("Name") == name);
            if let Some(meant) = meant {
                self.beams(meant, frame, depth - 1)?;
            }
        }
        for child in node.children().filter(Node::is_element) {
            self.beams(child, frame, depth - 1)?;
        }
        Ok(())
    }

    fn beam(&mut self, node: Node<'_, '_>, frame: Frame) {
        let number = |name: &str| {
            node.attribute(name)?
                .trim()
                .parse()
                .ok()
                .filter(|v: &f64| *v > 0.0)
        };
        let fixture = &mut *self.fixture;
        fixture.beams += 1;
        let kind = node.attribute("BeamType").unwrap_or_default();
        if !BEAMS.contains(&kind) {
            fixture.unknown_type = Some(kind.to_owned());
        }
        fixture.beam = fixture.beam.or(Some(frame));
        fixture.beam_angle = fixture.beam_angle.or(number("BeamAngle"));
        fixture.field_angle = fixture.field_angle.or(number("FieldAngle"));
        fixture.temperature = fixture.temperature.or(number("ColorTemperature"));
        if let Some(flux) = number("LuminousFlux") {
            fixture.flux = Some(fixture.flux.unwrap_or(0.0) + flux);
        }
    }
}
