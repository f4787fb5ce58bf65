//! `send`: sends a show to the lighting network by E1.31 and Art-Net, with OSC in and out.
//!
//! By default nothing is sent beyond this machine, which requires the address of an interface, and
//! nothing listens, which requires a port.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs as _, UdpSocket};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use clap::{Args, value_parser};

use super::remote::{OscOptions, Remote, refused};
use super::screen::Screen;
use super::{complain, print};
use footlight_desk::patch::{self, Frames, Patch};
use footlight_desk::performance::Performance;
use footlight_desk::wire::{self, Sender};
use footlight_engine::{self as engine, Document};
use footlight_host::files::{Disk, Store as _};
use footlight_prompt::{Error, Repl};
use footlight_show::timeline::Timeline;
use footlight_show::units::Time;

/// Frames per second: the most that DMX512 carries.
const RATE: u32 = 44;
/// Most bytes of a patch file.
const PATCH_LIMIT: u64 = 1 << 20;

/// Arguments of `send`.
#[derive(Debug, Args)]
pub struct Sent {
    /// The show's file (.lxq); `-` reads standard input
    #[arg(id = "SHOW")]
    pub show: PathBuf,
    /// Send as E1.31 (sACN), from universe N on, 44 frames a second
    #[arg(long, value_name = "N", required_unless_present = "artnet")]
    #[arg(value_parser = value_parser!(u16).range(1..=63_999))]
    sacn: Option<u16>,
    /// The machine to send sACN to, in place of multicast
    #[arg(long, value_name = "HOST", requires = "sacn", value_parser = host)]
    to: Option<IpAddr>,
    /// The priority of sACN, 0 to 200
    #[arg(long, value_name = "P", requires = "sacn", default_value = "100")]
    #[arg(value_parser = value_parser!(u8).range(0..=200))]
    priority: u8,
    /// Send as Art-Net to this machine or broadcast address
    #[arg(long, value_name = "HOST", value_parser = host)]
    artnet: Option<IpAddr>,
    /// The interface to send from and listen at (default: 127.0.0.1)
    #[arg(long, value_name = "ADDRESS", value_parser = value_parser!(Ipv4Addr))]
    bind: Option<Ipv4Addr>,
    /// The addresses of banks (default: their channels) and of heads
    #[arg(long, value_name = "FILE")]
    patch: Option<PathBuf>,
    #[command(flatten)]
    osc: OscOptions,
}

/// Sends the show to its end, or until stopped.
pub fn send(repl: &Repl, asked: &Sent, screen: &Screen) -> Result<u8, Error> {
    let document = repl.engine().document();
    let mut network = Network::open(asked, document)?;
    let own = asked.bind.unwrap_or(Ipv4Addr::LOCALHOST);
    let remote = Remote::open(&asked.osc, own.into())?;
    print(network.describe(remote.as_ref()));
    let show = document.show();
    let mut run = match remote {
        None => Run::Clock(document.timeline()),
        Some(remote) => Run::Hand(Box::new(Performance::new(show).map_err(refused)?), remote),
    };
    let (mut sent, mut late) = (0_u32, Vec::new());
    let began = Instant::now();
    let mut frame = 0_u32;
    let mut away: Option<io::Error> = None;
    let stopped = loop {
        let due = began + Duration::from_secs(1) * frame / RATE;
        thread::sleep(due.saturating_duration_since(Instant::now()));
        late.push(due.elapsed());
        let now = Time::nearest(began.elapsed().as_secs_f64());
        let values = run.values(now, document)?;
        // The show continues through network failures: a cable may be plugged in again.
        match network.send(&values) {
            Ok(()) => {
                sent += 1;
                if away.take().is_some() {
                    complain("the network is back\n");
                }
            }
            Err(error) if away.is_none() => {
                complain(format!("the network: {error}; the show goes on\n"));
                away = Some(error);
            }
            Err(_) => {}
        }
        if run.is_over(now) {
            break false;
        }
        if screen.stop().is_asked() {
            break true;
        }
        // After the machine was asleep, continue with the current frame.
        let passed = began.elapsed().as_secs_f64() * f64::from(RATE);
        frame = (frame + 1).max(passed as u32);
    };
    if let Some(error) = away.or(network.terminate().err()) {
        return Err(lost(error));
    }
    print(report(sent, &mut late, began.elapsed()));
    Ok(if stopped { screen.stop().code() } else { 0 })
}

