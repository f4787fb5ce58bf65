//! The bytes of a glTF file's buffers.

use std::borrow::Cow;

use super::{Fault, entry, short};

/// The buffers of a file, in order. An unused buffer is empty.
pub struct Buffers<'b>(pub Vec<Cow<'b, [u8]>>);

impl Buffers<'_> {
    /// Bytes of a buffer from an offset on; fewer when the buffer ends earlier.
    pub fn part(
        &self,
        buffer: usize,
        (start, length): (u64, u64),
        from: impl Fn() -> String,
    ) -> Result<&[u8], Fault> {
        let buffer = entry(&self.0, buffer, "buffer", &from)?;
        let found = buffer.len() as u64;
        let start = start.min(found);
        range(buffer, start, length.min(found - start)).map_err(|e| Fault::new(from(), e))
    }
}

/// `length` bytes from `start`.
pub fn range(bytes: &[u8], start: u64, length: u64) -> Result<&[u8], String> {
    let end = start.saturating_add(length);
    let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
    range
        .and_then(|(s, e)| bytes.get(s..e))
        .ok_or_else(|| short(end, bytes.len() as u64))
}
