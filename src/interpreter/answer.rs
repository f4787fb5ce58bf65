//! The verbs' answers in words.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::verb::{self, Call, Declaration, VERBS};
use super::{Error, Goal, Interpreter, Reply, Report, refine::Ended};
use crate::lang::{
    self,
    edit::{Action, Change},
};
use crate::show::{Cue, Link, Show};
use crate::units::Time;

impl Interpreter {
    /// What a person sees first at the prompt.
    pub fn greeting(&self) -> String {
        let warnings = match self.compiled.warnings.diagnostics.len() {
            0 => String::new(),
            n => format!("{}: `check` tells them\n", count(n, "warning")),
        };
        format!(
            "Footlight {}. {}\n{warnings}`help` lists the verbs; declarations change the show.\n",
            env!("CARGO_PKG_VERSION"),
            self.headline()
        )
    }

    pub(super) fn headline(&self) -> String {
        let show = self.show();
        let length = self.timeline().end() - self.timeline().start();
        format!(
            "{}: {}, {}, {length}",
            show.title,
            count(show.banks.len(), "bank"),
            count(show.cues.len(), "cue")
        )
    }

    pub(super) fn answer_check(&mut self) -> Result<Reply, Error> {
        let mut text = self.compiled.warnings.render(self.host.style);
        if !self.host.style.is_for_people() {
            return Ok(Reply::text(text));
        }
        let _ = writeln!(text, "{}", self.headline());
        let warnings = self.compiled.warnings.diagnostics.len();
        let verdict = match warnings {
            0 => "no mistakes".to_owned(),
            n => format!("no errors, {}", count(n, "warning")),
        };
        Ok(Reply::text(text + &verdict))
    }

    pub(super) fn answer_show(&mut self, call: &Call) -> Result<Reply, Error> {
        if !call.words.is_empty() {
            let name = call.words.join(" ");
            let texts = self.declarations(&name);
            if texts.is_empty() {
                let message = format!("nothing in the show is called `{name}`");
                return Err(Error::Usage(message));
            }
            return Ok(Reply::text(texts.join("\n")));
        }
        let mut text = self.headline() + "\n\nbanks\n";
        let show = self.show();
        for bank in &show.banks {
            let channel = bank
                .channel
                .map_or(String::new(), |c| format!("channel {c}"));
            let _ = writeln!(
                text,
                "  {:<14} {:<12} {}",
                bank.name,
                channel,
                lights(show, &bank.lights)
            );
        }
        for fixed in &show.fixed {
            let at = format!("fixed at {}", fixed.level);
            let _ = writeln!(
                text,
                "  {:<14} {at:<12} {}",
                fixed.name,
                lights(show, &fixed.lights)
            );
        }
        text.push_str("\ncues\n");
        let times = self.timeline().cues();
        for (cue, time) in show.cues.iter().zip(times) {
            let assumed = if time.assumed { "  (assumed GO)" } else { "" };
            let _ = writeln!(
                text,
                "  {:>9} - {:<9} {:<7} {}{assumed}",
                time.go.to_string(),
                time.completion.to_string(),
                cue.number.to_string(),
                label(cue)
            );
        }
        Ok(Reply::text(text))
    }

    /// The texts that declare a name, with its kind or without: `bank lamps`, `lamps`, `2.5`.
    fn declarations(&self, name: &str) -> Vec<&str> {
        let texts = self.compiled.warnings.sources.texts();
        texts.flat_map(|text| declared(text, name)).collect()
    }

    pub(super) fn answer_at(&mut self, call: &Call) -> Result<Reply, Error> {
        if let Some(word) = call.words.first() {
            let time = self.time(word)?;
            self.move_to(time);
        }
        let mut text = format!("at {}", self.now);
        let last = self
            .timeline()
            .cues()
            .iter()
            .rposition(|c| c.go <= self.now);
        if let Some(cue) = last.and_then(|i| self.show().cues.get(i)) {
            let _ = write!(text, ", cue {} {}", cue.number, label(cue));
        }
        text.push('\n');
        text.push_str(&self.tell_levels());
        text.push_str(&self.remarks());
        Ok(Reply::text(text))
    }

