//! ZIP archives (PKWARE APPNOTE 6.3): stored and deflated files, by the central directory.
//!
//! The `zip` crate depends on crates for encryption that do not compile for the web; `flate2` is
//! used for PNG anyway.

use std::collections::BTreeMap;
use std::io::Read;

use flate2::Crc;
use flate2::read::DeflateDecoder;

use super::{Fault, said};
use footlight_host::work::Work;

/// Most files of an archive.
const MOST_FILES: usize = 10_000;
/// Bytes unpacked between two checks for cancellation.
const STEP: usize = 1 << 20;

#[derive(Clone, Copy, Debug)]
struct Entry {
    method: u16,
    crc: u32,
    packed: usize,
    header: usize,
}

/// An archive, indexed by file name.
#[derive(Debug)]
pub struct Archive<'a> {
    bytes: &'a [u8],
    files: BTreeMap<String, Entry>,
}

impl<'a> Archive<'a> {
    /// Reads the directory.
    ///
    /// # Errors
    /// For an invalid archive, or one of more than [`MOST_FILES`] files.
    pub fn new(bytes: &'a [u8]) -> Result<Archive<'a>, Fault> {
        let end = bytes
            .windows(4)
            .rposition(|four| four == b"PK\x05\x06")
            .ok_or_else(cut_off)?;
        let count = short(bytes, end + 10)?;
        let mut at = long(bytes, end + 16)? as usize;
        if usize::from(count) > MOST_FILES {
            return said(format!("it has more than {MOST_FILES} files"));
        }
        let mut files = BTreeMap::new();
        for _ in 0..count {
            if bytes.get(at..at + 4) != Some(b"PK\x01\x02") {
                return Err(cut_off());
            }
            let length = |offset: usize| short(bytes, at + offset).map(usize::from);
            let (name, extra, comment) = (length(28)?, length(30)?, length(32)?);
            let entry = Entry {
                method: short(bytes, at + 10)?,
                crc: long(bytes, at + 16)?,
                packed: long(bytes, at + 20)? as usize,
                header: long(bytes, at + 42)? as usize,
            };
            let text = bytes.get(at + 46..at + 46 + name).ok_or_else(cut_off)?;
            files.insert(String::from_utf8_lossy(text).into_owned(), entry);
            at += 46 + name + extra + comment;
        }
        Ok(Archive { bytes, files })
    }

    /// The names of the files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// True where there is a file of this name.
    pub fn has(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// The archive's name for a file that another one refers to: equal, or equal except for case.
    pub fn inner_name(&self, name: &str) -> Option<&str> {
        let as_is = self
            .files
            .get_key_value(name)
            .map(|(name, _)| name.as_str());
        as_is.or_else(|| self.names().find(|other| other.eq_ignore_ascii_case(name)))
    }

    /// A file's bytes, within the memory of `work`; `None` when there is no such file.
    ///
    /// # Errors
    /// For a damaged or too large file, an unknown compression, or a cancel.
    pub fn read(&self, name: &str, work: Work<'_>) -> Result<Option<Vec<u8>>, Fault> {
        let Some(entry) = self.files.get(name) else {
            return Ok(None);
        };
        let damaged = || Fault::Said(format!("`{name}` in it is damaged"));
        let length = |offset: usize| short(self.bytes, entry.header.saturating_add(offset));
        let skipped = usize::from(length(26)?) + usize::from(length(28)?);
        let start = entry.header + 30 + skipped;
        let end = start.checked_add(entry.packed).ok_or_else(damaged)?;
        let packed = self.bytes.get(start..end).ok_or_else(damaged)?;
        let mut unpacker: Box<dyn Read> = match entry.method {
            0 => Box::new(packed),
            8 => Box::new(DeflateDecoder::new(packed)),
            method => {
                return said(format!(
                    "`{name}` in it is packed by method {method}; only stored and deflated files \
                     are read"
                ));
            }
        };
        let mut out = Vec::new();
        loop {
            work.check()?;
            let mut step = unpacker.by_ref().take(STEP as u64);
            let read = step.read_to_end(&mut out).map_err(|_| damaged())?;
            if out.len() > work.memory {
                let why = format!("`{name}` in it does not fit into the memory allowed");
                return Err(Fault::Memory(why));
            }
            if read == 0 {
                break;
            }
        }
        let mut crc = Crc::new();
        crc.update(&out);
        if crc.sum() == entry.crc {
            Ok(Some(out))
        } else {
            Err(damaged())
        }
    }
}

fn cut_off() -> Fault {
    Fault::Said("it is no ZIP archive, or it is cut off".to_owned())
}

fn short(bytes: &[u8], at: usize) -> Result<u16, Fault> {
    let two = bytes.get(at..).and_then(|rest| rest.first_chunk::<2>());
    two.map(|two| u16::from_le_bytes(*two)).ok_or_else(cut_off)
}

fn long(bytes: &[u8], at: usize) -> Result<u32, Fault> {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
    four.map(|four| u32::from_le_bytes(*four))
        .ok_or_else(cut_off)
}
