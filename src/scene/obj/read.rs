//! The gate before tobj: reads every line of an OBJ or MTL file, refuses what is wrong with the
//! line's number, and writes the lines that matter here anew, in a form that cannot surprise tobj.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::super::import::FAR;
use super::{CORNER_LIMIT, LineError, POLYGON_LIMIT, SceneError, VERTEX_LIMIT};

/// Names of materials.
pub(super) type Names = BTreeSet<String>;

/// A face of the OBJ file.
pub(super) struct Face {
    /// Its line, counted from 1.
    pub(super) line: usize,
}

/// An OBJ file that passed.
#[derive(Default)]
pub(super) struct Obj {
    /// For tobj: libraries first, then vertices, materials and faces in the order of the file.
    pub(super) plain: String,
    /// One for each face, in the order of the file.
    pub(super) faces: Vec<Face>,
    /// Each `usemtl` and its line.
    used: Vec<(String, usize)>,
    libraries: String,
    vertices: usize,
    corners: usize,
}

impl Obj {
    /// Refuses the first `usemtl` of a material that is not `known`.
    pub(super) fn require_materials(&self, path: &str, known: &Names) -> Result<(), SceneError> {
        match self.used.iter().find(|(name, _)| !known.contains(name)) {
            None => Ok(()),
            Some((name, line)) => Err(SceneError::Line {
                path: path.to_owned(),
                line: *line,
                reason: LineError::UnknownMaterial(name.clone()),
            }),
        }
    }