    /// The levels at the current time as a desk shows them, in percent; beside them the light
    /// behind the dimmers where it is another.
    fn tell_levels(&self) -> String {
        let lights = self.present();
        let levels = self.present_levels();
        let mut text = String::new();
        if levels.is_some() {
            let _ = writeln!(text, "  {:<14} {:>6} {:>7}", "", "level", "light");
        }
        let shown = levels.as_ref().unwrap_or(&lights);
        let rows = self.show().coordinates().into_iter().zip(shown);
        for ((coordinate, level), light) in rows.zip(&lights) {
            let bar = "#".repeat((level * 40.0).round().clamp(0.0, 40.0) as usize);
            let beside = match levels {
                Some(_) => format!(" {:>7.1}", light * 100.0),
                None => String::new(),
            };
            let (name, percent) = (coordinate.name, level * 100.0);
            let line = format!("  {name:<14} {percent:>6.1}{beside}  {bar}");
            let _ = writeln!(text, "{}", line.trim_end());
        }
        text
    }

    pub(super) fn answer_refine(&mut self, call: &Call) -> Result<Reply, Error> {
        let mut call = call.clone();
        if let Some(words) = beside(&mut call) {
            let notes = self.refine_beside(goal(&call)?, &words)?;
            return Ok(Reply::text(match notes.is_empty() {
                true => "refining beside the prompt: `status` tells how far it is".to_owned(),
                false => notes.join("\n"),
            }));
        }
        let goal = goal(&call)?;
        self.idle()?;
        self.coarse()?;
        let before = self.steps().len();
        let done = self.refine_watched(goal, &mut |_| Ok(()))?;
        let mut text = String::new();
        for step in self.steps().iter().skip(before.saturating_sub(1)) {
            let _ = writeln!(
                text,
                "{}",
                describe_step(step.refined, step.error, step.seconds)
            );
        }
        for remark in done.remarks {
            let _ = writeln!(text, "{remark}");
        }
        text.push_str(done.ended.words());
        Ok(Reply {
            stopped: done.ended == Ended::Stopped,
            ..Reply::text(text)
        })
    }

    pub(super) fn answer_save(&mut self, call: &Call) -> Result<Reply, Error> {
        let path = match call.words.first() {
            Some(word) => PathBuf::from(word),
            None => self.path.clone().ok_or_else(|| {
                Error::Usage("the show has no file yet; say `save NAME.lxq`".to_owned())
            })?,
        };
        self.save(&path)?;
        Ok(Reply::text(format!("saved {}", path.display())))
    }

    /// Writes the show's text to `path`. The show's own file is only replaced when it still holds
    /// what was read from it.
    ///
    /// # Errors
    /// [`Error::Usage`] among blind edits and when the file changed meanwhile, [`Error::File`] when it cannot be written.
    pub fn save(&mut self, path: &Path) -> Result<(), Error> {
        if self.is_blind() {
            let message = "there are blind edits and nothing was written: `record` keeps them, \
                           `blind off` drops them; then save";
            return Err(Error::Usage(message.to_owned()));
        }
        let own = self.path.as_deref() == Some(path);
        if let Ok(now) = self.host.store.read(path, super::LIMIT) {
            if own && now != self.saved.as_bytes() {
                return Err(Error::Usage(format!(
                    "{} changed on disk since it was read; nothing was written. `save OTHER.lxq` \
                     keeps your edits beside it",
                    path.display()
                )));
            }
            if !own && now != self.source.as_bytes() {
                return Err(Error::Usage(format!(
                    "{} exists already and was not written; choose another name",
                    path.display()
                )));
            }
        }
        self.host.store.write(path, self.source.as_bytes())?;
        self.saved = self.source.clone();
        self.path = Some(path.to_owned());
        Ok(())
    }

    pub(super) fn answer_quit(&mut self, warned: bool) -> Reply {
        if self.unsaved() && !warned {
            self.warned = true;
            return Reply::text("the edits are not saved: `save`, or `quit` again to drop them");
        }
        // What is in hand beside the prompt is given up with it.
        self.beside = None;
        Reply {
            quit: true,
            ..Reply::default()
        }
    }

