//! Workspaces for QLC+ 4 (`.qxw`): a generic fixture for each bank, a scene for each cue, and a
//! chaser that runs them, with a cue list for GO.

use std::fmt::Write as _;

use super::patch::{Frames, Patch, Slot};
use super::{Carried, ExportError, Loss};
use footlight_host::work::Work;
use footlight_show::model::{Link, Show};
use footlight_show::printable::escaped;
use footlight_show::timeline::{Timeline, TimelineError, lights, tracked};
use footlight_show::units::Time;

/// Number of the chaser; scenes follow.
const CHASER: usize = 0;
/// An endless hold.
const UNTIL_GO: u32 = u32::MAX - 1;
/// Moments at which a cue is compared with its crossfade.
const SAMPLES: i32 = 32;

/// The workspace for a show, with the losses.
///
/// # Errors
/// When the cues make no timeline, or on cancel.
pub fn write(show: &Show, timeline: &Timeline, work: Work<'_>) -> Result<Carried, ExportError> {
    let (patch, mut losses) = Patch::of_channels(show);
    if !show.heads().is_empty() {
        losses.push(Loss::new("pan, tilt and zoom of moving heads"));
    }
    losses.extend(Loss::of_clock_times(show));
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!DOCTYPE Workspace>\n\
        <Workspace xmlns=\"http://www.qlcplus.org/Workspace\" CurrentWindow=\"VirtualConsole\">\n \
        <Creator>\n  <Name>Q Light Controller Plus</Name>\n  <Version>4.12.6</Version>\n  \
        <Author>Footlight</Author>\n </Creator>\n <Engine>\n"
        .to_owned();
    fixtures(show, &patch, &mut text);
    let scenes = scenes(show, &patch)?;
    let steps: Vec<Step> = (0..show.cues.len())
        .map(|cue| Step::of(show, timeline, cue))
        .collect();
    chaser(show, &steps, &mut text);
    for (index, (cue, scene)) in show.cues.iter().zip(&scenes).enumerate() {
        let name = escaped(format!("{} {}", cue.number, cue.label).trim());
        let _ = write!(
            text,
            "  <Function ID=\"{}\" Type=\"Scene\" Name=\"{name}\">\n   \
             <Speed FadeIn=\"0\" FadeOut=\"0\" Duration=\"0\"/>\n{scene}  </Function>\n",
            index + 1,
        );
    }
    text.push_str(" </Engine>\n");
    console(&show.title, &mut text);
    text.push_str("</Workspace>\n");
    for (index, (cue, step)) in show.cues.iter().zip(&steps).enumerate() {
        work.check()?;
        if is_bent(show, timeline, index, step.fade) {
            let what = "its times, curves and effects are one crossfade";
            losses.push(Loss::new(what).cue(cue.number));
        }
    }
    for fixed in &show.fixed {
        let what = format!("fixed `{}` is on no address", fixed.name);
        losses.push(Loss::new(what));
    }
    Ok(Carried { text, losses })
}

fn fixtures(show: &Show, patch: &Patch, text: &mut String) {
    let coordinates = show.coordinates();
    for (id, bank) in show.banks.iter().enumerate() {
        let width = if bank.rgb { 3 } else { 1 };
        let mine = |slot: &&Slot| coordinates.get(slot.coordinate).and_then(|c| c.bank) == Some(id);
        let Some(first) = patch.slots().iter().find(mine) else {
            continue;
        };
        let _ = write!(
            text,
            "  <Fixture>\n   <Manufacturer>Generic</Manufacturer>\n   <Model>Generic</Model>\n   \
             <Mode>{width} Channel</Mode>\n   <ID>{id}</ID>\n   <Name>{}</Name>\n   \
             <Universe>{}</Universe>\n   <Address>{}</Address>\n   <Channels>{width}</Channels>\n  \
             </Fixture>\n",
            escaped(&bank.name),
            first.universe - 1,
            first.offset,
        );
    }
}

/// The values of every completed cue, in the form of a scene.
fn scenes(show: &Show, patch: &Patch) -> Result<Vec<String>, Vec<TimelineError>> {
    let coordinates = show.coordinates();
    let mut frames: Frames = patch.dark();
    let mut out = Vec::new();
    for held in tracked(show)? {
        patch.fill(&lights(show, &held), &mut frames);
        let mut scene = String::new();
        for id in 0..show.banks.len() {
            let mine = patch
                .slots()
                .iter()
                .filter(|slot| coordinates.get(slot.coordinate).and_then(|c| c.bank) == Some(id));
            let value = |slot: &Slot| {
                let frame = frames.get(&slot.universe)?;
                frame.get(slot.offset).copied()
            };
            let values = mine.enumerate();
            let values = values.map(|(i, slot)| format!("{i},{}", value(slot).unwrap_or(0)));
            let values: Vec<String> = values.collect();
            let _ = writeln!(
                scene,
                "   <FixtureVal ID=\"{id}\">{}</FixtureVal>",
                values.join(",")
            );
        }
        out.push(scene);
    }
    Ok(out)
}

