//! HTTP/1.1 as far as the page needs it: one request on a connection, within limits of its own.

use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use super::audience::{Audience, Role, Run};

/// Connections at a time; a page that is open has one.
const MOST_CONNECTIONS: usize = 64;

/// Bytes of a request's head. Other servers of this machine may have left cookies under its name.
const HEAD: usize = 32 << 10;
const HEADERS: usize = 64;

/// Bytes of what a page sends.
const BODY: usize = 256 << 10;

/// How long a request may take to come, and an answer to go.
const PATIENCE: Duration = Duration::from_secs(5);

/// How long to wait after a connection that could not be taken.
const PAUSE: Duration = Duration::from_millis(50);

/// How often a page receives again what it has, so that neither side waits for one that is gone.
const PULSE: Duration = Duration::from_secs(10);

/// A request.
#[derive(Debug, Default, PartialEq)]
struct Request {
    is_post: bool,
    /// Parts of the address, between its slashes.
    parts: Vec<String>,
    host: String,
    origin: Option<String>,
    body: Vec<u8>,
}

/// What is answered.
enum Answer {
    File(&'static str, Body),
    Done,
    Events,
    /// With a status and why.
    Refusal(&'static str, &'static str),
}

enum Body {
    Text(Arc<String>),
    Bytes(Arc<Vec<u8>>),
}

/// Takes connections, on a thread of its own, as long as the program runs.
pub fn listen(listener: TcpListener, audience: &Arc<Audience>) {
    let audience = Arc::clone(audience);
    // Without threads to spare nothing is served, which is seen at once.
    let _ = thread::Builder::new().spawn(move || {
        for stream in listener.incoming() {
            match stream {
                Ok(stream) => take(stream, &audience),
                // Out of handles: some come free.
                Err(_) => thread::sleep(PAUSE),
            }
        }
    });
}

/// Frees a connection's place.
struct Place(Arc<Audience>);

impl Drop for Place {
    fn drop(&mut self) {
        self.0.connections.fetch_sub(1, Ordering::SeqCst);
    }
}

fn take(stream: TcpStream, audience: &Arc<Audience>) {
    let taken = audience.connections.fetch_add(1, Ordering::SeqCst);
    let place = Place(Arc::clone(audience));
    if taken >= MOST_CONNECTIONS {
        return;
    }
    // A client that goes away, or is too slow, is none of ours.
    let _ = thread::Builder::new().spawn(move || serve(stream, &place.0));
}

fn serve(mut stream: TcpStream, audience: &Audience) -> io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let answer = match read(&mut stream)? {
        Ok(request) => answer(request, audience),
        Err(refusal) => refusal,
    };
    match answer {
        Answer::File(kind, body) => {
            let bytes = match &body {
                Body::Text(text) => text.as_bytes(),
                Body::Bytes(bytes) => bytes.as_slice(),
            };
            write(&mut stream, "200 OK", kind, bytes)
        }
        Answer::Done => write(&mut stream, "204 No Content", TEXT, b""),
        Answer::Refusal(status, why) => {
            write(&mut stream, status, TEXT, format!("{why}\n").as_bytes())
        }
        Answer::Events => tell(&mut stream, audience),
    }
}

const TEXT: &str = "text/plain; charset=utf-8";
const PAGE: &str = "text/html; charset=utf-8";

/// What every answer says: nothing of it is kept, shown in a foreign page, read by one, or told on.
const ALWAYS: &str = "Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\n\
    X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\nConnection: close\r\n";

fn write(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8]) -> io::Result<()> {
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{ALWAYS}\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)
}

/// Tells a page what happens until it leaves (server-sent events).
fn tell(stream: &mut TcpStream, audience: &Audience) -> io::Result<()> {
    let head = format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{ALWAYS}\r\n");
    stream.write_all(head.as_bytes())?;
    let mut tick = None;
    loop {
        let (message, next) = audience.message(tick, PULSE);
        tick = Some(next);
        stream.write_all(format!("data: {message}\n\n").as_bytes())?;
    }
}

/// Reads a request, within limits of size and time; or why it is refused.
fn read(stream: &mut TcpStream) -> io::Result<Result<Request, Answer>> {
    let until = Instant::now() + PATIENCE;
    let mut bytes = Vec::new();
    let (mut request, length, at) = loop {
        match parsed(&bytes) {
            Ok(Some(whole)) => break whole,
            Ok(None) if bytes.len() < HEAD => more(stream, &mut bytes, until)?,
            Ok(None) => return Ok(Err(TOO_LONG)),
            Err(refusal) => return Ok(Err(refusal)),
        }
    };
    if length > BODY {
        return Ok(Err(Answer::Refusal(
            "413 Content Too Large",
            "This is too long.",
        )));
    }
    while bytes.len() < at + length {
        more(stream, &mut bytes, until)?;
    }
    request.body = bytes.get(at..at + length).unwrap_or_default().to_vec();
    Ok(Ok(request))
}