    pub(super) fn describe_edit(
        &self,
        news: &Report,
        changes: &[Change],
        refined_before: usize,
    ) -> String {
        let mut text = String::new();
        if !news.diagnostics.is_empty() {
            text.push_str(&news.render(self.host.style));
        }
        for change in changes {
            let added = change.action == Action::Added;
            let done = if added {
                "added"
            } else {
                "replaced as a whole"
            };
            let _ = writeln!(text, "{}: {done}", change.what());
            if added && change.kind == "cue" {
                text.push_str(&self.started_instead(&change.name));
            }
        }
        text.push_str(&self.headline());
        match (refined_before, self.refined()) {
            (0, _) => {}
            (before, 0) => {
                let _ = write!(text, "; {} no longer fit", count(before, "refined picture"));
            }
            (_, kept) => {
                let _ = write!(text, "; {} kept", count(kept, "refined picture"));
            }
        }
        text
    }

    /// What to say where a new cue is started by the one before it in place of the one behind it.
    fn started_instead(&self, number: &str) -> String {
        let cues = &self.show().cues;
        let index = cues.iter().position(|c| c.number.to_string() == number);
        let around = index.and_then(|i| Some((cues.get(i.checked_sub(1)?)?, cues.get(i + 1)?)));
        let Some((before, behind)) = around else {
            return String::new();
        };
        let word = match before.link {
            Some((_, Link::Follow(_))) => "follow",
            Some((_, Link::Hang(_))) => "hang",
            None => return String::new(),
        };
        format!(
            "cue {}: its `{word}` starts cue {number} now, and no longer cue {}\n",
            before.number, behind.number
        )
    }

    /// A time within the show, as typed.
    pub(super) fn time(&self, text: &str) -> Result<Time, Error> {
        let time = duration(text)?;
        let (start, end) = (self.timeline().start(), self.timeline().end());
        if time < start || time > end {
            return Err(Error::Usage(format!(
                "{time} is outside the show, which runs from {start} to {end}"
            )));
        }
        Ok(time)
    }
}

/// Takes the `&` off that asks for work beside the prompt; the line without its options, if it was
/// there.
fn beside(call: &mut Call) -> Option<String> {
    let last = call.words.last_mut()?;
    *last = last.strip_suffix('&')?.to_owned();
    call.words.retain(|w| !w.is_empty());
    let words = call.words.join(" ");
    Some(match words.is_empty() {
        true => "refine &".to_owned(),
        false => format!("refine {words} &"),
    })
}

/// What `refine` is asked for.
pub(super) fn goal(call: &Call) -> Result<Goal, Error> {
    let words: Vec<&str> = call.words.iter().map(String::as_str).collect();
    Ok(match words.as_slice() {
        [] => Goal::default(),
        ["until", error] => Goal {
            until: Some(fraction(error)?),
            ..Goal::default()
        },
        ["for", time] => Goal {
            budget: Some(duration(time)?.seconds()),
            ..Goal::default()
        },
        [number] => Goal {
            count: Some(whole(number)?),
            ..Goal::default()
        },
        _ => {
            return Err(Error::Usage(
                "usage: refine [N | until X% | for TIME] [&]".to_owned(),
            ));
        }
    })
}

/// What `help` says.
pub(super) fn help(call: &Call) -> Result<Reply, Error> {
    if let Some(name) = call.words.first() {
        let declared = verb::DECLARATIONS.iter().find(|d| d.word == name);
        let spec = match (verb::find(name), declared) {
            (Err(_), Some(declared)) => return Ok(Reply::text(of_declaration(declared))),
            (found, _) => found?,
        };
        let mut text = format!("{}\n  {}\n", spec.usage(), spec.about);
        for option in spec.options {
            let name = match option.letter {
                Some(letter) => format!("-{letter}, --{}", option.name),
                None => format!("--{}", option.name),
            };
            let name = format!("{name} {}", option.value.unwrap_or_default());
            let _ = writeln!(text, "  {name:<22} {}", option.about);
        }
        let _ = write!(text, "example: {}", spec.example);
        if let Some(declared) = declared {
            let _ = write!(text, "\n\n{}", of_declaration(declared));
        }
        return Ok(Reply::text(text));
    }
    let mut text = String::from("verbs\n");
    for spec in VERBS {
        let _ = writeln!(text, "  {:<11} {}", spec.name, spec.about);
    }
    let _ = write!(
        text,
        "\nDeclarations change the show: {}.\n\
         One replaces what has its kind and name, as a whole; `show cue 2` prints the text to edit.\n\
         `help WORD` tells more of a verb or a declaration.",
        wrapped(lang::keywords())
    );
    Ok(Reply::text(text))
}