/// A step of the chaser, times in milliseconds.
struct Step {
    fade: u32,
    hold: u32,
}

impl Step {
    fn of(show: &Show, timeline: &Timeline, index: usize) -> Step {
        let times = timeline.cues().get(index);
        let length = times.map_or(Time::ZERO, |times| times.completion - times.go);
        let link = show.cues.get(index).and_then(|cue| cue.link);
        let next = link.map(|(_, link)| match link {
            Link::Follow(follow) => follow,
            Link::Hang(hang) => length + hang,
        });
        let fade = milliseconds(length);
        match next.map(milliseconds) {
            None => Step {
                fade,
                hold: UNTIL_GO,
            },
            Some(next) => Step {
                fade: fade.min(next),
                hold: next.saturating_sub(fade),
            },
        }
    }
}

fn milliseconds(time: Time) -> u32 {
    (time.micros().max(0) / 1000).min(i64::from(UNTIL_GO) - 1) as u32
}

fn chaser(show: &Show, steps: &[Step], text: &mut String) {
    let _ = write!(
        text,
        "  <Function ID=\"{CHASER}\" Type=\"Chaser\" Name=\"{}\">\n   \
         <Speed FadeIn=\"0\" FadeOut=\"0\" Duration=\"0\"/>\n   <Direction>Forward</Direction>\n   \
         <RunOrder>SingleShot</RunOrder>\n   \
         <SpeedModes FadeIn=\"PerStep\" FadeOut=\"PerStep\" Duration=\"PerStep\"/>\n",
        escaped(&show.title),
    );
    for (number, (cue, step)) in show.cues.iter().zip(steps).enumerate() {
        let _ = writeln!(
            text,
            "   <Step Number=\"{number}\" FadeIn=\"{}\" Hold=\"{}\" FadeOut=\"0\" Note=\"{}\">{}</Step>",
            step.fade,
            step.hold,
            escaped(&cue.note),
            number + 1,
        );
    }
    text.push_str("  </Function>\n");
}

/// Adds a cue list with the number 0 to the virtual console.
fn console(title: &str, text: &mut String) {
    let _ = write!(
        text,
        " <VirtualConsole>\n  <Frame Caption=\"\">\n   <Appearance>\n    \
         <FrameStyle>None</FrameStyle>\n   </Appearance>\n   \
         <CueList Caption=\"{}\" ID=\"0\">\n    \
         <WindowState Visible=\"True\" X=\"10\" Y=\"10\" Width=\"600\" Height=\"500\"/>\n    \
         <Chaser>{CHASER}</Chaser>\n   </CueList>\n  </Frame>\n  <Properties>\n   \
         <Size Width=\"1280\" Height=\"720\"/>\n  </Properties>\n </VirtualConsole>\n",
        escaped(title),
    );
}

/// True when a cue leaves a straight crossfade of all banks by more than a step.
fn is_bent(show: &Show, timeline: &Timeline, index: usize, fade: u32) -> bool {
    let Some(cue) = timeline.cues().get(index) else {
        return false;
    };
    let next = timeline.cues().get(index + 1).map(|next| next.go);
    let start = timeline.evaluate(cue.go - Time::from_micros(1));
    let last = timeline.evaluate(next.map_or(cue.completion, |next| next.min(cue.completion)));
    let banks = show.coordinates().len() - usize::from(!show.fixed.is_empty());
    let differs = |sample| {
        let gone = (cue.completion - cue.go).scaled(f64::from(sample) / f64::from(SAMPLES));
        let done = match fade {
            0 => 1.0,
            fade => (1000.0 * gone.seconds() / f64::from(fade)).min(1.0),
        };
        let now = timeline.evaluate(cue.go + gone);
        let mut all = start.iter().zip(&last).zip(now).take(banks);
        next.is_none_or(|next| cue.go + gone < next)
            && all.any(|((was, to), now)| (now - (was + (to - was) * done)).abs() > 1.0 / 255.0)
    };
    (0..=SAMPLES).any(differs)
}
