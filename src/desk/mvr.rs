//! Rigs from plans (MVR 1.5 and 1.6, DIN SPEC 15801): lights with their positions, channels and
//! addresses, and glTF geometry. Missing values are assumed, and listed.

mod frame;
mod gdtf;
mod head;
mod rig;
mod zip;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use roxmltree::Node;

use self::frame::Frame;
use self::zip::Archive;
use super::{ImportError, Loss};
use footlight_host::work::{Cancelled, Work};
use footlight_show::diagnostic::Diagnostic;

/// Most bytes of an archive.
pub const LIMIT: usize = 256 << 20;
/// File name of the plan's description.
const SCENE: &str = "GeneralSceneDescription.xml";
/// Most fixtures of a rig, and most geometry files.
const MOST: usize = 10_000;
/// Most nested objects.
const DEPTH: usize = 64;

/// A rig as the text of a show, with the files that it names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// The declarations, to be included in a show.
    pub text: String,
    /// The patch: addresses of the banks.
    pub patch: String,
    /// Geometry, by the path in the show's folder.
    pub files: Vec<(String, Vec<u8>)>,
    /// The losses.
    pub losses: Vec<Loss>,
    /// Assumptions for missing values.
    pub assumed: Vec<String>,
}

/// A fixture of the plan.
#[derive(Debug, Default)]
struct Hung {
    line: usize,
    name: String,
    /// Channel number of the desk.
    id: String,
    kind: String,
    mode: String,
    frame: Frame,
    /// Id of its focus point.
    focus: Option<String>,
    /// The address as written.
    address: Option<String>,
    /// CIE x, y, Y of the gel.
    colour: Option<[f64; 3]>,
    /// Preset zoom angle, degrees.
    zoom: Option<f64>,
    pan: Option<f64>,
    tilt: Option<f64>,
}

impl Hung {
    /// Direction of its head, in its own frame.
    fn direction(&self) -> [f64; 3] {
        let [pan, tilt] = [self.pan, self.tilt].map(|angle| angle.unwrap_or(0.0).to_radians());
        let across = tilt.sin();
        [-pan.sin() * across, pan.cos() * across, -tilt.cos()]
    }
}

/// A geometry file and its placement.
#[derive(Debug)]
struct Set {
    line: usize,
    file: String,
    frame: Frame,
}

/// Content of the description.
#[derive(Debug, Default)]
struct Plan {
    hung: Vec<Hung>,
    sets: Vec<Set>,
    focus: BTreeMap<String, [f64; 3]>,
    symbols: BTreeMap<String, Vec<(String, Frame)>>,
    skipped: BTreeMap<String, (usize, usize)>,
    /// The line of the first malformed matrix, and the number of such matrices.
    odd_matrices: Option<(usize, usize)>,
}

/// Reason why a plan, or a file in it, is not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum Fault {
    /// It is damaged, or exceeds a limit.
    #[error("{0}")]
    Said(String),
    /// It exceeds the memory limit.
    #[error("{0}")]
    Memory(String),
    #[error("nothing of its plan is a light or a set here: {0}")]
    Nothing(String),
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Fault {
    /// Adds the name of the faulty file.
    fn of(self, file: &str) -> Fault {
        match self {
            Fault::Said(why) => Fault::Said(format!("{file}: {why}")),
            Fault::Memory(why) => Fault::Memory(format!("{file}: {why}")),
            other => other,
        }
    }

    /// The error with the plan's name and advice.
    fn of_plan(self, name: &str, work: Work<'_>) -> ImportError {
        let help = match &self {
            Fault::Cancelled(cancelled) => return (*cancelled).into(),
            Fault::Memory(_) => format!(
                "allow more with `--memory MB`, which is {} here, or export less of the set",
                work.memory >> 20
            ),
            Fault::Nothing(_) => "a plan needs a fixture that gives light, or a set in glTF \
                                  (.gltf, .glb)"
                .to_owned(),
            Fault::Said(_) => "export the plan again as MVR (.mvr)".to_owned(),
        };
        Box::new(Diagnostic::error("", format!("`{name}`: {self}")).help(help)).into()
    }
}

fn said<T>(why: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Said(why.into()))
}

fn too_many<T>() -> Result<T, Fault> {
    said(format!("its plan has more than {MOST} objects of a kind"))
}

