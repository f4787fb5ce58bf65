//! Messages at standard input and output, in the protocol's framing.
//!
//! The crate's own transport panics on a length beyond memory and ends at the first message that is
//! not JSON. This one answers such a message with an error and reads the next one.

use std::io::{self, BufRead, Read, Write};
use std::thread::{self, JoinHandle};

use crossbeam_channel::bounded;
use lsp_server::{Connection, ErrorCode, Message, RequestId, Response};
use serde_json::{Value, json};

use footlight_engine::TEXT_LIMIT;

/// Most bytes of a message: the largest text with every character escaped.
pub const MESSAGE_LIMIT: u64 = 2 * TEXT_LIMIT;
/// Most bytes of a header line.
const HEADER_LIMIT: u64 = 4096;

/// The reading and writing threads.
pub struct Threads {
    reader: JoinHandle<io::Result<()>>,
    writer: JoinHandle<io::Result<()>>,
}

impl Threads {
    /// Waits for both threads, and returns the result of reading.
    ///
    /// # Errors
    /// For input outside the protocol, or a broken pipe.
    pub fn join(self) -> io::Result<()> {
        let panicked = |_| io::Error::other("a thread broke off");
        let read = self.reader.join().map_err(panicked)?;
        let written = self.writer.join().map_err(panicked)?;
        read.and(written)
    }
}

/// A connection at standard input and output.
///
/// # Errors
/// When no threads can be started.
pub fn standard() -> io::Result<(Connection, Threads)> {
    let (sender, outgoing) = bounded::<Message>(0);
    let writer = thread::Builder::new().spawn(move || {
        outgoing
            .into_iter()
            .try_for_each(|message| message.write(&mut io::stdout().lock()))
    })?;
    let (incoming, receiver) = bounded::<Message>(0);
    let reader = thread::Builder::new().spawn(move || {
        let mut input = io::stdin().lock();
        let mut skipped = 0;
        loop {
            let read = match read(&mut input, &mut skipped) {
                Ok(Some(read)) => read,
                Ok(None) => break,
                Err(error) => {
                    if error.kind() == io::ErrorKind::InvalidData {
                        write(&refusal(None, ErrorCode::ParseError, &error.to_string()))?;
                    }
                    return Err(error);
                }
            };
            let message = match read {
                Ok(message) => message,
                Err(refusal) => {
                    write(&refusal)?;
                    continue;
                }
            };
            let is_exit = matches!(&message, Message::Notification(n) if n.method == "exit");
            if incoming.send(message).is_err() || is_exit {
                break;
            }
        }
        Ok(())
    })?;
    Ok((Connection { sender, receiver }, Threads { reader, writer }))
}

fn write(answer: &Value) -> io::Result<()> {
    let text = answer.to_string();
    let mut out = io::stdout().lock();
    write!(out, "Content-Length: {}\r\n\r\n{text}", text.len())?;
    out.flush()
}

