//! ZIP archives (PKWARE APPNOTE 6.3): stored and deflated files, by the directory at the end.
//!
//! The crate for it pulls random numbers and cleaning of memory for encryption, which does not compile
//! for the web; `flate2` is here for PNG anyway.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::Read as _;

use flate2::Crc;
use flate2::read::DeflateDecoder;

/// Files of an archive.
const MOST_FILES: usize = 10_000;
/// Bytes of one file when it is unpacked.
const MOST_BYTES: u64 = 64 << 20;
/// Bytes of all files that are unpacked.
const MOST_IN_ALL: u64 = 1 << 30;

/// Why an archive cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ZipError {
    /// It has no directory, or one that leads out of it.
    #[error("it is no ZIP archive, or it is cut off")]
    Damaged,
    /// More files than are read.
    #[error("it has more than {MOST_FILES} files")]
    TooMany,
    /// A file is not what the directory says.
    #[error("`{0}` in it is damaged")]
    File(String),
    /// A file is packed in a way that is not read.
    #[error("`{0}` in it is packed by method {1}; only stored and deflated files are read")]
    Method(String, u16),
    /// A file is larger than what is read.
    #[error("`{0}` in it has more than 64 MB, or all files have more than 1 GB")]
    TooLarge(String),
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    method: u16,
    crc: u32,
    packed: usize,
    header: usize,
}

/// An archive, by the names of its files.
#[derive(Debug)]
pub struct Archive<'a> {
    bytes: &'a [u8],
    files: BTreeMap<String, Entry>,
    unpacked: Cell<u64>,
}

impl<'a> Archive<'a> {
    /// Reads the directory.
    ///
    /// # Errors
    /// [`ZipError::Damaged`] and [`ZipError::TooMany`].
    pub fn new(bytes: &'a [u8]) -> Result<Archive<'a>, ZipError> {
        let end = bytes
            .windows(4)
            .rposition(|four| four == b"PK\x05\x06")
            .ok_or(ZipError::Damaged)?;
        let count = short(bytes, end + 10)?;
        let mut at = long(bytes, end + 16)? as usize;
        if usize::from(count) > MOST_FILES {
            return Err(ZipError::TooMany);
        }
        let mut files = BTreeMap::new();
        for _ in 0..count {
            if bytes.get(at..at + 4) != Some(b"PK\x01\x02") {
                return Err(ZipError::Damaged);
            }
            let length = |offset: usize| short(bytes, at + offset).map(usize::from);
            let (name, extra, comment) = (length(28)?, length(30)?, length(32)?);
            let entry = Entry {
                method: short(bytes, at + 10)?,
                crc: long(bytes, at + 16)?,
                packed: long(bytes, at + 20)? as usize,
                header: long(bytes, at + 42)? as usize,
            };
            let text = bytes
                .get(at + 46..at + 46 + name)
                .ok_or(ZipError::Damaged)?;
            files.insert(String::from_utf8_lossy(text).into_owned(), entry);
            at += 46 + name + extra + comment;
        }
        Ok(Archive {
            bytes,
            files,
            unpacked: Cell::new(0),
        })
    }

    /// The names of the files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// True where there is a file of this name.
    pub fn has(&self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    /// A file's bytes; `None` where there is no such file.
    ///
    /// # Errors
    /// Where it is damaged, too large or packed otherwise.
    pub fn read(&self, name: &str) -> Result<Option<Vec<u8>>, ZipError> {
        let Some(entry) = self.files.get(name) else {
            return Ok(None);
        };
        let damaged = || ZipError::File(name.to_owned());
        let length = |offset: usize| short(self.bytes, entry.header.saturating_add(offset));
        let skipped = usize::from(length(26)?) + usize::from(length(28)?);
        let start = entry.header + 30 + skipped;
        let end = start.checked_add(entry.packed).ok_or_else(damaged)?;
        let packed = self.bytes.get(start..end).ok_or_else(damaged)?;
        let mut out = Vec::new();
        let read = match entry.method {
            0 => packed.take(MOST_BYTES + 1).read_to_end(&mut out),
            8 => DeflateDecoder::new(packed)
                .take(MOST_BYTES + 1)
                .read_to_end(&mut out),
            method => return Err(ZipError::Method(name.to_owned(), method)),
        };
        self.unpacked.set(self.unpacked.get() + out.len() as u64);
        if out.len() as u64 > MOST_BYTES || self.unpacked.get() > MOST_IN_ALL {
            return Err(ZipError::TooLarge(name.to_owned()));
        }
        let mut crc = Crc::new();
        crc.update(&out);
        match read.is_ok() && crc.sum() == entry.crc {
            true => Ok(Some(out)),
            false => Err(damaged()),
        }
    }
}

fn short(bytes: &[u8], at: usize) -> Result<u16, ZipError> {
    let two = bytes.get(at..).and_then(|rest| rest.first_chunk::<2>());
    two.map(|two| u16::from_le_bytes(*two))
        .ok_or(ZipError::Damaged)
}

fn long(bytes: &[u8], at: usize) -> Result<u32, ZipError> {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
    four.map(|four| u32::from_le_bytes(*four))
        .ok_or(ZipError::Damaged)
}
