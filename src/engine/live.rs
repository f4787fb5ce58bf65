//! Live control, as at a desk: go, back, goto; levels that are tried, recorded or released; blind
//! edits. The text changes only when something is recorded.

use std::collections::BTreeSet;

use super::{Document, Edited, Engine, Error};
use footlight_host::files::Files;
use footlight_show::diagnostic::Diagnostics;
use footlight_show::lang::edit::{CueText, Edit};
use footlight_show::lang::{self, SetLevel};
use footlight_show::model::{Pose, Show};
use footlight_show::timeline::{self, CueTime};
use footlight_show::units::{CueNumber, Time};

/// Levels for some parameters, such as those of `lamps 40 sky #203060`.
#[derive(Clone, Debug, PartialEq)]
pub struct Moves {
    text: String,
    levels: Vec<SetLevel>,
    /// Revision of the document that defines these parameters.
    revision: u64,
}

impl Moves {
    /// Reads levels as a cue of the document would set them: its banks, groups, looks and named
    /// values. Neither the text nor the levels change.
    ///
    /// # Errors
    /// [`Error::Show`] with places in `text`, [`Error::NoLevels`].
    pub fn read(document: &Document, text: &str, files: &dyn Files) -> Result<Moves, Error> {
        let levels = lang::levels(files, document.name(), document.text(), text)
            .map_err(|list| Error::Show(Diagnostics::of(list, "typed", text)))?;
        if levels.is_empty() {
            Err(Error::NoLevels)
        } else {
            Ok(Moves {
                text: text.to_owned(),
                levels,
                revision: document.revision(),
            })
        }
    }

    /// The text as written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The parameters set, with levels as fractions of full.
    pub fn levels(&self) -> &[SetLevel] {
        &self.levels
    }
}

/// The current moment, the levels being tried on top of it, and blind edits.
///
/// ```
/// use footlight_engine::{Document, LiveControl, Moves};
/// use footlight_host::files::Memory;
///
/// # fn main() -> Result<(), footlight_engine::Error> {
/// let text = b"show \"S\"\nbank a = x\nlight x spot at 0,0,3 aim 0,0,0 beam 20 field 30 900 cd\n\
///     cue 1 at 0:00 { snap  a 50 }\ncue 2 at 0:05 { time 2  a 80 }\n";
/// let files = Memory::default();
/// let document = Document::new("s.lxq", text, &files)?;
/// let mut live = LiveControl::new(&document);
/// live.go(&document)?;
/// assert!((live.levels(&document)[0] - 0.8).abs() < 1e-12);
/// live.set(&document, Moves::read(&document, "a 30", &files)?)?;
/// assert!((live.levels(&document)[0] - 0.3).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default)]
pub struct LiveControl {
    now: Time,
    /// True when the next cue starts now and has not begun.
    before: bool,
    tried: Vec<(String, Vec<SetLevel>)>,
    /// The text before the blind edits.
    blind: Option<String>,
    /// Revision of the document, whose parameters the trial levels use.
    revision: u64,
}

impl LiveControl {
    /// Starts at the beginning of a document's show.
    pub fn new(document: &Document) -> LiveControl {
        LiveControl {
            now: document.timeline().start(),
            revision: document.revision(),
            ..LiveControl::default()
        }
    }

    /// Adapts to an edit: the moment stays within the show, and trial levels of a show with another
    /// meaning are released.
    pub fn follow(&mut self, document: &Document) {
        let (start, end) = (document.timeline().start(), document.timeline().end());
        let now = self.now.clamp(start, end);
        self.before &= now == self.now;
        self.now = now;
        if self.revision != document.revision() {
            self.revision = document.revision();
            self.tried.clear();
        }
    }

    /// The moment.
    pub fn time(&self) -> Time {
        self.now
    }

    /// The moment shown: a microsecond earlier before a cue that starts now.
    fn instant(&self) -> Time {
        if self.before {
            self.now - Time::from_micros(1)
        } else {
            self.now
        }
    }

