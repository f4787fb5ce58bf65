//! HTTP/1.1 as far as the page needs it: one request on a connection, within limits of its own.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::audience::{Audience, Role, Run};

/// Connections at a time that have not sent their address yet. A new one takes the place of the oldest:
/// whoever has an address sends it at once.
const STRANGERS: usize = 32;

/// Connections at a time of pages that run the show, and of those that follow it; a page that is open
/// has one.
const SEATS: [usize; 2] = [32, 64];

/// How long the head of a request may take to come.
const GREETING: Duration = Duration::from_secs(2);

/// Bytes of a request's head. Other servers of this machine may have left cookies under its name.
const HEAD: usize = 32 << 10;
const HEADERS: usize = 64;

/// Bytes of what a page sends.
const BODY: usize = 256 << 10;

/// How long what follows the head may take to come, and an answer to go.
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

/// A connection that has not sent its address yet.
struct Stranger<'a> {
    audience: &'a Audience,
    number: u64,
}

fn strangers(audience: &Audience) -> MutexGuard<'_, std::collections::VecDeque<(u64, TcpStream)>> {
    // Each change is one call: a panic elsewhere leaves nothing half done.
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
        // Dropped, it gives back what was taken here.
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
    // A client that goes away, or is too slow, is none of ours.
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

/// The head of a request, with what came behind it.
struct Head {
    request: Request,
    /// Bytes of the body.
    length: usize,
    /// Where the body begins in what was read.
    at: usize,
    read: Vec<u8>,
}

/// Reads the head of a request, within limits of size and time; or why it is refused.
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

/// Reads what follows a head; or why it is refused.
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

/// What the sender of a request may do, by the address that it sends; or why nothing.
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
