//! The rig on paper: channel hookup and instrument schedule as tables, the light plot as a drawing.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use crate::chart::{self, Drawing, LightPlot, PlottedLight, PlottedSurface, Symbol, Theme};
use crate::sheet::number;
use crate::table::Table;
use crate::words::count;
use footlight_engine::Document;
use footlight_show::geometry::Vec3;
use footlight_show::model::{Bank, HeadAxis, LightKind, Luminaire, Show};
use footlight_show::units::Rgb;
use footlight_stage::{Light, Polygon};
use footlight_transport::Setup;

/// Order of the rows in a table of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigOrder {
    /// By channel: the hookup.
    Channel,
    /// By position, from the house upstage, from stage left to stage right: the instrument
    /// schedule.
    Place,
}

/// A light of the show at its position.
struct Hung<'s> {
    light: &'s Luminaire,
    bank: Option<&'s Bank>,
    /// Names of bank and groups, or of the fixed light.
    purpose: String,
    place: Option<Vec3>,
    aim: Option<Vec3>,
    /// Full angles at half and at a tenth of the peak, degrees.
    beam: Option<f64>,
    field: Option<f64>,
    /// Index of its emitting material.
    material: Option<usize>,
}

const LEGEND: &str = "x to stage left, y upstage, z up. Moving heads stand at home.";

const COLUMNS: [&str; 14] = [
    "channel",
    "light",
    "purpose",
    "kind",
    "x (m)",
    "y (m)",
    "z (m)",
    "aim x (m)",
    "aim y (m)",
    "aim z (m)",
    "beam (deg)",
    "field (deg)",
    "colour",
    "moves (deg)",
];

/// All lights of a show.
pub fn table(document: &Document, order: RigOrder) -> Table {
    let mut lights = hung(document.show(), document.setup());
    let chosen = match order {
        RigOrder::Channel => {
            lights.sort_by_key(by_channel);
            [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13]
        }
        RigOrder::Place => {
            lights.sort_by(by_place);
            [1, 4, 5, 6, 0, 2, 3, 7, 8, 9, 10, 11, 12, 13]
        }
    };
    // Most shows have no heads.
    let moving = lights.iter().any(|hung| hung.light.head.is_some());
    let chosen = chosen.iter().take(if moving { 14 } else { 13 });
    let row = |cells: [String; 14]| -> Vec<String> {
        chosen
            .clone()
            .filter_map(|column| cells.get(*column).cloned())
            .collect()
    };
    let mut table = Table::new(row(COLUMNS.map(str::to_owned)), LEGEND);
    for hung in &lights {
        let length = |of: Option<f64>| of.map_or_else(String::new, number);
        let point = |at: Option<Vec3>| {
            [at.map(|at| at.x), at.map(|at| at.y), at.map(|at| at.z)].map(length)
        };
        let ([x, y, z], [aim_x, aim_y, aim_z]) = (point(hung.place), point(hung.aim));
        let (channel, form) = (
            hung.bank.and_then(|bank| bank.channel),
            hung.light.form.clone(),
        );
        let rgb = if hung.bank.is_some_and(|bank| bank.rgb) {
            " rgb"
        } else {
            ""
        };
        table.push(row([
            channel.map_or_else(String::new, |channel| channel.to_string()),
            hung.light.name.clone(),
            hung.purpose.clone(),
            form,
            x,
            y,
            z,
            aim_x,
            aim_y,
            aim_z,
            length(hung.beam),
            length(hung.field),
            format!("{}{rgb}", hung.light.colour).trim().to_owned(),
            moves(hung.light),
        ]));
    }
    table
}

/// Most lights of a light plot; more would be illegible on A4.
const PLOTTED: usize = 1000;

/// The light plot of rig and set, and its description.
pub fn plot(document: &Document, theme: Theme) -> (Drawing, String) {
    let (show, setup) = (document.show(), document.setup());
    let all = hung(show, setup);
    let lights = all.get(..PLOTTED).unwrap_or(&all);
    let label = |hung: &Hung<'_>| match (hung.bank, hung.bank.and_then(|bank| bank.channel)) {
        (_, Some(channel)) => channel.to_string(),
        (Some(bank), None) => bank.name.clone(),
        (None, None) => hung.light.name.clone(),
    };
    let plotted = |hung: &Hung<'_>| {
        Some(PlottedLight {
            at: hung.place?,
            aim: hung.aim,
            label: label(hung),
            symbol: symbol(hung.light),
            gel: hung.light.gel.map(shown),
        })
    };
    let shining = lights
        .iter()
        .filter_map(|hung| Some((hung.material?, label(hung))));
    let shining: BTreeMap<usize, String> = shining.collect();
    let surface = |polygon: &Polygon| PlottedSurface {
        vertices: polygon.vertices.to_vec(),
        label: shining.get(&polygon.material).cloned(),
    };
    let polygons = setup.map_or(&[][..], |setup| &setup.scene.polygons);
    let data = LightPlot {
        title: show.title.clone(),
        lights: lights.iter().filter_map(plotted).collect(),
        surfaces: polygons.iter().map(surface).collect(),
    };
    let (drawing, scale) = chart::light_plot(&data, theme);
    let drawn = match count(all.len(), "light") {
        lights if all.len() > PLOTTED => format!("the first {PLOTTED} of {lights}"),
        lights => lights,
    };
    let text = format!("{drawn} of {}, 1:{scale} on A4", show.title);
    (drawing, text)
}

