//! HTTP/1.1 for the page: one request per connection, within limits.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::audience::{Audience, Role, Run};

/// Most connections whose request has not arrived. A new one replaces the oldest: a client with an
/// address sends its request at once.
const STRANGERS: usize = 32;

/// Most connections of pages that run the show, and that follow it; an open page has one.
const SEATS: [usize; 2] = [32, 64];

/// Time limit for the head of a request.
const GREETING: Duration = Duration::from_secs(2);

/// Most bytes of a request's head. Other servers on this machine may have set cookies under its
/// name.
const HEAD: usize = 32 << 10;
const HEADERS: usize = 64;

/// Most bytes of a request's body.
const BODY: usize = 256 << 10;

/// Time limit for the body, and for sending an answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Pause after a connection could not be accepted.
const PAUSE: Duration = Duration::from_millis(50);

/// Interval of repeated updates, so that neither side waits for one that is gone.
const PULSE: Duration = Duration::from_secs(10);

#[derive(Debug, Default, PartialEq)]
struct Request {
    is_post: bool,
    /// Parts of the path, between slashes.
    parts: Vec<String>,
    host: String,
    origin: Option<String>,
    body: Vec<u8>,
}

/// The answer to a request.
enum Answer {
    File(&'static str, Body),
    Done,
    Events,
    /// A status and the reason.
    Refusal(&'static str, &'static str),
}

enum Body {
    Text(Arc<String>),
    Bytes(Arc<Vec<u8>>),
}

/// Accepts connections on another thread, as long as the program runs.
pub fn listen(listener: TcpListener, audience: &Arc<Audience>) {
    let audience = Arc::clone(audience);
    // Without a thread no page is served, which the user sees at once.
    let _ = thread::Builder::new().spawn(move || {
        for stream in listener.incoming() {
            match stream {
                Ok(stream) => take(stream, &audience),
                // Out of handles: wait until some are free.
                Err(_) => thread::sleep(PAUSE),
            }
        }
    });
}

/// A connection whose request has not arrived.
struct Stranger<'a> {
    audience: &'a Audience,
    number: u64,
}

fn strangers(audience: &Audience) -> MutexGuard<'_, std::collections::VecDeque<(u64, TcpStream)>> {
    // Each change is one call, so a panic elsewhere leaves the list consistent.
    audience
        .strangers
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Stranger<'_> {
    fn drop(&mut self) {
        strangers(self.audience).retain(|(number, _)| *number != self.number);
    }
}

/// Frees a seat.
struct Seat<'a>(&'a Audience, usize);