fn report(sent: u32, late: &mut [Duration], time: Duration) -> String {
    late.sort_unstable();
    let at = late.len().saturating_sub(1) * 99 / 100;
    let worst = late.get(at).copied().unwrap_or_default();
    format!(
        "{sent} frames in {:.1} s; 99 of 100 at most {:.1} ms late\n",
        time.as_secs_f64(),
        worst.as_secs_f64() * 1000.0
    )
}

fn lost(error: io::Error) -> Error {
    Error::Device(format!("the network: {error}"))
}

fn usage<T>(message: impl Into<String>) -> Result<T, Error> {
    Err(Error::Usage(message.into()))
}

/// The source of cue times.
enum Run<'d> {
    /// The preview's clock.
    Clock(&'d Timeline),
    /// Remote messages.
    Hand(Box<Performance<'d>>, Remote),
}

impl Run<'_> {
    fn values(&mut self, now: Time, document: &Document) -> Result<Vec<f64>, Error> {
        match self {
            Run::Clock(timeline) => {
                let time = timeline.start() + now;
                Ok(patch::values(document.show(), timeline, time))
            }
            Run::Hand(performance, remote) => {
                remote.serve(performance, now, document)?;
                Ok(performance.values(now))
            }
        }
    }

    fn is_over(&self, now: Time) -> bool {
        match self {
            Run::Clock(timeline) => timeline.start() + now >= timeline.end(),
            Run::Hand(..) => false,
        }
    }
}

/// Output to the network.
struct Network {
    socket: UdpSocket,
    patch: Patch,
    frames: Frames,
    /// First universe for sACN, and its address if not multicast.
    sacn: Option<(u16, Option<IpAddr>)>,
    artnet: Option<IpAddr>,
    source: Sender,
    sequence: u8,
    notes: Vec<String>,
}

impl Network {
    fn open(asked: &Sent, document: &Document) -> Result<Network, Error> {
        let Sent {
            sacn,
            to,
            artnet,
            bind,
            ..
        } = *asked;
        let outside = |host: IpAddr| !host.is_loopback();
        if bind.is_none() && sacn.is_some() && to.is_none_or(outside) {
            return usage(
                "`--sacn` goes out through an interface: say its address, such as `--bind \
                 192.168.1.20`, or try it on this machine with `--to 127.0.0.1`",
            );
        }
        if bind.is_none() && artnet.is_some_and(outside) {
            return usage(
                "`--artnet` leaves this machine through an interface: say its address, such as \
                 `--bind 192.168.1.20`, or try it with `--artnet 127.0.0.1`",
            );
        }
        let (patch, mut notes) = addresses(asked.patch.as_deref(), document)?;
        if bind.is_some_and(|own| own.is_unspecified()) {
            notes.push(
                "0.0.0.0 is no interface: the system chooses by which one it goes out".to_owned(),
            );
        }
        let universes = patch.dark().last_key_value().map_or(1, |(last, _)| *last);
        let first = sacn.unwrap_or(1);
        if u32::from(first) + u32::from(universes)
            > u32::from(footlight_desk::patch::MOST_UNIVERSES) + 1
        {
            return usage(format!(
                "{universes} universes from {first} on go beyond 63999"
            ));
        }
        if artnet.is_some() && universes > wire::MOST_PORTS {
            return usage("Art-Net has 32768 universes");
        }
        let own = bind.unwrap_or(Ipv4Addr::LOCALHOST);
        let socket = UdpSocket::bind((own, 0)).map_err(|error| {
            Error::Device(format!(
                "no interface of this machine has the address {own}: {error}"
            ))
        })?;
        socket.set_broadcast(true).map_err(lost)?;
        socket.set_multicast_ttl_v4(8).map_err(lost)?;
        Ok(Network {
            socket,
            frames: patch.dark(),
            patch,
            sacn: sacn.map(|first| (first, to)),
            artnet,
            source: Sender {
                cid: cid(),
                name: format!("Footlight: {}", document.show().title),
                priority: asked.priority,
            },
            sequence: 0,
            notes,
        })
    }

