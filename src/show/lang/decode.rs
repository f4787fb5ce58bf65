//! Decodes the bytes of a show file.

use super::{codes, limits};
use crate::diagnostic::Diagnostic;

/// The diagnostic of a file beyond [`limits::FILE`].
pub(super) fn too_large(name: &str, size: usize) -> Diagnostic {
    let message = format!(
        "`{name}` has {size} bytes; a show has {} at most",
        limits::FILE
    );
    Diagnostic::error(codes::TOO_LARGE, message)
}

/// Decodes a file's bytes as text, without the byte order mark.
///
/// # Errors
/// A diagnostic without a place when the file is too large, binary or not UTF-8.
pub fn decode(name: &str, bytes: &[u8]) -> Result<String, Box<Diagnostic>> {
    if bytes.len() > limits::FILE {
        return Err(Box::new(too_large(name, bytes.len())));
    }
    let (what, at) = match (
        bytes.iter().position(|b| *b == 0),
        std::str::from_utf8(bytes),
    ) {
        (Some(_), _) if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") => {
            let message = format!("`{name}` looks like UTF-16");
            let help = "save it as UTF-8, which every editor offers";
            let refused = Diagnostic::error(codes::NOT_TEXT, message).help(help);
            return Err(Box::new(refused));
        }
        (Some(at), _) => (format!("not a text: byte {at} is zero"), at),
        (None, Err(error)) => {
            let at = error.valid_up_to();
            (format!("not UTF-8: byte {at} begins no character"), at)
        }
        (None, Ok(text)) => return Ok(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned()),
    };
    let line = bytes.iter().take(at).filter(|b| **b == b'\n').count() + 1;
    let message = format!("`{name}` is {what}");
    let help = format!("the byte is in line {line}; a show is a text file in UTF-8");
    Err(Box::new(
        Diagnostic::error(codes::NOT_TEXT, message).help(help),
    ))
}