fn of_declaration(declared: &Declaration) -> String {
    let Declaration {
        usage,
        about,
        example,
        ..
    } = declared;
    format!("{usage}\n  {about}\nexample: {example}")
}

/// Words in lines of at most 72 letters.
fn wrapped(words: &[&str]) -> String {
    let mut out = String::new();
    let mut length = 31;
    for (i, word) in words.iter().enumerate() {
        if i > 0 {
            out.push(',');
            length += word.len() + 2;
            out.push_str(if length > 72 { "\n  " } else { " " });
            length = if length > 72 { word.len() + 2 } else { length };
        }
        out.push_str(word);
    }
    out
}

/// One line about where the sequence stands.
pub(super) fn describe_step(refined: usize, error: f64, seconds: f64) -> String {
    format!(
        "{:>3} refined  predicted error {:>8} %  {seconds:.1} s",
        refined,
        percent(error)
    )
}

/// A relative number in percent, three digits.
pub(super) fn percent(x: f64) -> String {
    let p = x * 100.0;
    match p.abs() {
        a if a >= 100.0 => format!("{p:.0}"),
        a if a >= 10.0 => format!("{p:.1}"),
        a if a >= 1.0 || a == 0.0 => format!("{p:.2}"),
        _ => format!("{p:.3}"),
    }
}

/// `1 cue`, `2 cues`.
pub(super) fn count(n: usize, what: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n} {what}{plural}")
}

pub(super) fn label(cue: &Cue) -> String {
    if cue.label.is_empty() {
        return String::new();
    }
    format!("\"{}\"", cue.label)
}

fn lights(show: &Show, lights: &[usize]) -> String {
    let names = lights
        .iter()
        .filter_map(|l| show.lights.get(*l))
        .map(|l| l.name.as_str());
    names.collect::<Vec<_>>().join(" ")
}

/// `2%` or `0.02`; between 0 and 1.
pub(super) fn fraction(text: &str) -> Result<f64, Error> {
    let meant = match text.parse::<f64>() {
        Ok(percent) if percent > 1.0 && percent <= 100.0 => format!("{percent}%"),
        _ => "2% or 0.02".to_owned(),
    };
    let value = match text.strip_suffix('%') {
        Some(number) => number.trim().parse::<f64>().map(|p| p / 100.0),
        None => text.parse::<f64>(),
    };
    value
        .ok()
        .filter(|v| (0.0..=1.0).contains(v))
        .ok_or_else(|| Error::Usage(format!("`{text}` is not an error; write it as {meant}")))
}

/// `5`, `1.5s`, `1:30`, `250ms`.
pub(super) fn duration(text: &str) -> Result<Time, Error> {
    lang::time(text).ok_or_else(|| {
        Error::Usage(format!(
            "`{text}` is not a time; write it as 5, 1.5s or 1:30"
        ))
    })
}

/// A whole number of pictures.
pub(super) fn whole(text: &str) -> Result<usize, Error> {
    text.parse()
        .map_err(|_| Error::Usage(format!("`{text}` is not a whole number")))
}

/// What a text declares under a name.
fn declared<'t>(text: &'t str, name: &str) -> Vec<&'t str> {
    let find = |what: &str| lang::edit::locate(text, what);
    let of_kind = |kind: &&str| find(&format!("{kind} {name}"));
    // These stand once, without a name; asked for by another name they would answer to it.
    let named = |kind: &&&str| !["show", "preview", "default"].contains(*kind);
    let kinds = lang::keywords().iter().filter(named).filter_map(of_kind);
    let mut places: Vec<_> = find(name).into_iter().chain(kinds).collect();
    places.sort_by_key(|place| place.start);
    places.dedup();
    places
        .into_iter()
        .filter_map(|place| text.get(place))
        .collect()
}