const TOO_LONG: Answer = Answer::Refusal(
    "431 Request Header Fields Too Large",
    "The request's head is too long.",
);

/// Reads what there is, and waits for it if need be.
fn more(stream: &mut TcpStream, bytes: &mut Vec<u8>, until: Instant) -> io::Result<()> {
    let left = until.saturating_duration_since(Instant::now());
    if left.is_zero() {
        return Err(io::ErrorKind::TimedOut.into());
    }
    stream.set_read_timeout(Some(left))?;
    let mut part = [0; 4096];
    match stream.read(&mut part)? {
        0 => Err(io::ErrorKind::UnexpectedEof.into()),
        n => {
            bytes.extend_from_slice(part.get(..n).unwrap_or_default());
            Ok(())
        }
    }
}

/// A request's head with the length of its body and where that begins, once all of the head is there.
fn parsed(bytes: &[u8]) -> Result<Option<(Request, usize, usize)>, Answer> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut head = httparse::Request::new(&mut headers);
    let bad = Answer::Refusal("400 Bad Request", "This is no request of HTTP/1.1.");
    let at = match head.parse(bytes) {
        Ok(httparse::Status::Complete(at)) => at,
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => return Err(TOO_LONG),
        Err(_) => return Err(bad),
    };
    let mut request = Request::default();
    let mut length = None;
    for header in head.headers.iter() {
        let Ok(value) = str::from_utf8(header.value) else {
            continue;
        };
        match header.name.to_ascii_lowercase().as_str() {
            "host" => value.clone_into(&mut request.host),
            "origin" => request.origin = Some(value.to_owned()),
            "content-length" => length = value.parse().ok(),
            _ => {}
        }
    }
    request.is_post = match head.method {
        Some("GET") => false,
        Some("POST") => true,
        _ => {
            return Err(Answer::Refusal(
                "405 Method Not Allowed",
                "Only GET and POST.",
            ));
        }
    };
    if request.is_post && length.is_none() {
        return Err(Answer::Refusal("411 Length Required", "How long is it?"));
    }
    let path = head.path.unwrap_or_default();
    let path = path.split_once('?').map_or(path, |(path, _)| path);
    request.parts = path.split('/').skip(1).map(str::to_owned).collect();
    Ok(Some((request, length.unwrap_or(0), at)))
}

fn answer(request: Request, audience: &Audience) -> Answer {
    if !audience.is_own_host(&request.host) {
        return Answer::Refusal("421 Misdirected Request", "This is not that machine.");
    }
    let from = request.origin.as_deref();
    if from.is_some_and(|origin| !audience.is_own_origin(origin)) {
        return Answer::Refusal(
            "403 Forbidden",
            "Pages from elsewhere have no part in this.",
        );
    }
    let parts: Vec<&str> = request.parts.iter().map(String::as_str).collect();
    let [token, rest @ ..] = parts.as_slice() else {
        return NOT_PRINTED;
    };
    let Some(role) = audience.role(token) else {
        return NOT_PRINTED;
    };
    match (request.is_post, rest) {
        (false, [""]) => Answer::File(PAGE, Body::Text(Arc::new(audience.page(role)))),
        (false, ["events"]) => Answer::Events,
        (false, ["show"]) => match audience.data() {
            Some(data) => Answer::File("application/json", Body::Text(data)),
            None => Answer::Refusal("404 Not Found", "There are no pictures yet."),
        },
        (false, ["picture", number]) => match number.parse().ok().and_then(|n| audience.file(n)) {
            Some(file) => Answer::File("image/png", Body::Bytes(file)),
            None => NOTHING,
        },
        (true, ["run"]) if from.is_none() => {
            Answer::Refusal("403 Forbidden", "A page says where it is from.")
        }
        (true, ["run"]) if role == Role::Follows => Answer::Refusal(
            "403 Forbidden",
            "This address looks on; the first that `footlight serve` printed runs the show.",
        ),
        (true, ["run"]) => match serde_json::from_slice::<Run>(&request.body) {
            Ok(run) => {
                audience.run(run);
                Answer::Done
            }
            Err(_) => Answer::Refusal("400 Bad Request", "This is no state of a desk."),
        },
        _ => NOTHING,
    }
}

const NOT_PRINTED: Answer = Answer::Refusal(
    "403 Forbidden",
    "This is no address that `footlight serve` printed.",
);

const NOTHING: Answer = Answer::Refusal("404 Not Found", "There is nothing here.");
