//! Messages of Open Sound Control 1.0, to start cues remotely and to report the state of the show.

/// Most nested bundles.
const DEPTH: usize = 8;

/// An argument.
#[derive(Clone, Debug, PartialEq)]
pub enum Argument {
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A text.
    Text(String),
}

impl Argument {
    /// Its value, if it is a number.
    pub fn number(&self) -> Option<f64> {
        match self {
            Argument::Int(value) => Some(f64::from(*value)),
            Argument::Float(value) => Some(f64::from(*value)).filter(|value| value.is_finite()),
            Argument::Text(text) => text.parse().ok().filter(|value: &f64| value.is_finite()),
        }
    }
}

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Such as `/footlight/go`.
    pub address: String,
    /// Its arguments.
    pub arguments: Vec<Argument>,
}

/// The messages of a packet, those of a bundle in order; time tags are ignored. A packet that is
/// not OSC has none.
pub fn read(packet: &[u8]) -> Vec<Message> {
    let mut out = Vec::new();
    element(packet, DEPTH, &mut out);
    out
}

fn element(bytes: &[u8], depth: usize, out: &mut Vec<Message>) {
    let Some(mut rest) = bytes.strip_prefix(b"#bundle\0") else {
        out.extend(message(bytes));
        return;
    };
    if depth == 0 || rest.len() < 8 {
        return;
    }
    rest = rest.get(8..).unwrap_or_default();
    while let Some((size, after)) = rest.split_first_chunk::<4>() {
        let size = u32::from_be_bytes(*size) as usize;
        let Some((inner, after)) = after.split_at_checked(size) else {
            return;
        };
        element(inner, depth - 1, out);
        rest = after;
    }
}

fn message(bytes: &[u8]) -> Option<Message> {
    let mut rest = bytes;
    let address = text(&mut rest)?;
    if !address.starts_with('/') {
        return None;
    }
    // Old senders omit the types when there are no arguments.
    let types = if rest.is_empty() {
        ",".to_owned()
    } else {
        text(&mut rest)?
    };
    let mut arguments = Vec::new();
    for kind in types.strip_prefix(',')?.chars() {
        arguments.push(match kind {
            'i' => Argument::Int(i32::from_be_bytes(four(&mut rest)?)),
            'f' => Argument::Float(f32::from_be_bytes(four(&mut rest)?)),
            's' => Argument::Text(text(&mut rest)?),
            'T' => Argument::Int(1),
            'F' | 'N' => Argument::Int(0),
            _ => return None,
        });
    }
    Some(Message { address, arguments })
}

fn four(rest: &mut &[u8]) -> Option<[u8; 4]> {
    let (four, after) = rest.split_first_chunk::<4>()?;
    *rest = after;
    Some(*four)
}

/// Reads a text padded with zeros to a multiple of four bytes.
fn text(rest: &mut &[u8]) -> Option<String> {
    let end = rest.iter().position(|byte| *byte == 0)?;
    let text = std::str::from_utf8(rest.get(..end)?).ok()?.to_owned();
    *rest = rest.get(end / 4 * 4 + 4..).unwrap_or_default();
    Some(text)
}

/// Encodes a message.
pub fn write(address: &str, arguments: &[Argument]) -> Vec<u8> {
    let mut out = Vec::new();
    put(address, &mut out);
    let types = arguments.iter().map(|argument| match argument {
        Argument::Int(_) => 'i',
        Argument::Float(_) => 'f',
        Argument::Text(_) => 's',
    });
    put(
        &std::iter::once(',').chain(types).collect::<String>(),
        &mut out,
    );
    for argument in arguments {
        match argument {
            Argument::Int(value) => out.extend(value.to_be_bytes()),
            Argument::Float(value) => out.extend(value.to_be_bytes()),
            Argument::Text(text) => put(text, &mut out),
        }
    }
    out
}

fn put(text: &str, out: &mut Vec<u8>) {
    out.extend(text.bytes().filter(|byte| *byte != 0));
    out.push(0);
    out.resize(out.len().next_multiple_of(4), 0);
}