impl<'a> Seat<'a> {
    fn take(audience: &'a Audience, role: Role) -> Option<Seat<'a>> {
        let seat = usize::from(role == Role::Follows);
        let (count, most) = audience.seats.get(seat).zip(SEATS.get(seat))?;
        let taken = count.fetch_add(1, Ordering::SeqCst);
        // Dropping a seat frees it.
        let seat = Seat(audience, seat);
        (taken < *most).then_some(seat)
    }
}

impl Drop for Seat<'_> {
    fn drop(&mut self) {
        if let Some(count) = self.0.seats.get(self.1) {
            count.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

fn take(stream: TcpStream, audience: &Arc<Audience>) {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let Ok(own) = stream.try_clone() else {
        return;
    };
    let mut all = strangers(audience);
    all.push_back((number, own));
    while all.len() > STRANGERS {
        if let Some((_, oldest)) = all.pop_front() {
            let _ = oldest.shutdown(Shutdown::Both);
        }
    }
    drop(all);
    let audience = Arc::clone(audience);
    // Clients that disconnect or are too slow are ignored.
    let _ = thread::Builder::new().spawn(move || {
        let audience = audience.as_ref();
        serve(stream, audience, Stranger { audience, number })
    });
}

fn serve(mut stream: TcpStream, audience: &Audience, stranger: Stranger<'_>) -> io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let (head, role, seat) = match head(&mut stream)? {
        Err(refusal) => return send(&mut stream, refusal, audience),
        Ok(head) => match admitted(&head.request, audience) {
            Err(refusal) => return send(&mut stream, refusal, audience),
            Ok(role) => {
                let seat = Seat::take(audience, role);
                (head, role, seat)
            }
        },
    };
    drop(stranger);
    let Some(_seat) = seat else {
        let full = Answer::Refusal("503 Service Unavailable", "Too many pages are open.");
        return send(&mut stream, full, audience);
    };
    let answer = match body(&mut stream, head)? {
        Ok(request) => answer(request, role, audience),
        Err(refusal) => refusal,
    };
    send(&mut stream, answer, audience)
}

fn send(stream: &mut TcpStream, answer: Answer, audience: &Audience) -> io::Result<()> {
    match answer {
        Answer::File(kind, body) => {
            let bytes = match &body {
                Body::Text(text) => text.as_bytes(),
                Body::Bytes(bytes) => bytes.as_slice(),
            };
            write(stream, "200 OK", kind, bytes)
        }
        Answer::Done => write(stream, "204 No Content", TEXT, b""),
        Answer::Refusal(status, why) => write(stream, status, TEXT, format!("{why}\n").as_bytes()),
        Answer::Events => tell(stream, audience),
    }
}

const TEXT: &str = "text/plain; charset=utf-8";
const PAGE: &str = "text/html; charset=utf-8";

/// Headers of every answer: no caching, framing, sniffing or referrer.
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

/// Sends updates to a page until it leaves (server-sent events).
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

/// The head of a request, and the bytes read after it.
struct Head {
    request: Request,
    /// Bytes of the body.
    length: usize,
    /// Start of the body in the bytes read.
    at: usize,
    read: Vec<u8>,
}

/// Reads the head of a request within limits of size and time; the inner error is the refusal.
fn head(stream: &mut TcpStream) -> io::Result<Result<Head, Answer>> {
    let until = Instant::now() + GREETING;
    let mut read = Vec::new();
    loop {
        match parsed(&read) {
            Ok(Some((request, length, at))) => {
                let head = Head {
                    request,
                    length,
                    at,
                    read,
                };
                return Ok(Ok(head));
            }
            Ok(None) if read.len() < HEAD => more(stream, &mut read, until)?,
            Ok(None) => return Ok(Err(TOO_LONG)),
            Err(refusal) => return Ok(Err(refusal)),
        }
    }
}

/// Reads the body; the inner error is the refusal.
fn body(stream: &mut TcpStream, head: Head) -> io::Result<Result<Request, Answer>> {
    let until = Instant::now() + PATIENCE;
    let Head {
        mut request,
        length,
        at,
        mut read,
    } = head;
    if length > BODY {
        return Ok(Err(Answer::Refusal(
            "413 Content Too Large",
            "This is too long.",
        )));
    }
    while read.len() < at + length {
        more(stream, &mut read, until)?;
    }
    request.body = read.get(at..at + length).unwrap_or_default().to_vec();
    Ok(Ok(request))
}

const TOO_LONG: Answer = Answer::Refusal(
    "431 Request Header Fields Too Large",
    "The request's head is too long.",
);

/// Reads available bytes, waiting for some if need be.
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

/// Parses a request's head once it is complete: the request, the length of its body, and where that
/// begins.
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

/// The role of a request by its token; the error is the refusal.
fn admitted(request: &Request, audience: &Audience) -> Result<Role, Answer> {
    if !audience.is_own_host(&request.host) {
        return Err(Answer::Refusal(
            "421 Misdirected Request",
            "This is not that machine.",
        ));
    }
    let from = request.origin.as_deref();
    if from.is_some_and(|origin| !audience.is_own_origin(origin)) {
        return Err(Answer::Refusal(
            "403 Forbidden",
            "Pages from elsewhere have no part in this.",
        ));
    }
    let token = request.parts.first();
    token
        .and_then(|token| audience.role(token))
        .ok_or(NOT_PRINTED)
}

fn answer(request: Request, role: Role, audience: &Audience) -> Answer {
    let from = request.origin.as_deref();
    let parts: Vec<&str> = request.parts.iter().skip(1).map(String::as_str).collect();
    match (request.is_post, parts.as_slice()) {
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
