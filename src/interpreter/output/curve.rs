//! Curves: every bank's level over time, as a drawing.

use std::path::Path;

use super::{ending, unknown_ending};
use crate::chart::{self, Drawing, Theme};
use crate::interpreter::answer::count;
use crate::interpreter::{Call, Error, Interpreter, Reply, Shown};
use crate::show::Coordinate;
use crate::timeline::Timeline;
use crate::units::Time;

/// Points drawn of each second of a curve, beside its knots.
const POINTS_A_SECOND: f64 = 8.0;

/// Most points drawn of a curve.
const MOST_POINTS: f64 = 2000.0;

impl Interpreter {
    /// Every bank's level over time, cues marked.
    pub(in crate::interpreter) fn curves(&self, playhead: Option<Time>) -> Drawing {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        let banks = self.show().coordinates().into_iter().enumerate();
        let rows = banks
            .filter(|(_, c)| c.bank.is_some())
            .map(|(i, coordinate)| chart::Row {
                points: points(self.timeline(), i),
                before: Vec::new(),
                colour: hue(&coordinate),
                name: coordinate.name,
            });
        let cues = self.show().cues.iter().zip(self.timeline().cues());
        let curves = chart::Curves {
            title: self.show().title.clone(),
            start: start.seconds(),
            end: end.seconds(),
            rows: rows.collect(),
            cues: cues
                .map(|(cue, time)| (time.go.seconds(), cue.number.to_string()))
                .collect(),
            playhead: playhead.map(Time::seconds),
        };
        chart::curves(&curves, Theme::Dark)
    }

    pub(in crate::interpreter) fn answer_plot(&mut self, call: &Call) -> Result<Reply, Error> {
        let drawing = self.curves(Some(self.now));
        let text = format!(
            "{} of {}",
            count(self.show().banks.len(), "bank"),
            self.show().title
        );
        let Some(path) = call.option("output").map(Path::new) else {
            let (width, height, rgb) = drawing.rgb8()?;
            return Ok(Reply {
                picture: Some(Shown {
                    size: (width, height),
                    rgb,
                }),
                ..Reply::text(text)
            });
        };
        match ending(path).as_str() {
            "png" => self.write_reply(Some(path), &drawing.png()?, text),
            "svg" => self.write_reply(Some(path), drawing.svg().as_bytes(), text),
            _ => Err(unknown_ending(path, ".png or .svg")),
        }
    }
}

/// A coordinate's setting over time, dense enough to draw; two points at a jump.
pub(in crate::interpreter) fn points(timeline: &Timeline, coordinate: usize) -> Vec<(f64, f64)> {
    let (start, end) = (timeline.start(), timeline.end());
    let length = (end - start).seconds().max(1e-6);
    let density = POINTS_A_SECOND.min(MOST_POINTS / length);
    let mut out = Vec::new();
    let pieces = timeline.curve(coordinate).iter();
    for piece in pieces.filter(|p| p.end >= start && p.start <= end) {
        let seconds = (piece.end - piece.start).seconds();
        let steps = match piece.polynomial.degree() {
            0 | 1 => 1,
            _ => ((seconds * density).ceil() as usize).clamp(8, 400),
        };
        for k in 0..=steps {
            let time = piece.start + (piece.end - piece.start).scaled(k as f64 / steps as f64);
            out.push((time.seconds(), piece.value(time)));
        }
    }
    let last = timeline.last().get(coordinate).copied().unwrap_or(0.0);
    out.push((end.seconds(), last));
    out
}

/// The colour in which a coordinate is drawn: of an rgb bank its own, else the theme's.
pub(in crate::interpreter) fn hue(coordinate: &Coordinate) -> Option<[u8; 3]> {
    coordinate.channel.map(|channel| match channel {
        0 => [230, 70, 60],
        1 => [70, 180, 80],
        _ => [80, 120, 240],
    })
}
