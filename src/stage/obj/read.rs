//! Parses lines of OBJ files to vertices and faces; errors carry the line number.

use std::collections::BTreeMap;

use super::super::shading::Corner;
use super::{CORNER_LIMIT, POLYGON_LIMIT, SceneError, VERTEX_LIMIT, limit};
use crate::stage_file::FAR;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::printable::of_bytes;

/// Indices of a corner, from 0: vertex, texture coordinate, normal.
pub(super) type Indices = (u32, Option<u32>, Option<u32>);

/// A face of the OBJ file.
pub(super) struct Face {
    /// Its line, counted from 1.
    pub(super) line: usize,
    pub(super) corners: Vec<Indices>,
}

/// Faces of one material and one group, in the order of the file.
pub(super) struct Group {
    /// Name in `usemtl`, and its line.
    pub(super) material: Option<(String, usize)>,
    /// The latest `g` or `o`.
    pub(super) part: Option<String>,
    pub(super) faces: Vec<Face>,
}

/// An OBJ file.
#[derive(Default)]
pub(super) struct Obj {
    /// In the order of the file.
    pub(super) groups: Vec<Group>,
    /// The text of each `mtllib`.
    pub(super) libraries: Vec<String>,
    vertices: Vec<Vec3>,
    /// Unusable vertices, with the reason: no face may have them.
    nowhere: BTreeMap<u32, String>,
    /// Skipped contents, with the first line of each.
    pub(super) unread: BTreeMap<&'static str, usize>,
    /// Texture coordinates from the left and from the top; `None` when the file has no numbers.
    places: Vec<Option<[f64; 2]>>,
    normals: Vec<Option<Vec3>>,
    faces: usize,
    /// Corners of all faces together.
    corners: usize,
}

impl Obj {
    /// Reads an OBJ file.
    pub(super) fn new(path: &str, bytes: &[u8]) -> Result<Obj, SceneError> {
        let mut obj = Obj::default();
        each_line(path, bytes, |text, line| obj.line(text, line))?;
        Ok(obj)
    }

    /// The values at a corner.
    pub(super) fn corner(&self, (vertex, place, normal): Indices) -> Corner {
        Corner {
            point: self
                .vertices
                .get(vertex as usize)
                .copied()
                .unwrap_or_default(),
            normal: normal.and_then(|i| self.normals.get(i as usize).copied().flatten()),
            place: place.and_then(|i| self.places.get(i as usize).copied().flatten()),
        }
    }

    fn line(&mut self, text: &str, line: usize) -> Result<(), String> {
        let (keyword, rest) = split(text);
        match keyword {
            "v" => self.vertex(rest, line)?,
            "vt" => {
                let count = rest.split_whitespace().count().clamp(1, 3);
                let place = exact_numbers("vt", rest, count)?;
                let place = finite(place, rest).ok().map(|[u, v, _]| [u, 1.0 - v]);
                more(&mut self.places, place, "places in textures")?;
            }
            "vn" => {
                let normal = exact_numbers("vn", rest, 3)?;
                let normal = finite(normal, rest).ok().map(|[x, y, z]| vec3(x, y, z));
                more(&mut self.normals, normal, "normals")?;
            }
            // `fo` is an old form of it.
            "f" | "fo" => self.face(rest, line)?,
            "l" | "p" => self.leave_out("points and lines: they have no area", line),
            "curv" | "curv2" | "surf" => self.leave_out("free-form curves and surfaces", line),
            "usemtl" => {
                let material = (!rest.is_empty()).then(|| (rest.to_owned(), line));
                let part = self.groups.last().and_then(|g| g.part.clone());
                self.group(material, part);
            }
            "g" | "o" => {
                let material = self.groups.last().and_then(|g| g.material.clone());
                self.group(material, (!rest.is_empty()).then(|| rest.to_owned()));
            }
            "mtllib" => self.libraries.push(named("mtllib", rest)?.to_owned()),
            _ => {}
        }
        Ok(())
    }

