//! Poses of heads in a designer's words.

use std::collections::BTreeMap;

use super::level::{Done, by_group, number};
use footlight_show::geometry::Vec3;
use footlight_show::model::{Head, HeadAxis, Luminaire, Move, Pose, Show};

/// Difference below which directions are equal.
const SAME: f64 = 1e-9;

/// A head of a show with its light.
#[derive(Clone, Copy)]
pub struct Moving<'s> {
    /// Its light.
    pub light: &'s Luminaire,
    /// Its ranges.
    pub head: &'s Head,
    /// The index of its bank.
    pub bank: usize,
}

/// The heads of a show, in their order.
pub fn heads(show: &Show) -> Vec<Moving<'_>> {
    let heads = show.heads().into_iter();
    let of = |(light, head, bank)| {
        let light = show.lights.get(light)?;
        Some(Moving { light, head, bank })
    };
    heads.filter_map(of).collect()
}

impl Moving<'_> {
    /// The point of the show at which the head points in a pose.
    fn point<'s>(&self, show: &'s Show, pose: Pose) -> Option<(&'s str, Vec3)> {
        let (from, to) = (
            self.light.kind.place()?,
            self.head.direction(pose.pan, pose.tilt),
        );
        let found = show.points.iter().find(|point| {
            let towards = (point.at - from).normalized();
            (towards - to).length() < SAME
        });
        found.map(|point| (point.name.as_str(), point.at))
    }

    /// The target of the head in a pose: a point of the show, or where the axis of the beam meets
    /// the floor, z = 0.
    pub fn place(&self, show: &Show, pose: Pose) -> Option<Vec3> {
        if let Some((_, at)) = self.point(show, pose) {
            return Some(at);
        }
        let (from, to) = (
            self.light.kind.place()?,
            self.head.direction(pose.pan, pose.tilt),
        );
        let along = -from.z / to.z;
        (along > 0.0 && along < 100.0).then(|| from + to * along)
    }

    /// Describes some axes of a pose: `to band`, `pan 30 tilt -20`, `beam 12 field 18`.
    pub fn words(&self, show: &Show, pose: Pose, axes: &[HeadAxis]) -> String {
        let both = axes.contains(&HeadAxis::Pan) && axes.contains(&HeadAxis::Tilt);
        let point = self.point(show, pose).filter(|_| both);
        let mut words: Vec<String> = point
            .map(|(name, _)| format!("to {name}"))
            .into_iter()
            .collect();
        for axis in axes {
            let turns = matches!(axis, HeadAxis::Pan | HeadAxis::Tilt);
            if !(turns && point.is_some()) {
                words.push(format!("{} {}", axis.word(), number(pose.angle(*axis))));
            }
        }
        words.join(" ")
    }

    /// Describes a whole pose; the zoom only if it differs from the light's own.
    pub fn whole(&self, show: &Show, pose: Pose) -> String {
        let home = self.head.home;
        let is_own = |axis| (pose.angle(axis) - home.angle(axis)).abs() < SAME;
        let shown = |axis: &HeadAxis| match axis {
            HeadAxis::Pan | HeadAxis::Tilt => true,
            HeadAxis::Beam | HeadAxis::Field => !is_own(*axis),
        };
        let axes: Vec<HeadAxis> = HeadAxis::ALL.into_iter().filter(shown).collect();
        self.words(show, pose, &axes)
    }
}

/// Poses to which the moves of a part turn each head: its index, the axes moved, and the final
/// pose, with other axes at home.
pub fn turned(show: &Show, moves: &[Move]) -> Vec<(usize, Vec<HeadAxis>, Pose)> {
    let first = show.first_pose();
    let mut out: BTreeMap<usize, (Vec<HeadAxis>, [f64; 4])> = BTreeMap::new();
    let heads = heads(show);
    for one in moves {
        let Some(pose) = one.parameter.checked_sub(first) else {
            continue;
        };
        let (Some(moving), Some(axis)) = (heads.get(pose / 4), HeadAxis::ALL.get(pose % 4)) else {
            continue;
        };
        let (axes, values) = out
            .entry(pose / 4)
            .or_insert_with(|| (Vec::new(), moving.head.at_home()));
        axes.push(*axis);
        if let Some(slot) = values.get_mut(pose % 4) {
            *slot = one.motion.target();
        }
    }
    let pose = |(index, (axes, values)): (usize, (Vec<HeadAxis>, [f64; 4]))| {
        Some((index, axes, heads.get(index)?.head.pose(values)))
    };
    out.into_iter().filter_map(pose).collect()
}

/// Describes the aims of a part's moves: `mh1 to band`, or `heads to band` when all heads of a group
/// or of a bank (at least two) move alike.
pub fn aims(show: &Show, moves: &[Move]) -> Vec<String> {
    let heads = heads(show);
    let mut by_bank: BTreeMap<usize, Vec<(&str, String)>> = BTreeMap::new();
    for (index, axes, pose) in turned(show, moves) {
        if let Some(moving) = heads.get(index) {
            let words = moving.words(show, pose, &axes);
            let own = by_bank.entry(moving.bank).or_default();
            own.push((&moving.light.name, words));
        }
    }
    let mut out = Vec::new();
    for (bank, own) in by_bank {
        let all = heads.iter().filter(|moving| moving.bank == bank).count();
        let alike = own
            .windows(2)
            .all(|pair| matches!(pair, [a, b] if a.1 == b.1));
        let words = own.first().filter(|_| alike && own.len() == all);
        let words = words.map(|(_, words)| words.clone());
        let text = match (show.banks.get(bank), &words) {
            (Some(bank), Some(words)) if all > 1 => format!("{} {words}", bank.name),
            _ => {
                let each = own.iter().map(|(name, words)| format!("{name} {words}"));
                each.collect::<Vec<_>>().join(", ")
            }
        };
        out.push(Done {
            bank,
            statement: None,
            words,
            text,
        });
    }
    by_group(show, out)
}

/// Displacement between two positions in stage terms: `1.2 m further left`. Left is stage left.
/// `None` below 5 cm in every direction.
pub fn further(was: Vec3, is: Vec3) -> Option<String> {
    let by = is - was;
    let ways = [
        (by.x, "left", "right"),
        (by.y, "upstage", "downstage"),
        (by.z, "up", "down"),
    ];
    let far = |(by, more, less): (f64, &str, &str)| {
        let way = if by > 0.0 { more } else { less };
        let metres = number((10.0 * by.abs()).round() / 10.0);
        (by.abs() >= 0.05).then(|| format!("{metres} m further {way}"))
    };
    let words: Vec<String> = ways.into_iter().filter_map(far).collect();
    (!words.is_empty()).then(|| words.join(", "))
}