    /// Index of the last started cue.
    pub fn cue(&self, document: &Document) -> Option<usize> {
        let cues = document.timeline().cues();
        let now = self.instant();
        cues.iter().rposition(|cue| cue.go <= now)
    }

    /// Moves to a time within the show, and returns the released trial levels as written.
    ///
    /// # Errors
    /// [`Error::OutsideShow`].
    pub fn move_to(&mut self, document: &Document, time: Time) -> Result<Vec<String>, Error> {
        document.check_time(time)?;
        Ok(self.go_to((time, false)))
    }

    fn go_to(&mut self, (time, before): (Time, bool)) -> Vec<String> {
        (self.now, self.before) = (time, before);
        let tried = std::mem::take(&mut self.tried);
        tried.into_iter().map(|(text, _)| text).collect()
    }

    /// Runs the next cue, and those that follow automatically, to their end; returns the released
    /// levels.
    ///
    /// # Errors
    /// [`Error::NoCues`], [`Error::LastCue`].
    pub fn go(&mut self, document: &Document) -> Result<Vec<String>, Error> {
        let next = self.cue(document).map_or(0, |index| index + 1);
        let last = chain_end(document.show(), next);
        let time = settled(document, last).ok_or(match next {
            0 => Error::NoCues,
            _ => Error::LastCue,
        })?;
        Ok(self.go_to(time))
    }

    /// Goes to the end of the previous cue; returns the released levels.
    ///
    /// # Errors
    /// [`Error::FirstCue`].
    pub fn back(&mut self, document: &Document) -> Result<Vec<String>, Error> {
        let before = self.cue(document).and_then(|index| index.checked_sub(1));
        let time = before.and_then(|index| settled(document, index));
        Ok(self.go_to(time.ok_or(Error::FirstCue)?))
    }

    /// Goes to the end of a cue, or to a share of its time, clamped to 0 to 1; returns the released
    /// levels.
    ///
    /// # Errors
    /// [`Error::NoSuchCue`].
    pub fn goto(
        &mut self,
        document: &Document,
        cue: CueNumber,
        share: Option<f64>,
    ) -> Result<Vec<String>, Error> {
        let index = index_of(document, cue)?;
        let time = match (document.timeline().cues().get(index), share) {
            (Some(cue), Some(share)) => Some((part_of(cue, share.clamp(0.0, 1.0)), false)),
            _ => settled(document, index),
        };
        Ok(self.go_to(time.ok_or(Error::NoSuchCue(cue))?))
    }

    /// Tries levels on top of the cues at this moment. A level set again replaces the earlier one.
    ///
    /// # Errors
    /// [`Error::StaleMoves`] for moves read before an edit.
    pub fn set(&mut self, document: &Document, moves: Moves) -> Result<(), Error> {
        if moves.revision != document.revision() {
            return Err(Error::StaleMoves);
        }
        self.follow(document);
        let tried = self.brightened(document, moves.levels);
        let again = |(_, old): &(String, Vec<SetLevel>)| {
            old.iter()
                .all(|old| tried.iter().any(|new| new.parameter == old.parameter))
        };
        self.tried.retain(|tried| !again(tried));
        self.tried.push((moves.text, tried));
        Ok(())
    }

    /// The trial levels, if the show has not changed its meaning.
    fn trying(&self, document: &Document) -> impl Iterator<Item = &SetLevel> {
        let same = self.revision == document.revision();
        let tried = self.tried.iter().filter(move |_| same);
        tried.flat_map(|(_, tried)| tried)
    }

    /// Releases the trial levels; false if there are none.
    pub fn release(&mut self) -> bool {
        let trying = self.is_trying();
        self.tried.clear();
        trying
    }

    /// True while levels are being tried.
    pub fn is_trying(&self) -> bool {
        !self.tried.is_empty()
    }

    /// The trial levels, as written.
    pub fn tried(&self) -> Vec<&str> {
        self.tried.iter().map(|(text, _)| text.as_str()).collect()
    }