    fn describe(&self, remote: Option<&Remote>) -> String {
        let mut out: String = self
            .notes
            .iter()
            .map(|note| format!("note: {note}\n"))
            .collect();
        let count = self.frames.len();
        if let Some((first, to)) = self.sacn {
            let to = to.map_or("by multicast".to_owned(), |to| format!("to {to}"));
            out.push_str(&format!("E1.31 {to}: universes {count}, from {first}\n"));
        }
        if let Some(to) = self.artnet {
            out.push_str(&format!("Art-Net to {to}: universes {count}, from 0\n"));
        }
        if let Some(at) = remote.and_then(|remote| remote.socket.local_addr().ok()) {
            out.push_str(&format!(
                "waiting for /footlight/go at {at}; Ctrl-C ends it\n"
            ));
        }
        out
    }

    fn send(&mut self, values: &[f64]) -> io::Result<()> {
        self.patch.fill(values, &mut self.frames);
        self.sequence = self.sequence.wrapping_add(1);
        for (universe, values) in &self.frames {
            self.packet(*universe, values, false)?;
            if let Some(to) = self.artnet {
                let packet = wire::artnet(universe - 1, self.sequence, values);
                self.socket.send_to(&packet, (to, wire::ARTNET_PORT))?;
            }
        }
        Ok(())
    }

    /// Sends one packet of E1.31.
    fn packet(&self, universe: u16, values: &[u8], terminated: bool) -> io::Result<()> {
        let Some((first, to)) = self.sacn else {
            return Ok(());
        };
        let universe = first + (universe - 1);
        let packet = wire::sacn(&self.source, universe, self.sequence, values, terminated);
        let to = to.unwrap_or(IpAddr::from(wire::sacn_group(universe)));
        self.socket.send_to(&packet, (to, wire::SACN_PORT))?;
        Ok(())
    }

    /// Sends the termination of the stream three times, as the standard requires.
    fn terminate(&mut self) -> io::Result<()> {
        for _ in 0..3 {
            self.sequence = self.sequence.wrapping_add(1);
            for (universe, values) in &self.frames {
                self.packet(*universe, values, true)?;
            }
        }
        Ok(())
    }
}

/// The patch of a file, or the patch by channels with notes on moved addresses; and notes on heads
/// without addresses.
fn addresses(path: Option<&Path>, document: &Document) -> Result<(Patch, Vec<String>), Error> {
    let show = document.show();
    let (patch, mut losses) = match path {
        None => Patch::of_channels(show),
        Some(path) => {
            let bytes = Disk.read(path, PATCH_LIMIT)?;
            let name = path.display().to_string();
            let text = engine::decode(&name, &bytes)?;
            let patch = Patch::parse(show, &text);
            let patch = patch.or_else(|error| usage(format!("{name}: {error}")))?;
            (patch, Vec::new())
        }
    };
    losses.extend(patch.heads_without_address(show));
    Ok((patch, losses.iter().map(ToString::to_string).collect()))
}

/// A random id that identifies this sender to receivers.
fn cid() -> [u8; 16] {
    use std::hash::{BuildHasher as _, Hasher as _, RandomState};
    let half = || RandomState::new().build_hasher().finish().to_be_bytes();
    let mut out = [0; 16];
    for (place, byte) in out.iter_mut().zip(half().into_iter().chain(half())) {
        *place = byte;
    }
    out
}

/// Resolves a machine's name or address.
fn host(text: &str) -> Result<IpAddr, String> {
    let found = (text, 0).to_socket_addrs().ok();
    let found = found.and_then(|mut all| all.find(SocketAddr::is_ipv4));
    let found = found.map(|found| found.ip());
    found.ok_or_else(|| format!("there is no machine `{text}`"))
}
