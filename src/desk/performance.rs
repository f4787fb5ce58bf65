//! Runs a show like an operator: cues start on GO, not at the preview's times.
//!
//! The started cues form a second show, in the order and at the times of their starts. Its curves
//! follow the rules of every show, so that a live fade equals that of the preview.

use std::collections::BTreeMap;

use super::patch::values;
use footlight_show::model::{Cue, Fade, Motion, Move, NodeId, Part, Show, Trigger};
use footlight_show::timeline::{Timeline, TimelineError, lights, tracked};
use footlight_show::units::{CueNumber, Time};

/// Most started cues kept; when there are more, running fades are cut off.
const MOST: usize = 1000;

/// A show and its started cues.
#[derive(Debug)]
pub struct Performance<'s> {
    show: &'s Show,
    /// The started cues as a show.
    run: Show,
    timeline: Timeline,
    /// By started cue, its index in the show; `None` for the state at the start of the run.
    order: Vec<Option<usize>>,
    /// Held levels, by bank.
    held: BTreeMap<usize, f64>,
}

impl<'s> Performance<'s> {
    /// The show before its first cue: everything is out.
    ///
    /// # Errors
    /// Only for a show without a timeline.
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

    /// Starts the next cue at `now`, with the cues that it triggers; false after the last.
    ///
    /// # Errors
    /// As [`Timeline::of_desk`]; the state is then unchanged.
    pub fn go(&mut self, now: Time) -> Result<bool, Vec<TimelineError>> {
        let next = self.cue(now).map_or(0, |cue| cue + 1);
        if next >= self.show.cues.len() {
            return Ok(false);
        }
        self.follow(next, now)
    }

    /// Starts the next cue. If, from the current state, its curves leave their ranges or a head's
    /// beam becomes as wide as its field, it becomes a straight fade to the cue's end.
    fn follow(&mut self, cue: usize, now: Time) -> Result<bool, Vec<TimelineError>> {
        match self.start(cue, None, now) {
            Ok(()) => Ok(true),
            Err(_) => self.jump(cue, now),
        }
    }

    /// Goes back to the completed state of the previous cue, in that cue's time.
    ///
    /// # Errors
    /// As [`Performance::go`].
    pub fn back(&mut self, now: Time) -> Result<bool, Vec<TimelineError>> {
        match self.cue(now).and_then(|cue| cue.checked_sub(1)) {
            Some(before) => self.jump(before, now),
            None => Ok(false),
        }
    }

    /// Goes to the completed state of a cue, in its time; false when there is no such cue.
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

    /// A cue with those that follow it automatically; the first starts at once.
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

    /// Drops cues that have not started, and ended ones once nothing is running.
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

    /// Index of the last started cue in the show.
    pub fn cue(&self, now: Time) -> Option<usize> {
        let started = self.timeline.cues().iter().zip(&self.order);
        let mut begun = started.filter(|(times, _)| times.go <= now);
        begun.next_back().and_then(|(_, cue)| *cue)
    }

    /// Holds a bank at a level, 0 to 1, until released; false when there is no such bank.
    pub fn hold(&mut self, bank: &str, level: f64) -> bool {
        let found = self.show.banks.iter().position(|b| b.name == bank);
        found
            .map(|bank| self.held.insert(bank, level.clamp(0.0, 1.0)))
            .is_some()
    }

    /// Releases all held levels.
    pub fn release(&mut self) {
        self.held.clear();
    }

    /// The values at a time, in the order of [`values`].
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

/// A cue that sets all of `levels` at once.
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

/// A cue that fades to all of `levels` in the time of another.
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