/// Imports the rig of the archive `name`; the caller writes geometry into `folder` next to the
/// show. Uses at most the memory of `work`, including the archive and unpacked files.
///
/// # Errors
/// A diagnostic with the fault and its place in the description, or a cancel.
pub fn import(
    name: &str,
    bytes: &[u8],
    folder: &str,
    work: Work<'_>,
) -> Result<Carried, ImportError> {
    read(name, bytes, folder, work).map_err(|fault| fault.of_plan(name, work))
}

fn read(name: &str, bytes: &[u8], folder: &str, work: Work<'_>) -> Result<Carried, Fault> {
    if bytes.len() > LIMIT {
        return said(format!("it has more than {} MB", LIMIT >> 20));
    }
    let work = work.holding(bytes.len());
    let archive = Archive::new(bytes)?;
    let Some(scene) = archive.read(SCENE, work)? else {
        return said(format!("it holds no {SCENE}"));
    };
    let text = String::from_utf8_lossy(&scene);
    let held = work.holding(scene.len() + text.len());
    let document = gdtf::parsed(&text, held).map_err(|fault| fault.of(SCENE))?;
    let mut reader = Reader {
        plan: Plan::default(),
        text: &text,
        line: (0, 1),
        work,
    };
    for symbol in document.descendants().filter(|n| n.has_tag_name("Symdef")) {
        let id = symbol.attribute("uuid").unwrap_or("").to_ascii_lowercase();
        reader.plan.symbols.insert(id, geometry(symbol));
    }
    for layer in document.descendants().filter(|n| n.has_tag_name("Layer")) {
        reader.collect(layer, Frame::default(), DEPTH)?;
    }
    let plan = reader.plan;
    if plan.hung.is_empty() && plan.sets.is_empty() && plan.skipped.is_empty() {
        return said("its plan has neither fixtures nor a set");
    }
    drop(document);
    rig::carried(name, &plan, &archive, folder, held)
}

/// Collects a plan from its description.
struct Reader<'t> {
    plan: Plan,
    text: &'t str,
    /// A position in the text and its line, the start for counting to the next position.
    line: (usize, usize),
    work: Work<'t>,
}

impl Reader<'_> {
    /// Walks the tree of objects, each in the frame of its parent.
    fn collect(&mut self, node: Node<'_, '_>, around: Frame, depth: usize) -> Result<(), Fault> {
        self.work.check()?;
        let matrix = node.children().find(|n| n.has_tag_name("Matrix"));
        let own = matrix.and_then(|n| Frame::of_axes(n.text().unwrap_or("")));
        if matrix.is_some() && own.is_none() {
            let line = self.line(node);
            let (_, count) = self.plan.odd_matrices.get_or_insert((line, 0));
            *count += 1;
        }
        let frame = own.map_or(around, |own| around.then(own));
        let tag = node.tag_name().name();
        match tag {
            "Fixture" => {
                if self.plan.hung.len() >= MOST {
                    return too_many();
                }
                let line = self.line(node);
                self.plan.hung.push(fixture(node, line, frame));
            }
            "FocusPoint" => {
                let id = node.attribute("uuid").unwrap_or("").to_ascii_lowercase();
                self.plan.focus.insert(id, frame.origin);
            }
            "SceneObject" | "Truss" | "Support" | "VideoScreen" => self.object(node, frame)?,
            _ => {}
        }
        if depth == 0 {
            return Ok(());
        }
        for list in node.children().filter(|n| n.has_tag_name("ChildList")) {
            for object in list.children().filter(Node::is_element) {
                self.collect(object, frame, depth - 1)?;
            }
        }
        Ok(())
    }

    /// Adds the geometry of an object, and that of its symbols.
    fn object(&mut self, node: Node<'_, '_>, frame: Frame) -> Result<(), Fault> {
        let line = self.line(node);
        for (file, inner) in geometry(node) {
            self.set(line, file, frame.then(inner))?;
        }
        let own = node.children().find(|n| n.has_tag_name("Geometries"));
        let symbols = own.into_iter().flat_map(|own| own.children());
        for symbol in symbols.filter(|n| n.has_tag_name("Symbol")) {
            let id = symbol
                .attribute("symdef")
                .unwrap_or("")
                .to_ascii_lowercase();
            let placed = child(symbol, "Matrix")
                .and_then(Frame::of_axes)
                .unwrap_or_default();
            for (file, inner) in self.plan.symbols.get(&id).cloned().unwrap_or_default() {
                self.set(line, file, frame.then(placed).then(inner))?;
            }
        }
        Ok(())
    }

    fn set(&mut self, line: usize, file: String, frame: Frame) -> Result<(), Fault> {
        self.work.check()?;
        let lower = file.to_ascii_lowercase();
        if lower.ends_with(".glb") || lower.ends_with(".gltf") {
            if self.plan.sets.len() >= MOST {
                return too_many();
            }
            self.plan.sets.push(Set { line, file, frame });
        } else {
            let ending = lower.rsplit('.').next().unwrap_or("").to_owned();
            let skipped = self.plan.skipped.entry(ending).or_insert((line, 0));
            skipped.1 += 1;
        }
        Ok(())
    }

    /// Line of a node, counted from the previous one.
    fn line(&mut self, node: Node<'_, '_>) -> usize {
        let start = node.range().start;
        let (from, line) = match self.line {
            (at, line) if at <= start => (at, line),
            _ => (0, 1),
        };
        let between = self.text.as_bytes().get(from..start).unwrap_or_default();
        let line = line + between.iter().filter(|byte| **byte == b'\n').count();
        self.line = (start, line);
        line
    }
}

