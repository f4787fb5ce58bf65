//! Open Sound Control on a port: receives GO, and sends the state of the show.

use std::net::{IpAddr, SocketAddr, ToSocketAddrs as _, UdpSocket};

use clap::{Args, value_parser};

use super::complain;
use footlight_desk::osc::{self, Argument};
use footlight_desk::performance::Performance;
use footlight_engine::Document;
use footlight_prompt::Error;
use footlight_show::timeline::TimelineError;
use footlight_show::units::{CueNumber, Time};

/// Most messages handled between two frames.
const MOST_MESSAGES: usize = 64;

/// Options of Open Sound Control.
#[derive(Debug, Args)]
pub struct OscOptions {
    /// Wait for GO by OSC at this port
    #[arg(long, value_name = "PORT", value_parser = value_parser!(u16).range(1..))]
    osc: Option<u16>,
    /// The machine and port to send cue and time to by OSC
    #[arg(long, value_name = "HOST:PORT", requires = "osc", value_parser = target)]
    osc_to: Option<SocketAddr>,
}

/// Open Sound Control: receives commands, and sends the state.
pub struct Remote {
    pub socket: UdpSocket,
    to: Option<SocketAddr>,
    sent: Option<(Option<usize>, i64)>,
}

impl Remote {
    /// Opens the requested port, if any, at this machine's address `own`.
    pub fn open(asked: &OscOptions, own: IpAddr) -> Result<Option<Remote>, Error> {
        let (Some(port), to) = (asked.osc, asked.osc_to) else {
            return Ok(None);
        };
        if to.is_some_and(|to| !to.ip().is_loopback()) && own.is_loopback() {
            let message = "`--osc-to` leaves this machine: say an interface with `--bind`";
            return Err(Error::Usage(message.to_owned()));
        }
        let open = UdpSocket::bind((own, port)).and_then(|socket| {
            socket.set_nonblocking(true)?;
            Ok(socket)
        });
        let socket =
            open.map_err(|error| Error::Device(format!("port {port} of {own}: {error}")))?;
        if own.is_unspecified() {
            complain(format!(
                "note: it listens at every interface: whoever reaches port {port} of this machine \
                 can run the show\n"
            ));
        }
        Ok(Some(Remote {
            socket,
            to,
            sent: None,
        }))
    }

    /// Handles received messages, and sends the state of the show.
    pub fn serve(
        &mut self,
        performance: &mut Performance<'_>,
        now: Time,
        document: &Document,
    ) -> Result<(), Error> {
        let mut packet = [0; 2048];
        for _ in 0..MOST_MESSAGES {
            let Ok(length) = self.socket.recv(&mut packet) else {
                break;
            };
            for message in osc::read(packet.get(..length).unwrap_or_default()) {
                if let Err(errors) = obey(performance, &message, now) {
                    return Err(refused(errors));
                }
            }
        }
        self.tell(performance.cue(now), now, document);
        Ok(())
    }

    /// Sends the cue when it changes, and the time each second.
    fn tell(&mut self, cue: Option<usize>, now: Time, document: &Document) {
        let second = now.micros() / 1_000_000;
        let Some(to) = self.to.filter(|_| self.sent != Some((cue, second))) else {
            return;
        };
        let said = cue.and_then(|cue| document.show().cues.get(cue));
        if self.sent.map(|sent| sent.0) != Some(cue)
            && let Some(cue) = said
        {
            let words = [cue.number.to_string(), cue.label.clone()].map(Argument::Text);
            let _ = self
                .socket
                .send_to(&osc::write("/footlight/cue", &words), to);
        }
        let time = [Argument::Float(now.seconds() as f32)];
        let _ = self
            .socket
            .send_to(&osc::write("/footlight/time", &time), to);
        self.sent = Some((cue, second));
    }
}

fn target(text: &str) -> Result<SocketAddr, String> {
    let found = text.to_socket_addrs().ok();
    let found = found.and_then(|mut all| all.find(SocketAddr::is_ipv4));
    found.ok_or_else(|| format!("`{text}` is no machine with a port, such as 127.0.0.1:9000"))
}

/// The error for cues that make no timeline.
pub fn refused(_: Vec<TimelineError>) -> Error {
    Error::Usage("the cues make no timeline when they are started so".to_owned())
}

/// Handles a message; unknown ones are ignored. A button sends 1 when pressed and 0 when released.
fn obey(
    performance: &mut Performance<'_>,
    message: &osc::Message,
    now: Time,
) -> Result<(), Vec<TimelineError>> {
    let number = message.arguments.first().and_then(Argument::number);
    let pressed = number != Some(0.0);
    let address = message.address.trim_end_matches('/');
    match address {
        "/footlight/go" | "/eos/key/go_0" | "/eos/key/go" if pressed => drop(performance.go(now)?),
        "/footlight/back" | "/eos/key/stop_back" | "/eos/key/stopback" if pressed => {
            performance.back(now)?;
        }
        "/footlight/release" if pressed => performance.release(),
        _ => {
            let cue = ["/footlight/cue/", "/eos/cue/1/"]
                .iter()
                .find_map(|p| address.strip_prefix(p));
            let cue = cue.map(|cue| cue.trim_end_matches("/fire"));
            let cue = cue.and_then(CueNumber::parse).filter(|_| pressed);
            let bank = ["/footlight/level/", "/level/"]
                .iter()
                .find_map(|p| address.strip_prefix(p));
            if let Some(cue) = cue {
                performance.goto(cue, now)?;
            } else if let (Some(bank), Some(percent)) = (bank, number) {
                performance.hold(bank, percent / 100.0);
            }
        }
    }
    Ok(())
}
