//! A show over HTTP. `cargo run --example server -- examples/first.lxq [PORT]` tells its address;
//! then `curl 'ADDRESS/picture?t=7.5' -o now.png` (finer by and by),
//! `curl 'ADDRESS/levels?t=7.5'` and `curl ADDRESS/edit -d 'cue 2 at 0:02 { lamp 40  time 3 }'`.

use footlight::{Background, Edit, Engine, Error, Folder, Goal, Host, LiveControl, Style, Time};
use std::{collections::BTreeMap, io, path::Path, process, thread, time::Duration};
use tiny_http::{Header, Method, Request, Response, Server};

type Failure = Box<dyn std::error::Error + Send + Sync>;
type Reply = Result<Response<io::Cursor<Vec<u8>>>, Failure>;

struct Threads;
impl Background for Threads {
    fn start(&self, task: Box<dyn FnOnce() + Send>) {
        thread::spawn(task);
    }
}

#[allow(clippy::print_stdout, reason = "the address, or why there is none")]
fn main() -> Result<(), Failure> {
    let explain = |failure: Failure| match failure.downcast_ref() {
        Some(Error::Show(diagnostics)) => diagnostics.render(Style::Plain),
        _ => failure.to_string(),
    };
    let show = std::env::args().nth(1).ok_or("usage: server SHOW [PORT]")?;
    let port = std::env::args().nth(2).map_or(Ok(0), |port| port.parse())?;
    let folder = Path::new(".").join(&show).with_file_name("");
    let host = Host {
        files: Box::new(Folder::new(folder, 64 << 20)),
        background: Some(Box::new(Threads)),
        ..Host::default()
    };
    let mut engine = Engine::open(show.as_ref(), host).unwrap_or_else(|error| {
        println!("{}", explain(error.into()));
        process::exit(1)
    });
    engine.start(Goal::until(0.0))?; // to the end of the plan
    let server = Server::http(("127.0.0.1", port))?;
    println!("http://{}", server.server_addr());
    loop {
        engine.poll(); // takes in what was rendered meanwhile
        if let Some(mut request) = server.recv_timeout(Duration::from_millis(20))? {
            let reply = answer(&mut engine, &mut request);
            let refuse = |failure| Response::from_string(explain(failure)).with_status_code(400);
            let _gone = request.respond(reply.unwrap_or_else(refuse));
        }
    }
}

fn answer(engine: &mut Engine, request: &mut Request) -> Reply {
    if (request.method(), request.url()) == (&Method::Post, "/edit") {
        let edited = engine.edit(&Edit::Declare(io::read_to_string(request.as_reader())?))?;
        let _busy = engine.start(Goal::until(0.0)); // one that still runs plans anew by itself
        let mut text = edited.warnings.render(Style::Plain);
        for change in edited.changes {
            text += &format!("{:?}: {} {}\n", change.action, change.kind, change.name);
        }
        return Ok(Response::from_string(text));
    }
    let (path, seconds) = request.url().split_once("?t=").ok_or("no ?t=SECONDS")?;
    let time = Time::from_seconds(seconds.parse()?).ok_or("no time of a show")?;
    let mut live = LiveControl::new(engine.document());
    live.move_to(engine.document(), time)?; // refuses times outside the show
    match path {
        "/picture" => {
            let image = engine.picture(time)?;
            let rgb = engine.tone()?.encode(&image);
            let png = footlight::encode_png(image.width(), image.height(), &rgb)?;
            let kind = Header::from_bytes("Content-Type", "image/png").map_err(|()| "no header")?;
            Ok(Response::from_data(png).with_header(kind))
        }
        "/levels" => {
            let banks = engine.show().coordinates().into_iter().map(|it| it.name);
            let levels: BTreeMap<_, _> = banks.zip(live.levels(engine.document())).collect();
            Ok(Response::from_string(serde_json::to_string(&levels)?))
        }
        _ => Err("there are /picture, /levels and POST /edit".into()),
    }
}