    /// Adds the levels implied by a plain colour on a bank that is out, as in a cue: its level at
    /// full, unnamed emitters dark.
    fn brightened(&self, document: &Document, mut set: Vec<SetLevel>) -> Vec<SetLevel> {
        let (show, now) = (document.show(), self.levels(document));
        for (bank, first) in show.banks.iter().zip(show.first_parameters()) {
            let moves = |parameter: usize| set.iter().any(|s| s.parameter == parameter);
            let emitters = first + 1..first + 4;
            let out = now.get(first).is_none_or(|level| *level == 0.0);
            if !bank.rgb || !out || moves(first) || !emitters.clone().any(moves) {
                continue;
            }
            let dark: Vec<usize> = emitters.filter(|e| !moves(*e)).collect();
            let to = |parameter, level| SetLevel { parameter, level };
            set.push(to(first, 1.0));
            set.extend(dark.into_iter().map(|emitter| to(emitter, 0.0)));
        }
        set
    }

    /// The light of each coordinate at this moment, relative to full, with trial levels.
    pub fn setting(&self, document: &Document) -> Vec<f64> {
        let show = document.show();
        let mut setting = document.timeline().evaluate(self.instant());
        let tried: BTreeSet<usize> = self.trying(document).map(|t| t.parameter).collect();
        if tried.is_empty() {
            return setting;
        }
        let lights = timeline::lights(show, &self.levels(document));
        let firsts = show.first_parameters();
        let moved = |bank: usize| match firsts.get(bank..bank + 2) {
            Some(&[first, end]) => tried.range(first..end).next().is_some(),
            _ => false,
        };
        let own = show.coordinates();
        setting.truncate(own.len());
        for ((slot, light), coordinate) in setting.iter_mut().zip(lights).zip(own) {
            if let Some(bank) = coordinate.bank.filter(|bank| moved(*bank)) {
                *slot = light * self.factor(document, bank);
            }
        }
        document
            .timeline()
            .with_bounced(&setting, &self.poses(document))
    }

    /// The poses of heads at this moment, with trial levels.
    pub fn poses(&self, document: &Document) -> Vec<Pose> {
        let (show, levels) = (document.show(), self.levels(document));
        let heads = 0..show.heads().len();
        heads.map(|head| show.pose_of(&levels, head)).collect()
    }

    /// The factor of a bank's effects at this moment.
    pub(super) fn factor(&self, document: &Document, bank: usize) -> f64 {
        document.timeline().factor(bank, self.instant())
    }

    /// Each parameter at this moment, before the dimmers ([`Show::parameters`] names them), as a
    /// fraction of full, with trial levels.
    pub fn levels(&self, document: &Document) -> Vec<f64> {
        let mut levels = document.timeline().levels(self.instant());
        for tried in self.trying(document) {
            if let Some(slot) = levels.get_mut(tried.parameter) {
                *slot = tried.level;
            }
        }
        levels
    }

    /// Writes the trial levels as a new cue and goes to its end. `times` are the up and down times;
    /// `None` uses the show's defaults.
    ///
    /// # Errors
    /// [`Error::NothingTried`], [`Error::CueExists`], else as [`Engine::edit`]; the levels are then
    /// still tried.
    pub fn record(
        &mut self,
        engine: &mut Engine,
        cue: CueNumber,
        label: &str,
        times: Option<(Time, Time)>,
    ) -> Result<Edited, Error> {
        if !self.is_trying() {
            return Err(Error::NothingTried);
        }
        if index_of(engine.document(), cue).is_ok() {
            return Err(Error::CueExists(cue));
        }
        let edit = Edit::SetCue(CueText {
            number: cue,
            label: label.to_owned(),
            up: times.map(|(up, _)| up),
            down: times.map(|(_, down)| down),
            moves: self.tried().into_iter().map(str::to_owned).collect(),
        });
        let edited = engine.edit(&edit)?;
        let document = engine.document();
        self.follow(document);
        let index = index_of(document, cue)?;
        if let Some(time) = settled(document, index) {
            self.go_to(time);
        }
        Ok(edited)
    }