    /// Begins another group; replaces one that has no faces.
    fn group(&mut self, material: Option<(String, usize)>, part: Option<String>) {
        self.groups.pop_if(|last| last.faces.is_empty());
        self.groups.push(Group {
            material,
            part,
            faces: Vec::new(),
        });
    }

    fn leave_out(&mut self, what: &'static str, line: usize) {
        self.unread.entry(what).or_insert(line);
    }

    /// Reads three coordinates; a weight or a colour after them is ignored.
    fn vertex(&mut self, rest: &str, line: usize) -> Result<(), String> {
        let behind = rest.split_whitespace().count().saturating_sub(3);
        if behind >= 3 {
            self.leave_out("colours of vertices: their materials' count", line);
        }
        let read = match behind {
            1..=4 => first_numbers("v", rest, 3),
            _ => exact_numbers("v", rest, 3),
        };
        let [mut x, mut y, mut z] = read?;
        if let Err(reason) = finite([x, y, z], rest) {
            self.nowhere.insert(self.vertices.len() as u32, reason);
            [x, y, z] = [0.0; 3];
        }
        if let Some(far) = [x, y, z].into_iter().find(|c| c.abs() > FAR) {
            return Err(format!("coordinate {far} is beyond 1e9 metres"));
        }
        more(&mut self.vertices, vec3(x, y, z), "vertices")
    }