/// A gel's hue as displayed, its brightest channel at full.
fn shown(gel: Rgb) -> [u8; 3] {
    let most = gel.0.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    gel.scaled(1.0 / most).to_srgb8()
}

/// The symbol of a light by its kind and, for a spot, by the name of its lantern.
fn symbol(light: &Luminaire) -> Symbol {
    let is = |words: &[&str]| words.iter().any(|word| light.form.contains(word));
    match light.kind {
        _ if light.head.is_some() => Symbol::Head,
        LightKind::Spot(_) if is(&["cyc", "batten"]) => Symbol::Flood,
        LightKind::Spot(_) if is(&["fresnel", "PAR", "wash"]) => Symbol::Wash,
        LightKind::Spot(_) | LightKind::Projection { .. } | LightKind::ImportedLuminaire(_) => {
            Symbol::Profile
        }
        _ => Symbol::Lamp,
    }
}

/// The lights of each bank, then the fixed ones, then unused ones.
fn hung<'s>(show: &'s Show, setup: Option<&Setup>) -> Vec<Hung<'s>> {
    let mut groups: BTreeMap<usize, Vec<&str>> = BTreeMap::new();
    for group in &show.groups {
        for bank in &group.banks {
            groups.entry(*bank).or_default().push(&group.name);
        }
    }
    let mut all: Vec<(usize, Option<&Bank>, String)> = Vec::new();
    for (number, bank) in show.banks.iter().enumerate() {
        let purpose = match groups.get(&number) {
            None => bank.name.clone(),
            Some(groups) => format!("{} ({})", bank.name, groups.join(", ")),
        };
        all.extend(
            bank.lights
                .iter()
                .map(|light| (*light, Some(bank), purpose.clone())),
        );
    }
    for fixed in &show.fixed {
        let purpose = format!("fixed {}", fixed.name);
        all.extend(
            fixed
                .lights
                .iter()
                .map(|light| (*light, None, purpose.clone())),
        );
    }
    let used: BTreeSet<usize> = all.iter().map(|(light, ..)| *light).collect();
    let unused = (0..show.lights.len()).filter(|light| !used.contains(light));
    all.extend(unused.map(|light| (light, None, "in no bank".to_owned())));
    // A coloured image is three lights, one for each plane.
    let first = |light: &&Light| !matches!(light, Light::Projection(thrown) if thrown.plane > 0);
    let resolved = setup.map_or(&[][..], |setup| &setup.rig.lights);
    let resolved: Vec<&Light> = resolved.iter().filter(first).collect();
    let one = |(index, bank, purpose): (usize, _, _)| {
        let light = show.lights.get(index)?;
        let (mut material, mut angles) = (None, [None; 2]);
        let (place, aim) = match (&light.kind, resolved.get(index)) {
            (LightKind::Spot(spot), _) | (_, Some(Light::Spot(spot))) => {
                angles = [Some(spot.beam), Some(spot.field)];
                (Some(spot.position), Some(spot.aim))
            }
            (LightKind::Projection { mount, field, .. }, _) => {
                angles = [None, Some(*field)];
                (Some(mount.position), Some(mount.aim))
            }
            (LightKind::Photometric { mount, .. }, _) => (Some(mount.position), Some(mount.aim)),
            (LightKind::Shape { shape, .. }, _) => {
                let (centre, aim) = shape.position_and_aim();
                (Some(centre), aim)
            }
            (_, Some(Light::Panel { material: own, .. })) => {
                material = Some(*own);
                (None, None)
            }
            _ => (None, None),
        };
        let [beam, field] = angles;
        Some(Hung {
            light,
            bank,
            purpose,
            place,
            aim,
            beam,
            field,
            material,
        })
    };
    all.into_iter().filter_map(one).collect()
}

/// Sort key: channels in order, then lights without one.
fn by_channel(hung: &Hung<'_>) -> (bool, Option<u32>) {
    let channel = hung.bank.and_then(|bank| bank.channel);
    (channel.is_none(), channel)
}

/// Compares positions; lights on one pipe are within 10 cm upstage and in height.
fn by_place(a: &Hung<'_>, b: &Hung<'_>) -> Ordering {
    let row = |hung: &Hung<'_>| {
        let at = hung.place?;
        let near = |length: f64| (10.0 * length).round();
        Some([near(at.y), -near(at.z), -at.x])
    };
    let order = match (row(a), row(b)) {
        (Some(a), Some(b)) => a.partial_cmp(&b).unwrap_or(Ordering::Equal),
        (a, b) => a.is_none().cmp(&b.is_none()),
    };
    order.then_with(|| a.light.name.cmp(&b.light.name))
}

/// The ranges of a head: `pan -270 to 270, tilt -130 to 130, zoom 6 to 30`.
fn moves(light: &Luminaire) -> String {
    let Some(head) = light.head else {
        return String::new();
    };
    let range = |(word, axis): (&str, HeadAxis)| {
        let [low, high] = head.range(axis).map(number);
        if low == high {
            String::new()
        } else {
            format!("{word} {low} to {high}")
        }
    };
    let ranges = [
        ("pan", HeadAxis::Pan),
        ("tilt", HeadAxis::Tilt),
        ("zoom", HeadAxis::Beam),
    ]
    .map(range);
    let ranges: Vec<String> = ranges
        .into_iter()
        .filter(|range| !range.is_empty())
        .collect();
    ranges.join(", ")
}
