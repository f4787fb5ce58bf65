//! Comparison of two versions of a show: in words, and as curves.

use std::path::Path;

use super::curves::{cues_in_time, hue, points};
use super::sheet::{self, CurveChange, ShowDifference};
use super::words::count;
use super::{Error, format};
use crate::chart::{self, Theme};
use footlight_engine::Version;

/// Two versions of a show, and the changes from the first to the second.
pub struct VersionComparison {
    old: Version,
    new: Version,
    /// The changes.
    pub difference: ShowDifference,
}

impl VersionComparison {
    /// Compares two versions.
    pub fn new(old: Version, new: Version) -> VersionComparison {
        VersionComparison {
            difference: sheet::difference(&old, &new),
            old,
            new,
        }
    }

    /// The changes in words, as in [`describe`].
    pub fn text(&self) -> String {
        describe(&self.difference)
    }

    /// The changed curves, the old ones dashed, as a file.
    pub fn chart(&self, path: &Path) -> Result<Vec<u8>, Error> {
        let old = self.old.show.coordinates();
        let mut rows = Vec::new();
        for (i, coordinate) in self.new.show.coordinates().into_iter().enumerate() {
            let changed = |c: &CurveChange| c.name == coordinate.name;
            let before = old.iter().position(|c| c.name == coordinate.name);
            if let Some(k) = before.filter(|_| self.difference.curves.iter().any(changed)) {
                rows.push(chart::CurveRow {
                    points: points(&self.new.timeline, i),
                    before: points(&self.old.timeline, k),
                    colour: hue(&coordinate),
                    name: coordinate.name,
                    ..chart::CurveRow::default()
                });
            }
        }
        let (a, b) = (&self.old.timeline, &self.new.timeline);
        let curves = chart::CurveChart {
            title: format!("{}: what changed (before: dashed)", self.new.show.title),
            start: a.start().min(b.start()).seconds(),
            end: a.end().max(b.end()).seconds(),
            rows,
            cues: cues_in_time(&self.new.show, b),
            ..chart::CurveChart::default()
        };
        format::drawing(&chart::curves(&curves, Theme::Dark), 1.0, path)
    }
}

impl std::fmt::Debug for VersionComparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.difference.fmt(f)
    }
}

/// The changes in words, and whether images stay valid; empty without changes.
pub fn describe(difference: &ShowDifference) -> String {
    if difference.is_empty() {
        return String::new();
    }
    let pictures = match (difference.pictures, difference.poses) {
        (true, _) => {
            "the rig, the stage or the view changed; those that depend on it are rendered again \
             (`pool` counts the others)"
        }
        (false, 0) => "every picture still serves",
        (false, poses) => &format!(
            "{} of reflected light to be rendered, as moving heads point elsewhere; every other picture \
             still serves",
            count(poses, "picture")
        ),
    };
    format!("{}\npictures: {pictures}\n", difference.text())
}