/// The geometry files of an object, without nested objects.
fn geometry(node: Node<'_, '_>) -> Vec<(String, Frame)> {
    let lists = node
        .children()
        .filter(|n| n.has_tag_name("Geometries") || n.has_tag_name("ChildList"));
    let files = lists.filter(|list| list.has_tag_name("Geometries") || node.has_tag_name("Symdef"));
    let files = files.flat_map(|list| list.children());
    let files = files.filter(|n| n.has_tag_name("Geometry3D"));
    let placed = files.map(|n| {
        let frame = child(n, "Matrix").and_then(Frame::of_axes);
        let file = n.attribute("fileName").unwrap_or("").to_owned();
        (file, frame.unwrap_or_default())
    });
    placed.filter(|(file, _)| !file.is_empty()).collect()
}

fn fixture(node: Node<'_, '_>, line: usize, frame: Frame) -> Hung {
    let text = |name: &str| child(node, name).unwrap_or("").trim().to_owned();
    let address = node.descendants().find(|n| n.has_tag_name("Address"));
    let commands = node
        .descendants()
        .filter(|n| n.has_tag_name("CustomCommand"));
    let commands: Vec<&str> = commands.filter_map(|n| n.text()).collect();
    let set = |channel: &str| {
        let own = commands.iter().filter(|text| text.contains(channel));
        let mut own = own.filter_map(|text| text.rsplit_once(",f")?.1.trim().parse().ok());
        own.find(|angle: &f64| angle.abs() < 1000.0)
    };
    Hung {
        line,
        name: node.attribute("name").unwrap_or("").to_owned(),
        id: Some(text("FixtureIDNumeric"))
            .filter(|id| id.parse::<u32>().is_ok_and(|id| id > 0))
            .unwrap_or_else(|| text("FixtureID")),
        kind: text("GDTFSpec"),
        mode: text("GDTFMode"),
        frame,
        focus: Some(text("Focus").to_ascii_lowercase()).filter(|focus| !focus.is_empty()),
        address: address.and_then(|n| n.text()).map(str::to_owned),
        colour: colour(&text("Color")),
        zoom: set(".Zoom.").filter(|zoom| *zoom > 0.0 && *zoom < 170.0),
        pan: set(".Pan."),
        tilt: set(".Tilt."),
    }
}

/// An address as universe and number, both from 1: `2.101`, or an absolute number over all
/// universes.
fn addressed(text: &str) -> Option<(u32, u32)> {
    let text = text.trim();
    if let Some((universe, number)) = text.split_once('.') {
        let address = (universe.parse().ok()?, number.parse().ok()?);
        return Some(address)
            .filter(|(universe, number)| *universe > 0 && (1..=512).contains(number));
    }
    let absolute: u32 = text.parse().ok().filter(|absolute| *absolute > 0)?;
    Some(((absolute - 1) / 512 + 1, (absolute - 1) % 512 + 1))
}

fn colour(text: &str) -> Option<[f64; 3]> {
    let mut numbers = text.split(',').map(|word| word.trim().parse::<f64>().ok());
    let colour = [numbers.next()??, numbers.next()??, numbers.next()??];
    colour.iter().all(|v| v.is_finite()).then_some(colour)
}

/// The text of a child element.
fn child<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.children().find(|n| n.has_tag_name(name))?.text()
}

/// Rounds to a tenth of a millimetre.
fn rounded(number: f64) -> String {
    let number = (number * 1e4).round() / 1e4;
    format!("{}", if number == 0.0 { 0.0 } else { number })
}
