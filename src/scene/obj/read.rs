//! Lines of OBJ and MTL files to vertices, faces and materials; what is wrong is refused with the
//! number of its line.

use std::collections::BTreeMap;

use super::super::Material;
use super::super::import::FAR;
use super::{CORNER_LIMIT, LineError, POLYGON_LIMIT, SceneError, VERTEX_LIMIT};
use crate::geometry::{Vec3, vec3};
use crate::units::Rgb;

/// A face of the OBJ file.
pub(super) struct Face {
    /// Its line, counted from 1.
    pub(super) line: usize,
    /// Its corners, in the coordinates of the file.
    pub(super) corners: Vec<Vec3>,
}

/// A `usemtl` with its faces, in the order of the file.
pub(super) struct Group {
    pub(super) material: String,
    /// Its line, counted from 1.
    pub(super) line: usize,
    pub(super) faces: Vec<Face>,
}

/// An OBJ file.
#[derive(Default)]
pub(super) struct Obj {
    /// In the order of the file.
    pub(super) groups: Vec<Group>,
    /// Each `mtllib`.
    pub(super) libraries: Vec<String>,
    vertices: Vec<Vec3>,
    faces: usize,
    /// Of all faces together.
    corners: usize,
}

impl Obj {
    /// Reads an OBJ file.
    pub(super) fn new(path: &str, bytes: &[u8]) -> Result<Obj, SceneError> {
        let mut obj = Obj::default();
        each_line(path, bytes, |text, line| obj.line(text, line))?;
        Ok(obj)
    }

    fn line(&mut self, text: &str, line: usize) -> Result<(), LineError> {
        let (keyword, rest) = split(text);
        match keyword {
            "v" => self.vertex(rest)?,
            "f" => self.face(rest, line)?,
            "usemtl" => self.groups.push(Group {
                material: named("usemtl", rest)?.to_owned(),
                line,
                faces: Vec::new(),
            }),
            "mtllib" => self.libraries.push(named("mtllib", rest)?.to_owned()),
            _ => {}
        }
        Ok(())
    }

    /// Three coordinates; a weight or a colour behind them is left out, as polygons have neither.
    fn vertex(&mut self, rest: &str) -> Result<(), LineError> {
        let found = rest.split_whitespace().count();
        let [x, y, z] = numbers("v", rest, found.clamp(3, 7))?;
        if self.vertices.len() == VERTEX_LIMIT {
            return Err(limit("vertices", VERTEX_LIMIT));
        }
        if let Some(far) = [x, y, z].into_iter().find(|c| c.abs() > FAR) {
            return Err(LineError::Far(far));
        }
        self.vertices.push(vec3(x, y, z));
        Ok(())
    }

    fn face(&mut self, rest: &str, line: usize) -> Result<(), LineError> {
        let count = rest.split_whitespace().count();
        if count < 3 {
            return Err(LineError::Corners(count));
        }
        self.corners += count;
        self.faces += 1;
        for (found, most, what) in [
            (count, CORNER_LIMIT, "corners of a face"),
            (self.corners, VERTEX_LIMIT, "corners"),
            (self.faces, POLYGON_LIMIT, "faces"),
        ] {
            if found > most {
                return Err(limit(what, most));
            }
        }
        let group = self.groups.last_mut().ok_or(LineError::NoMaterial)?;
        let corners = rest.split_whitespace().map(|w| corner(w, &self.vertices));
        let corners = corners.collect::<Result<_, _>>()?;
        group.faces.push(Face { line, corners });
        Ok(())
    }
}

/// The vertex of a corner: `7`, `7/1`, `7//2`, or `-1/…`, which counts from the last.
fn corner(word: &str, vertices: &[Vec3]) -> Result<Vec3, LineError> {
    let (first, others) = word.split_once('/').unwrap_or((word, ""));
    let is_index = |part: &str| part.is_empty() || part.parse::<i64>().is_ok();
    let well_formed = others.split('/').count() <= 2 && others.split('/').all(is_index);
    let index = first.parse::<i64>().ok().filter(|_| well_formed);
    let index = index.ok_or_else(|| LineError::Corner(cut(word)))?;
    let defined = vertices.len();
    let place = if index < 0 {
        index.saturating_add(defined as i64)
    } else {
        index - 1
    };
    let vertex = usize::try_from(place).ok().and_then(|i| vertices.get(i));
    vertex.copied().ok_or(LineError::Index { index, defined })
}

/// The materials of all MTL files.
#[derive(Default)]
pub(super) struct Materials {
    /// In the order of the files.
    pub(super) list: Vec<Material>,
    /// Indices into `list`.
    pub(super) by_name: BTreeMap<String, usize>,
}

