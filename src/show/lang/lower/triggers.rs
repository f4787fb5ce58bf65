//! Triggers of cues over the whole show: one for each cue, in order.

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::lang::codes;
use crate::lang::report::Place;
use crate::model::{Cue, Link, NodeId, Trigger};
use crate::units::Time;

impl Lower<'_, '_> {
    /// Checks the triggers of the sorted cues.
    pub fn triggers(&mut self) {
        let cues = std::mem::take(&mut self.show.cues);
        if let Some(last) = cues.last()
            && let Some((id, link)) = last.link
        {
            self.last_link(last, id, link);
        }
        let mut before: Option<&Cue> = None;
        let mut clock: Option<(Time, &Cue)> = None;
        for cue in &cues {
            if let Trigger::At(time) = cue.trigger {
                if let Some((id, _)) = before.and_then(|b| b.link) {
                    self.started_twice(cue, id);
                }
                if let Some((earlier, other)) = clock.filter(|(earlier, _)| time < *earlier) {
                    self.backwards_in_time(cue, time, other, earlier);
                }
                clock = Some((time, cue));
            }
            before = Some(cue);
        }
        self.show.cues = cues;
    }

    fn last_link(&mut self, cue: &Cue, id: NodeId, link: Link) {
        let word = match link {
            Link::Follow(_) => "follow",
            Link::Hang(_) => "hang",
        };
        let message = format!(
            "`{word}` starts the next cue, but cue {} is the last",
            cue.number
        );
        self.report.add(
            Diagnostic::error(codes::LAST_LINK, message)
                .place_of(id, &self.spans, "starts nothing")
                .help("remove it, or add the cue that it is to start"),
        );
    }

    fn started_twice(&mut self, cue: &Cue, link: NodeId) {
        let message = format!(
            "cue {} is started twice: by the cue before it, and by `at`",
            cue.number
        );
        self.report.add(
            Diagnostic::error(codes::STARTED_TWICE, message)
                .place_of(cue.id, &self.spans, "has a time of its own")
                .place_of(link, &self.spans, "starts it too")
                .help("keep one of the two"),
        );
    }

    fn backwards_in_time(&mut self, cue: &Cue, time: Time, other: &Cue, earlier: Time) {
        let message = format!(
            "cue {} at {time} comes after cue {} at {earlier}",
            cue.number, other.number
        );
        self.report.add(
            Diagnostic::error(codes::ORDER, message)
                .place_of(cue.id, &self.spans, "earlier in time")
                .place_of(other.id, &self.spans, "earlier in number")
                .help("cues run in the order of their numbers: change a time or a number"),
        );
    }
}
