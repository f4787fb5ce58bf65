//! A show over HTTP. `cargo run -p footlight-studies --bin server -- examples/first.lxq [PORT]`
//! prints its address; then try `curl 'ADDRESS/picture?t=7.5' -o now.png` (finer over time), `curl
//! 'ADDRESS/levels?t=7.5'` and `curl ADDRESS/edit -d 'cue 2 at 0:02 { lamp 40 time 3 }'`.

use footlight::{Edit, Engine, Folder, Goal, Host, Style, Time, encode_png};
use std::io::{self, Read as _};
use std::{collections::BTreeMap, path::Path, process, thread, time::Duration};
use tiny_http::{Header, Method, Request, Response, Server};

type Failure = Box<dyn std::error::Error + Send + Sync>;
type Reply = Result<Response<io::Cursor<Vec<u8>>>, Failure>;

/// Most bytes of an edit.
const EDIT: u64 = 1 << 20;

#[allow(clippy::print_stdout, reason = "the address, or why there is none")]
fn main() -> Result<(), Failure> {
    let show = std::env::args().nth(1).ok_or("usage: server SHOW [PORT]")?;
    let port = std::env::args().nth(2).map_or(Ok(0), |port| port.parse())?;
    let folder = Path::new(&show).parent().unwrap_or(Path::new(""));
    let host = Host {
        files: Box::new(Folder::new(folder, 64 << 20)),
        background: Some(Box::new(|task| drop(thread::spawn(task)))),
        ..Host::default()
    };
    let mut engine = Engine::open(show.as_ref(), host).unwrap_or_else(|error| {
        println!("{error}");
        process::exit(1)
    });
    engine.start(Goal::until(0.0))?; // to the end of the plan
    let server = Server::http(("127.0.0.1", port))?;
    println!("http://{}", server.server_addr());
    loop {
        engine.poll(); // take finished images
        if let Some(mut request) = server.recv_timeout(Duration::from_millis(20))? {
            let refuse = |failure: Failure| Response::from_string(failure.to_string());
            let reply = answer(&mut engine, &mut request);
            let reply = reply.unwrap_or_else(|failure| refuse(failure).with_status_code(400));
            let _gone = request.respond(reply);
        }
    }
}

fn answer(engine: &mut Engine, request: &mut Request) -> Reply {
    if (request.method(), request.url()) == (&Method::Post, "/edit") {
        let text = io::read_to_string(request.as_reader().take(EDIT))?;
        let edited = engine.edit(&Edit::Declare(text))?;
        if !engine.is_busy() {
            engine.start(Goal::until(0.0))?; // a running refinement adapts by itself
        }
        let changes = edited.changes.iter().map(|change| format!("{change}\n"));
        let text: String = changes.collect();
        return Ok(Response::from_string(
            text + &edited.warnings.render(Style::Plain),
        ));
    }
    let (path, seconds) = request.url().split_once("?t=").ok_or("no ?t=SECONDS")?;
    let time = Time::from_seconds(seconds.parse()?).ok_or("no time of a show")?;
    let timeline = engine.document().timeline();
    if !(timeline.start()..=timeline.end()).contains(&time) {
        return Err(format!("the show ends at {}", timeline.end()).into());
    }
    match path {
        "/picture" => {
            let image = engine.picture(time)?;
            let rgb = engine.tone()?.encode(&image);
            let png = encode_png(image.width(), image.height(), &rgb)?;
            let kind = Header::from_bytes("Content-Type", "image/png").map_err(|()| "no header")?;
            Ok(Response::from_data(png).with_header(kind))
        }
        "/levels" => {
            let names = engine.show().parameters().into_iter().map(|it| it.name);
            let levels: BTreeMap<_, _> = names.zip(engine.document().levels(time)).collect();
            Ok(Response::from_string(serde_json::to_string(&levels)?))
        }
        _ => Err("there are /picture, /levels and POST /edit".into()),
    }
}