    fn face(&mut self, rest: &str, line: usize) -> Result<(), String> {
        let count = rest.split_whitespace().count();
        if count < 3 {
            self.leave_out("faces of fewer than 3 corners", line);
            return Ok(());
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
        let defined = [self.vertices.len(), self.places.len(), self.normals.len()];
        let corners = rest.split_whitespace().map(|w| corner(w, defined));
        let corners: Vec<Indices> = corners.collect::<Result<_, _>>()?;
        let nowhere = corners
            .iter()
            .find_map(|(vertex, ..)| self.nowhere.get(vertex));
        if let Some(reason) = nowhere {
            return Err(reason.clone());
        }
        if self.groups.is_empty() {
            self.group(None, None);
        }
        if let Some(group) = self.groups.last_mut() {
            group.faces.push(Face { line, corners });
        }
        Ok(())
    }
}

/// Adds an element, within the limit.
fn more<T>(list: &mut Vec<T>, value: T, what: &'static str) -> Result<(), String> {
    if list.len() == VERTEX_LIMIT {
        return Err(limit(what, VERTEX_LIMIT));
    }
    list.push(value);
    Ok(())
}

/// Indices of a corner: `7`, `7/1`, `7//2`, `7/1/2`; negative ones count from the last. A missing
/// texture coordinate or normal is ignored.
fn corner(word: &str, [vertices, places, normals]: [usize; 3]) -> Result<Indices, String> {
    let mut parts = word.split('/').map(|part| match part {
        "" => Ok(None),
        part => match part.parse::<i64>() {
            Ok(index) => Ok(Some(index)),
            Err(_) => Err(no_corner(word)),
        },
    });
    let mut next = || parts.next().unwrap_or(Ok(None));
    let (vertex, place, normal) = (next()?, next()?, next()?);
    let Some(vertex) = vertex.filter(|_| parts.next().is_none()) else {
        return Err(no_corner(word));
    };
    let missing = || format!("vertex {vertex} does not exist; {vertices} are defined up to here");
    Ok((
        position(vertex, vertices).ok_or_else(missing)?,
        place.and_then(|i| position(i, places)),
        normal.and_then(|i| position(i, normals)),
    ))
}

fn no_corner(word: &str) -> String {
    format!("`{}` is not a corner of a face", cut(word))
}

/// Converts an index of the file to one from 0.
fn position(index: i64, defined: usize) -> Option<u32> {
    let place = if index < 0 {
        index.saturating_add(defined as i64)
    } else {
        index - 1
    };
    u32::try_from(place)
        .ok()
        .filter(|i| (*i as usize) < defined)
}

/// Calls `read` for every line, without comments and byte order mark; lines that end in a backslash
/// are joined with the next. Errors get the line's number.
pub(super) fn each_line(
    path: &str,
    bytes: &[u8],
    mut read: impl FnMut(&str, usize) -> Result<(), String>,
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
    // Old files end their lines with a carriage return alone.
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    for (line, text) in (1..).zip(bytes.split(|b| *b == end)) {
        let text = of_bytes(text);
        if text.contains('\0') {
            return Err(refuse(
                line,
                "not text; is this an OBJ or MTL file?".to_owned(),
            ));
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

/// A comment starts with a `#` at the start of a word: names such as `Wood#2` stay whole.
fn without_comment(line: &str) -> &str {
    let mut marks = line.match_indices('#').map(|(at, _)| line.split_at(at).0);
    marks
        .find(|before| before.chars().next_back().is_none_or(char::is_whitespace))
        .unwrap_or(line)
}

/// The first word and the rest.
pub(super) fn split(line: &str) -> (&str, &str) {
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (keyword, rest.trim())
}

/// The files of an `mtllib` line: each name ends with a word that ends in `.mtl`.
pub(super) fn names_of_libraries(rest: &str) -> Vec<&str> {
    let mut names = Vec::new();
    let mut start = 0;
    for (at, ending) in rest.to_ascii_lowercase().match_indices(".mtl") {
        let end = at + ending.len();
        let after = rest.get(end..).unwrap_or_default();
        if after.is_empty() || after.starts_with(char::is_whitespace) {
            names.extend(rest.get(start..end).map(str::trim));
            start = end;
        }
    }
    let last = rest.get(start..).map(str::trim);
    names.extend(last.filter(|name| !name.is_empty()));
    names
}

pub(super) fn named<'t>(keyword: &'static str, rest: &'t str) -> Result<&'t str, String> {
    if rest.is_empty() {
        Err(format!("`{keyword}` needs a name"))
    } else {
        Ok(rest)
    }
}

/// Reads three channels, or one number for all three, as MTL allows.
pub(super) fn colour(keyword: &str, rest: &str) -> Result<[f64; 3], String> {
    if rest.split_whitespace().count() == 1 {
        let [grey, ..] = numbers(keyword, rest, 1)?;
        return Ok([grey; 3]);
    }
    numbers(keyword, rest, 3)
}

/// Reads the first three of `expected` finite numbers.
pub(super) fn numbers(keyword: &str, rest: &str, expected: usize) -> Result<[f64; 3], String> {
    finite(exact_numbers(keyword, rest, expected)?, rest)
}

/// Checks that the numbers read from `rest` are finite.
fn finite(numbers: [f64; 3], rest: &str) -> Result<[f64; 3], String> {
    let mut words = rest.split_whitespace().zip(numbers);
    match words.find(|(_, number)| !number.is_finite()) {
        Some((word, _)) => Err(no_number(word)),
        None => Ok(numbers),
    }
}

/// Reads the first three of exactly `expected` numbers.
fn exact_numbers(keyword: &str, rest: &str, expected: usize) -> Result<[f64; 3], String> {
    let values = first_numbers(keyword, rest, expected)?;
    match rest.split_whitespace().count() {
        found if found == expected => Ok(values),
        found => Err(count(keyword, expected, found)),
    }
}

/// Reads the first three of at least `expected` numbers.
fn first_numbers(keyword: &str, rest: &str, expected: usize) -> Result<[f64; 3], String> {
    let found = rest.split_whitespace().count();
    let mut values = [0.0; 3];
    for (at, word) in rest.split_whitespace().enumerate().take(expected) {
        let value = word.parse().map_err(|_| no_number(word))?;
        if let Some(to) = values.get_mut(at) {
            *to = value;
        }
    }
    if found < expected {
        return Err(count(keyword, expected, found));
    }
    Ok(values)
}

fn no_number(word: &str) -> String {
    format!("`{}` is not a finite number", cut(word))
}

fn count(keyword: &str, expected: usize, found: usize) -> String {
    let expected = expected.min(3);
    format!("`{keyword}` needs {expected} numbers and has {found}")
}

/// A word shortened for a message.
pub(super) fn cut(word: &str) -> String {
    word.chars().take(40).collect()
}