    /// Writes the trial levels into the last started cue, replacing its levels of these parameters,
    /// and goes to its end.
    ///
    /// # Errors
    /// [`Error::NothingTried`], [`Error::NoCues`], else as [`Engine::edit`]; the levels are then
    /// still tried.
    pub fn update(&mut self, engine: &mut Engine) -> Result<Edited, Error> {
        if !self.is_trying() {
            return Err(Error::NothingTried);
        }
        let document = engine.document();
        let index = self.cue(document).ok_or(Error::NoCues)?;
        let cue = document.show().cues.get(index).map(|cue| cue.number);
        let edit = Edit::UpdateMoves {
            cue: cue.ok_or(Error::NoCues)?,
            moves: self.tried().join("  "),
        };
        let edited = engine.edit(&edit)?;
        let document = engine.document();
        self.follow(document);
        if let Some(time) = settled(document, index) {
            self.go_to(time);
        }
        Ok(edited)
    }

    /// The moment of a cue's completion, or of a time after its GO.
    ///
    /// # Errors
    /// [`Error::NoSuchCue`], [`Error::OutsideShow`].
    pub fn moment_of(
        document: &Document,
        cue: CueNumber,
        after: Option<Time>,
    ) -> Result<Time, Error> {
        let index = index_of(document, cue)?;
        let times = document.timeline().cues().get(index);
        let time = match after {
            Some(after) => times.map(|cue| cue.go + after),
            None => settled(document, index).map(|(time, before)| {
                if before {
                    time - Time::from_micros(1)
                } else {
                    time
                }
            }),
        };
        let time = time.ok_or(Error::NoSuchCue(cue))?;
        document.check_time(time)?;
        Ok(time)
    }

    /// True during blind edits.
    pub fn is_blind(&self) -> bool {
        self.blind.is_some()
    }

    /// Begins blind edits: shown, but dropped unless they are kept. False if they had begun.
    pub fn begin_blind(&mut self, document: &Document) -> bool {
        let begins = self.blind.is_none();
        if begins {
            self.blind = Some(document.text().to_owned());
        }
        begins
    }

    /// Keeps the blind edits.
    ///
    /// # Errors
    /// [`Error::NoBlindEdits`].
    pub fn keep_blind(&mut self) -> Result<(), Error> {
        self.blind.take().map(drop).ok_or(Error::NoBlindEdits)
    }

    /// Drops the blind edits and restores the text before them.
    ///
    /// # Errors
    /// [`Error::NoBlindEdits`], else as [`Engine::replace`]; nothing is then changed.
    pub fn drop_blind(&mut self, engine: &mut Engine) -> Result<(), Error> {
        let text = self.blind.as_ref().ok_or(Error::NoBlindEdits)?;
        engine.replace(text)?;
        self.blind = None;
        self.follow(engine.document());
        Ok(())
    }
}

fn index_of(document: &Document, number: CueNumber) -> Result<usize, Error> {
    let mut cues = document.show().cues.iter();
    let found = cues.position(|cue| cue.number == number);
    found.ok_or(Error::NoSuchCue(number))
}

/// The moment of a cue's completion, or of the next cue taking over; true when that one starts
/// exactly then.
fn settled(document: &Document, index: usize) -> Option<(Time, bool)> {
    let cues = document.timeline().cues();
    let cue = cues.get(index)?;
    let next = cues.get(index + 1).map(|next| next.go);
    Some(match next.filter(|go| *go <= cue.completion) {
        Some(go) if go > cue.go => (go, true),
        Some(_) => (cue.go, false),
        None => (cue.completion, false),
    })
}

/// Index of the last of the cues that follow this one automatically, or its own.
fn chain_end(show: &Show, index: usize) -> usize {
    let run = show.cues.iter().skip(index);
    index + run.take_while(|cue| cue.link.is_some()).count()
}

/// The moment at a share of a cue's time.
fn part_of(cue: &CueTime, share: f64) -> Time {
    let whole = (cue.completion - cue.go).micros() as f64;
    cue.go + Time::from_micros((whole * share).round() as i64)
}