impl Materials {
    /// Adds the materials of an MTL file.
    pub(super) fn read(&mut self, path: &str, bytes: &[u8]) -> Result<(), SceneError> {
        let first = self.list.len();
        each_line(path, bytes, |text, _| self.line(text, first))
    }

    /// Reads a line of the file whose materials begin at `first`.
    fn line(&mut self, text: &str, first: usize) -> Result<(), LineError> {
        let (keyword, rest) = split(text);
        let open = self.list.iter_mut().skip(first).next_back();
        match (keyword, open) {
            ("newmtl", _) => {
                let name = named("newmtl", rest)?.to_owned();
                if self.by_name.insert(name.clone(), self.list.len()).is_some() {
                    return Err(LineError::TwiceMaterial(cut(&name)));
                }
                self.list.push(Material::diffuse(name, Rgb::default()));
            }
            ("Kd" | "Ke", None) => return Err(LineError::Name("newmtl")),
            ("Kd", Some(material)) => {
                let kd = colour("Kd", rest)?;
                if let Some(bad) = kd.iter().find(|v| !(0.0..=1.0).contains(*v)) {
                    return Err(LineError::Reflectance(*bad));
                }
                material.reflectance = Rgb(kd);
            }
            ("Ke", Some(material)) => {
                let ke = colour("Ke", rest)?;
                if let Some(bad) = ke.iter().find(|v| **v < 0.0) {
                    return Err(LineError::Emission(*bad));
                }
                material.emission = Rgb(ke);
            }
            _ => {}
        }
        Ok(())
    }
}

/// Calls `read` for every line, without comments and byte order mark, lines that end in a backslash
/// joined with the next. Errors get the line's number.
fn each_line(
    path: &str,
    bytes: &[u8],
    mut read: impl FnMut(&str, usize) -> Result<(), LineError>,
) -> Result<(), SceneError> {
    let refuse = |line, reason| SceneError::Line {
        path: path.to_owned(),
        line,
        reason,
    };
    let mut read = |text: &str, line| {
        read(without_comment(text).trim(), line).map_err(|reason| refuse(line, reason))
    };
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let mut joined = String::new();
    let mut first = 1;
    for (line, text) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let text = std::str::from_utf8(text).map_err(|_| refuse(line, LineError::NotText))?;
        if text.contains('\0') {
            return Err(refuse(line, LineError::NotText));
        }
        if joined.is_empty() {
            first = line;
        }
        let text = text.trim_end();
        if let Some(open) = text.strip_suffix('\\') {
            joined.push_str(open);
            joined.push(' ');
            continue;
        }
        joined.push_str(text);
        read(&joined, first)?;
        joined.clear();
    }
    read(&joined, first)
}

/// A comment starts with a `#` at the start of a word: names such as `Wood#2` are whole.
fn without_comment(line: &str) -> &str {
    let mut marks = line.match_indices('#').map(|(at, _)| line.split_at(at).0);
    marks
        .find(|before| before.chars().next_back().is_none_or(char::is_whitespace))
        .unwrap_or(line)
}

/// The first word and what follows it.
fn split(line: &str) -> (&str, &str) {
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (keyword, rest.trim())
}

fn named<'t>(keyword: &'static str, rest: &'t str) -> Result<&'t str, LineError> {
    if rest.is_empty() {
        Err(LineError::Name(keyword))
    } else {
        Ok(rest)
    }
}

/// Three channels, or one number for all three, as MTL allows.
fn colour(keyword: &'static str, rest: &str) -> Result<[f64; 3], LineError> {
    if rest.split_whitespace().count() == 1 {
        let [grey, ..] = numbers(keyword, rest, 1)?;
        return Ok([grey; 3]);
    }
    numbers(keyword, rest, 3)
}

/// The first three of `expected` finite numbers.
fn numbers(keyword: &'static str, rest: &str, expected: usize) -> Result<[f64; 3], LineError> {
    let found = rest.split_whitespace().count();
    let mut values = [0.0; 3];
    for (at, word) in rest.split_whitespace().enumerate().take(expected) {
        let value = word.parse().ok().filter(|v: &f64| v.is_finite());
        let value = value.ok_or_else(|| LineError::Number(cut(word)))?;
        if let Some(to) = values.get_mut(at) {
            *to = value;
        }
    }
    if found == expected {
        Ok(values)
    } else {
        Err(LineError::Count {
            keyword,
            expected: expected.min(3),
            found,
        })
    }
}

/// The error of too many of `what`.
pub(super) fn limit(what: &'static str, limit: usize) -> LineError {
    LineError::Limit { what, limit }
}

/// Enough of a word for a message.
fn cut(word: &str) -> String {
    word.chars().take(40).collect()
}