    fn line(&mut self, text: &str, line: usize) -> Result<(), LineError> {
        let (keyword, rest) = split(text);
        match keyword {
            "v" => self.vertex(rest),
            "f" => self.face(rest, line),
            "usemtl" => {
                let name = named("usemtl", rest)?;
                plain(&mut self.plain, format_args!("usemtl {name}"));
                self.used.push((name.to_owned(), line));
                Ok(())
            }
            "mtllib" => {
                let name = named("mtllib", rest)?;
                plain(&mut self.libraries, format_args!("mtllib {name}"));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Three coordinates; a weight or a colour behind them is left out, as polygons have neither.
    fn vertex(&mut self, rest: &str) -> Result<(), LineError> {
        let found = rest.split_whitespace().count();
        let [x, y, z] = numbers("v", rest, found.clamp(3, 7))?;
        if self.vertices == VERTEX_LIMIT {
            return Err(limit("vertices", VERTEX_LIMIT));
        }
        if let Some(far) = [x, y, z].into_iter().find(|c| c.abs() > FAR) {
            return Err(LineError::Far(far));
        }
        self.vertices += 1;
        plain(&mut self.plain, format_args!("v {x:e} {y:e} {z:e}"));
        Ok(())
    }

    fn face(&mut self, rest: &str, line: usize) -> Result<(), LineError> {
        let corners = rest.split_whitespace().count();
        if corners < 3 {
            return Err(LineError::Corners(corners));
        }
        self.corners += corners;
        for (found, most, what) in [
            (corners, CORNER_LIMIT, "corners of a face"),
            (self.corners, VERTEX_LIMIT, "corners"),
            (self.faces.len() + 1, POLYGON_LIMIT, "faces"),
        ] {
            if found > most {
                return Err(limit(what, most));
            }
        }
        if self.used.is_empty() {
            return Err(LineError::NoMaterial);
        }
        self.plain.push('f');
        for corner in rest.split_whitespace() {
            let index = self.index(corner)?;
            // Writing to a string cannot fail.
            let _ = write!(self.plain, " {index}");
        }
        self.plain.push('\n');
        self.faces.push(Face { line });
        Ok(())
    }

    /// The vertex of a corner (`7`, `7/1`, `7//2`, `-1/…`), counted from 1.
    fn index(&self, corner: &str) -> Result<i64, LineError> {
        let mut parts = corner.split('/');
        let mut first = None;
        for (place, part) in parts.by_ref().take(3).enumerate() {
            match part.parse::<i64>() {
                Ok(index) if place == 0 => first = Some(index),
                Ok(_) => {}
                Err(_) if place > 0 && part.is_empty() => {}
                Err(_) => return Err(LineError::Corner(cut(corner))),
            }
        }
        let (Some(index), None) = (first, parts.next()) else {
            return Err(LineError::Corner(cut(corner)));
        };
        let defined = self.vertices as i64;
        let absolute = match index {
            i if i < 0 => i.saturating_add(defined + 1),
            i => i,
        };
        if (1..=defined).contains(&absolute) {
            Ok(absolute)
        } else {
            Err(LineError::Index {
                index,
                defined: self.vertices,
            })
        }
    }
}

/// Passes an OBJ file.
pub(super) fn obj(path: &str, bytes: &[u8]) -> Result<Obj, SceneError> {
    let mut obj = Obj::default();
    each_line(path, bytes, |text, line| obj.line(text, line))?;
    obj.plain.insert_str(0, &obj.libraries);
    Ok(obj)
}

/// Passes an MTL file: its text for tobj; its materials' names are added to `known`.
pub(super) fn mtl(path: &str, bytes: &[u8], known: &mut Names) -> Result<String, SceneError> {
    let mut text = String::new();
    let mut open = false;
    each_line(path, bytes, |line, _| {
        let (keyword, rest) = split(line);
        match keyword {
            "newmtl" => {
                let name = named("newmtl", rest)?;
                if !known.insert(name.to_owned()) {
                    return Err(LineError::TwiceMaterial(cut(name)));
                }
                open = true;
                plain(&mut text, format_args!("newmtl {name}"));
            }
            "Kd" | "Ke" if !open => return Err(LineError::Name("newmtl")),
            "Kd" => {
                let kd = colour("Kd", rest)?;
                if let Some(bad) = kd.iter().find(|v| !(0.0..=1.0).contains(*v)) {
                    return Err(LineError::Reflectance(*bad));
                }
                let [r, g, b] = kd;
                plain(&mut text, format_args!("Kd {r:e} {g:e} {b:e}"));
            }
            "Ke" => {
                let ke = colour("Ke", rest)?;
                if let Some(bad) = ke.iter().find(|v| **v < 0.0) {
                    return Err(LineError::Emission(*bad));
                }
                let [r, g, b] = ke;
                plain(&mut text, format_args!("Ke {r:e} {g:e} {b:e}"));
            }
            _ => {}
        }
        Ok(())
    })?;
    Ok(text)
}

/// Calls `read` for every line, comments and a byte order mark taken off, lines that end in a
/// backslash joined with the next, and says where it failed.
fn each_line(
    path: &str,
    bytes: &[u8],
    mut read: impl FnMut(&str, usize) -> Result<(), LineError>,
) -> Result<(), SceneError> {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let mut joined = String::new();
    let mut first = 1;
    for (at, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let refuse = |line, reason| SceneError::Line {
            path: path.to_owned(),
            line,
            reason,
        };
        let text = std::str::from_utf8(line).map_err(|_| refuse(at + 1, LineError::NotText))?;
        if text.contains('\0') {
            return Err(refuse(at + 1, LineError::NotText));
        }
        if joined.is_empty() {
            first = at + 1;
        }
        let text = text.trim_end();
        if let Some(open) = text.strip_suffix('\\') {
            joined.push_str(open);
            joined.push(' ');
            continue;
        }
        joined.push_str(text);
        read(without_comment(&joined).trim(), first).map_err(|reason| refuse(first, reason))?;
        joined.clear();
    }
    read(without_comment(&joined).trim(), first).map_err(|reason| SceneError::Line {
        path: path.to_owned(),
        line: first,
        reason,
    })
}

/// A comment starts with a `#` at the start of a word: names such as `Wood#2` are whole.
fn without_comment(line: &str) -> &str {
    let mut marks = line.match_indices('#').map(|(at, _)| line.split_at(at).0);
    marks
        .find(|before| before.chars().next_back().is_none_or(char::is_whitespace))
        .unwrap_or(line)
}

/// Appends a line. (Writing to a string cannot fail.)
fn plain(to: &mut String, line: std::fmt::Arguments<'_>) {
    let _ = writeln!(to, "{line}");
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

pub(super) fn limit(what: &'static str, limit: usize) -> LineError {
    LineError::Limit { what, limit }
}

/// Enough of a word for a message.
fn cut(word: &str) -> String {
    word.chars().take(40).collect()
}
