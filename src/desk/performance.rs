//! A show as an operator runs it: cues start when somebody says so, not at the preview's times.
//!
//! What was started is a show of its own, whose cues stand in the order and at the times in which they
//! were started. Its curves follow the same rules as every show's, so that a live fade is the fade of
//! the preview.

use std::collections::BTreeMap;

use super::patch::values;
use footlight_show::model::{Cue, Fade, Motion, Move, NodeId, Part, Show, Trigger};
use footlight_show::timeline::{Timeline, TimelineError, lights, tracked};
use footlight_show::units::{CueNumber, Time};

/// Started cues that are kept; beyond them what runs is cut off.
const MOST: usize = 1000;

/// A show and what of it has been started.
#[derive(Debug)]
pub struct Performance<'s> {
    show: &'s Show,
    /// The cues that were started.
    run: Show,
    timeline: Timeline,
    /// By started cue, which of the show's it is; none for what the run began from.
    order: Vec<Option<usize>>,
    /// Levels that a hand holds, by bank.
    held: BTreeMap<usize, f64>,
}

impl<'s> Performance<'s> {
    /// The show before its first cue: everything is out.
    ///
    /// # Errors
    /// None for a show that has a timeline.
    pub fn new(show: &'s Show) -> Result<Performance<'s>, Vec<TimelineError>> {
        let mut run = show.clone();
        run.cues = vec![stand(show, &show.dark_levels(), Time::ZERO)];
        Ok(Performance {
            timeline: Timeline::of_desk(&run)?,
            show,
            run,
            order: vec![None],
            held: BTreeMap::new(),
        })
    }

    /// Starts the next cue at `now`, with those that it starts in turn; false behind the last.
    ///
    /// # Errors
    /// As [`Timeline::of_desk`]; nothing has changed then.
    pub fn go(&mut self, now: Time) -> Result<bool, Vec<TimelineError>> {
        let next = self.cue(now).map_or(0, |cue| cue + 1);
        if next >= self.show.cues.len() {
            return Ok(false);
        }
        self.follow(next, now)
    }

    /// Starts a cue that comes next. From where the show stands its curves may leave their ranges, or
    /// a head's beam become as wide as its field; it is then a straight fade to where the cue ends.
    fn follow(&mut self, cue: usize, now: Time) -> Result<bool, Vec<TimelineError>> {
        match self.start(cue, None, now) {
            Ok(()) => Ok(true),
            Err(_) => self.jump(cue, now),
        }
    }

    /// Goes back to what stood when the cue before was complete, in that cue's time.
    ///
    /// # Errors
    /// As [`Performance::go`].
    pub fn back(&mut self, now: Time) -> Result<bool, Vec<TimelineError>> {
        match self.cue(now).and_then(|cue| cue.checked_sub(1)) {
            Some(before) => self.jump(before, now),
            None => Ok(false),
        }
    }

    /// Goes to what stands when a cue is complete, in its time; false where there is no such cue.
    ///
    /// # Errors
    /// As [`Performance::go`].
    pub fn goto(&mut self, number: CueNumber, now: Time) -> Result<bool, Vec<TimelineError>> {
        let found = self.show.cues.iter().position(|cue| cue.number == number);
        let next = self.cue(now).map_or(0, |cue| cue + 1);
        match found {
            None => Ok(false),
            Some(cue) if cue == next => self.follow(cue, now),
            Some(cue) => self.jump(cue, now),
        }
    }

    fn jump(&mut self, cue: usize, now: Time) -> Result<bool, Vec<TimelineError>> {
        let levels = tracked(self.show)?.nth(cue);
        self.start(cue, levels, now).map(|()| true)
    }

    /// Starts a cue, or a fade to all of `levels` in its time.
    fn start(
        &mut self,
        cue: usize,
        levels: Option<Vec<f64>>,
        now: Time,
    ) -> Result<(), Vec<TimelineError>> {
        let (run, timeline, order) = (
            self.run.cues.clone(),
            self.timeline.clone(),
            self.order.clone(),
        );
        self.forget(now);
        let chain = match levels {
            Some(levels) => vec![(cue, fade(self.show, cue, &levels))],
            None => self.chain(cue),
        };
        for (position, (index, mut started)) in chain.into_iter().enumerate() {
            if position == 0 {
                started.trigger = Trigger::At(now);
            }
            self.run.cues.push(started);
            self.order.push(Some(index));
        }
        for (number, cue) in (1..).zip(&mut self.run.cues) {
            cue.number = CueNumber::from_thousandths(number).unwrap_or(cue.number);
        }
        if let Some(last) = self.run.cues.last_mut() {
            last.link = None;
        }
        match Timeline::of_desk(&self.run) {
            Ok(new) => {
                self.timeline = new;
                Ok(())
            }
            Err(errors) => {
                (self.run.cues, self.timeline, self.order) = (run, timeline, order);
                Err(errors)
            }
        }
    }

    /// A cue with those that follow it by themselves; the first of them waits for nothing.
    fn chain(&self, first: usize) -> Vec<(usize, Cue)> {
        let mut out = Vec::new();
        for (index, cue) in self.show.cues.iter().enumerate().skip(first) {
            let mut cue = cue.clone();
            cue.trigger = Trigger::Go;
            let goes_on = cue.link.is_some();
            out.push((index, cue));
            if !goes_on {
                break;
            }
        }
        out
    }

    /// Drops what has not started yet, and what has ended once nothing runs any more.
    fn forget(&mut self, now: Time) {
        let begun = self
            .timeline
            .cues()
            .iter()
            .filter(|cue| cue.go <= now)
            .count()
            .max(1);
        self.run.cues.truncate(begun);
        self.order.truncate(begun);
        if let Some(last) = self.run.cues.last_mut() {
            last.link = None;
        }
        let idle = now >= self.timeline.end() && self.show.effects.is_empty();
        if idle || self.run.cues.len() > MOST {
            let levels = self.timeline.levels(now);
            self.run.cues = vec![stand(self.show, &levels, now)];
            self.order = vec![self.order.last().copied().flatten()];
        }
    }

    /// The cue that was started last, by its place in the show.
    pub fn cue(&self, now: Time) -> Option<usize> {
        let started = self.timeline.cues().iter().zip(&self.order);
        let mut begun = started.filter(|(times, _)| times.go <= now);
        begun.next_back().and_then(|(_, cue)| *cue)
    }

    /// Holds a bank at a level, 0 to 1, until it is released; false where there is no such bank.
    pub fn hold(&mut self, bank: &str, level: f64) -> bool {
        let found = self.show.banks.iter().position(|b| b.name == bank);
        found
            .map(|bank| self.held.insert(bank, level.clamp(0.0, 1.0)))
            .is_some()
    }

    /// Lets go of all levels that are held.
    pub fn release(&mut self) {
        self.held.clear();
    }

    /// The values of a time, as [`values`] has them.
    pub fn values(&self, now: Time) -> Vec<f64> {
        let mut settings = values(self.show, &self.timeline, now);
        if self.held.is_empty() {
            return settings;
        }
        let mut levels = self.timeline.levels(now);
        for (bank, first) in self.show.first_parameters().iter().enumerate() {
            if let (Some(level), Some(place)) = (self.held.get(&bank), levels.get_mut(*first)) {
                *place = *level;
            }
        }
        let held = lights(self.show, &levels);
        let slots = settings.iter_mut().zip(held).zip(self.show.coordinates());
        for ((slot, light), coordinate) in slots {
            if coordinate
                .bank
                .is_some_and(|bank| self.held.contains_key(&bank))
            {
                *slot = light;
            }
        }
        settings
    }
}

/// A cue that goes to all of `levels` at once.
fn stand(show: &Show, levels: &[f64], now: Time) -> Cue {
    let part = Part {
        id: NodeId(0),
        number: 1,
        written: true,
        label: String::new(),
        delay: Time::ZERO,
        up: Time::ZERO,
        down: Time::ZERO,
        by_default: [false; 2],
        curve: Fade::LINEAR,
        moves: all(show, levels),
        effects: Vec::new(),
    };
    Cue {
        id: NodeId(0),
        number: CueNumber::FIRST,
        label: String::new(),
        note: String::new(),
        trigger: Trigger::At(now),
        link: None,
        block: false,
        assert: false,
        cueonly: false,
        parts: vec![part],
    }
}

/// A cue that goes to all of `levels` in the time of another.
fn fade(show: &Show, cue: usize, levels: &[f64]) -> Cue {
    let mut out = stand(show, levels, Time::ZERO);
    let own = show.cues.get(cue).and_then(|cue| cue.parts.first());
    if let (Some(part), Some(own)) = (out.parts.first_mut(), own) {
        (part.up, part.down) = (own.up, own.down);
    }
    out
}

fn all(show: &Show, levels: &[f64]) -> Vec<Move> {
    let parameters = show.parameters();
    let banks = parameters
        .iter()
        .enumerate()
        .filter(|(_, p)| p.bank.is_some());
    let to = |(parameter, _)| Move {
        id: NodeId(0),
        parameter,
        motion: Motion::To(levels.get(parameter).copied().unwrap_or(0.0)),
        repeat: 1,
    };
    banks.map(to).collect()
}
