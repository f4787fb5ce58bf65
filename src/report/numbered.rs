//! Names of numbered images.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use footlight_picture::exr::Precision;

/// Format of a numbered image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameFormat {
    /// As displayed.
    Png,
    /// Linear.
    Exr(Precision),
}

/// A file name with a placeholder for a number: `####`, `%d` or `%04d`, the last in the name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbered {
    folder: PathBuf,
    before: OsString,
    digits: usize,
    after: OsString,
}

impl Numbered {
    /// Finds the placeholder in a path's file name.
    pub fn of(path: &Path) -> Option<Numbered> {
        let name = path.file_name()?.as_encoded_bytes();
        let (before, digits, after) = hashes(name).or_else(|| percent(name))?;
        Some(Numbered {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            before: part(before)?,
            digits,
            after: part(after)?,
        })
    }

    /// The path of image `number`, with more digits if needed.
    pub fn path(&self, number: usize) -> PathBuf {
        let digits = self.digits;
        let mut name = self.before.clone();
        name.push(format!("{number:0digits$}"));
        name.push(&self.after);
        self.folder.join(name)
    }
}

/// The last run of `#` and the text around it.
fn hashes(name: &[u8]) -> Option<(&[u8], usize, &[u8])> {
    let last = name.iter().rposition(|byte| *byte == b'#')?;
    let (head, after) = name.split_at_checked(last + 1)?;
    let before = head.iter().rposition(|byte| *byte != b'#');
    let (before, run) = head.split_at_checked(before.map_or(0, |i| i + 1))?;
    Some((before, run.len(), after))
}

/// The last `%d`, `%4d` or `%04d` and the text around it.
fn percent(name: &[u8]) -> Option<(&[u8], usize, &[u8])> {
    let (before, rest) = name.split_at_checked(name.iter().rposition(|byte| *byte == b'%')?)?;
    let rest = rest.strip_prefix(b"%")?;
    let (digits, after) = rest.split_at_checked(rest.iter().position(|byte| *byte == b'd')?)?;
    let width = match std::str::from_utf8(digits).ok()? {
        "" => 1,
        digits => digits.parse().ok().filter(|n| (1..=9).contains(n))?,
    };
    Some((before, width, after.strip_prefix(b"d")?))
}

/// A part of a file name, cut at ASCII letters.
fn part(bytes: &[u8]) -> Option<OsString> {
    #[cfg(unix)]
    return Some(std::os::unix::ffi::OsStringExt::from_vec(bytes.to_owned()));
    #[cfg(not(unix))]
    return std::str::from_utf8(bytes).ok().map(OsString::from);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn numbers_stand_where_the_name_says() {
        for (name, number, path) in [
            ("frames/####.png", 7, "frames/0007.png"),
            ("a#b##.exr", 123, "a#b123.exr"),
            ("%d.png", 12, "12.png"),
            ("x/s%04d_50%03d.png", 9, "x/s%04d_50009.png"),
            // As in other programs with such patterns.
            ("100%deep.png", 12, "10012eep.png"),
        ] {
            let numbered = Numbered::of(Path::new(name)).unwrap();
            assert_eq!(numbered.path(number), Path::new(path), "{name}");
        }
        for name in ["show.png", "50%.png", "a%0xd.png", "####/a.png"] {
            assert_eq!(Numbered::of(Path::new(name)), None, "{name}");
        }
    }
}