/// The next message, or the error response to a malformed one; `None` at the end of the input.
/// First skips `skipped` bytes of a message that was too large, which was answered before it had
/// arrived.
fn read(input: &mut impl BufRead, skipped: &mut u64) -> io::Result<Option<Result<Message, Value>>> {
    io::copy(&mut input.by_ref().take(*skipped), &mut io::sink())?;
    *skipped = 0;
    let Some(length) = length(input)? else {
        return Ok(None);
    };
    if length > MESSAGE_LIMIT {
        *skipped = length;
        let why = format!("a message of {length} bytes; at most {MESSAGE_LIMIT} are read");
        return Ok(Some(Err(refusal(None, ErrorCode::InvalidRequest, &why))));
    }
    // Memory grows with the bytes received, not with the length announced.
    let mut bytes = Vec::new();
    let found = input.by_ref().take(length).read_to_end(&mut bytes)?;
    if (found as u64) < length {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    Ok(Some(message(&bytes)))
}

fn message(bytes: &[u8]) -> Result<Message, Value> {
    let value: Value = serde_json::from_slice(bytes)
        .map_err(|error| refusal(None, ErrorCode::ParseError, &error.to_string()))?;
    let id = value.get("id").cloned();
    serde_json::from_value(value)
        .map_err(|error| refusal(id, ErrorCode::InvalidRequest, &error.to_string()))
}

/// Error response to a message, perhaps without an id.
fn refusal(id: Option<Value>, code: ErrorCode, why: &str) -> Value {
    let id = id.filter(|id| serde_json::from_value::<RequestId>(id.clone()).is_ok());
    let response = Response::new_err(RequestId::from(0), code as i32, why.to_owned());
    json!({ "jsonrpc": "2.0", "id": id, "error": response.error })
}

/// Reads a header and returns the length of the content; `None` at the end of the input.
fn length(input: &mut impl BufRead) -> io::Result<Option<u64>> {
    let malformed = |line: &[u8]| {
        let line = String::from_utf8_lossy(line.get(..80).unwrap_or(line)).into_owned();
        io::Error::new(
            io::ErrorKind::InvalidData,
            format!("malformed header: {line:?}"),
        )
    };
    let mut length = None;
    loop {
        let mut line = Vec::new();
        input
            .by_ref()
            .take(HEADER_LIMIT)
            .read_until(b'\n', &mut line)?;
        if line.is_empty() {
            return Ok(None);
        }
        let text = line.strip_suffix(b"\r\n").ok_or_else(|| malformed(&line))?;
        if text.is_empty() {
            return length
                .map(Some)
                .ok_or_else(|| malformed(b"no Content-Length"));
        }
        let text = std::str::from_utf8(text).map_err(|_| malformed(&line))?;
        let (name, value) = text.split_once(':').ok_or_else(|| malformed(&line))?;
        if name.eq_ignore_ascii_case("Content-Length") {
            length = Some(value.trim().parse().map_err(|_| malformed(&line))?);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(input: &str) -> Vec<String> {
        let mut input = input.as_bytes();
        let (mut out, mut skipped) = (Vec::new(), 0);
        loop {
            out.push(match read(&mut input, &mut skipped) {
                Ok(None) => return out,
                Ok(Some(Ok(message))) => format!("{message:?}").chars().take(12).collect(),
                Ok(Some(Err(refusal))) => {
                    format!("{} {}", refusal["id"], refusal["error"]["code"])
                }
                Err(error) => return [out, vec![error.kind().to_string()]].concat(),
            });
        }
    }

    fn framed(text: &str) -> String {
        format!("Content-Length: {}\r\n\r\n{text}", text.len())
    }

    #[test]
    fn what_is_no_message_is_answered_and_the_next_one_is_read() {
        let exit = framed(r#"{"jsonrpc":"2.0","method":"exit"}"#);
        for (bad, answer) in [
            (framed("{"), "null -32700"),
            (
                framed(r#"{"jsonrpc":"2.0","method":"x","params":"\ud800"}"#),
                "null -32700",
            ),
            (framed(r#"{"jsonrpc":"2.0","params":7}"#), "null -32600"),
            (framed("[]"), "null -32600"),
        ] {
            let found = answers(&format!("{bad}{exit}"));
            assert_eq!(found, [answer, "Notification"], "{bad}");
        }
    }

    #[test]
    fn no_length_takes_memory() {
        for length in ["18446744073709551615", "1000000000000", "2000000000"] {
            let found = answers(&format!("Content-Length: {length}\r\n\r\n{{}}"));
            assert_eq!(found, ["null -32600"], "{length}");
        }
        assert_eq!(
            answers("Content-Length: 99\r\n\r\n{}"),
            ["unexpected end of file"]
        );
        assert_eq!(answers("GET / HTTP/1.1\r\n\r\n"), ["invalid data"]);
        assert_eq!(answers(&"x".repeat(9000)), ["invalid data"]);
        assert!(answers("").is_empty());
    }
}
