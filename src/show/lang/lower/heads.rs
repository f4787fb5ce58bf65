//! Moving heads: which lights are heads, and where cues point them.

use std::collections::{BTreeMap, BTreeSet};

use super::Lower;
use crate::diagnostic::Diagnostic;
use crate::geometry::Vec3;
use crate::lang::ast::{
    self, Clause, Declaration, Motion as Written, Span, Statement, Target, Word,
};
use crate::lang::codes;
use crate::lang::names::Kind;
use crate::lang::quantity::Wanted;
use crate::lang::report::Place;
use crate::model::{Cue, Head, HeadAxis, LightKind, Motion, NodeId, Point, Pose};

/// The clauses of a light's declaration that describe a head.
pub const CLAUSES: [&str; 6] = ["moves", "pan", "tilt", "zoom", "speed", "standing"];

/// Largest angle of pan and tilt, degrees.
const MOST: f64 = 1080.0;

/// Most aims whose places get a name, because sheets compare every pose with every place.
const MOST_PLACES: usize = 10_000;

/// The head clauses of a light.
#[derive(Clone, Default)]
pub struct Ranges {
    pan: Option<[f64; 2]>,
    tilt: Option<[f64; 2]>,
    zoom: Option<[f64; 2]>,
    speed: Option<f64>,
    standing: bool,
}

/// A head in a bank.
#[derive(Clone)]
pub struct InBank {
    light: usize,
    head: Head,
    bank: usize,
}

/// Aims of moves, by move and head; their pan follows from the cues before.
pub type Aims = BTreeMap<(NodeId, usize), (Vec3, Span)>;

impl<'a> Lower<'a, '_> {
    /// Lowers the points.
    pub fn points(&mut self, statements: &[Statement<'a>]) {
        for statement in statements {
            if let Declaration::Point { name, at } = &statement.item {
                let id = self.node(statement.span);
                let at = self.position(at).unwrap_or_default();
                let name = name.text.to_owned();
                self.show.points.push(Point { id, name, at });
            }
        }
    }

    /// Adds the places without a name at which cues aim heads, so that sheets can name them.
    fn written_places(&mut self) {
        let bits = |at: Vec3| [at.x, at.y, at.z].map(f64::to_bits);
        let mut known: BTreeSet<_> = self.show.points.iter().map(|p| bits(p.at)).collect();
        for ((id, _), (at, _)) in self.aims.iter().take(MOST_PLACES) {
            if known.insert(bits(*at)) {
                let (id, at) = (*id, *at);
                let name = format!("{}, {}, {}", at.x, at.y, at.z);
                self.show.points.push(Point { id, name, at });
            }
        }
    }

    // ---- declarations ---------------------------------------------------------------------------

    /// A clause of [`CLAUSES`].
    pub fn head_clause(&mut self, clause: &Clause<'a>, head: &mut Option<Ranges>) -> Option<()> {
        let word = clause.word.text;
        if word == "moves" {
            head.get_or_insert_default();
            return Some(());
        }
        let Some(ranges) = head else {
            let message = format!("`{word}` is said of a light that moves");
            let help = format!("put `moves` before it: `moves  {word} …`");
            let at = (clause.span, "does not move");
            return self.report.error(codes::DOES_NOT_FIT, message, at, help);
        };
        self.range_clause(clause, ranges)
    }

    fn range_clause(&mut self, clause: &Clause<'a>, ranges: &mut Ranges) -> Option<()> {
        let first = clause.values.first().copied();
        match clause.word.text {
            "standing" => ranges.standing = true,
            "speed" => {
                let range = "a head turns 1 to 1000 degrees a second";
                ranges.speed = Some(self.within(first?, Wanted::Angle, (1.0, 1000.0), range)?);
            }
            "zoom" => {
                let range = "the angles of a beam are 0.1 to 179 degrees";
                ranges.zoom = Some(self.ends(clause, (0.1, 179.0), range)?);
            }
            axis => {
                let range = "the angles of a head are -1080 to 1080 degrees";
                let ends = Some(self.ends(clause, (-MOST, MOST), range)?);
                match axis {
                    "pan" => ranges.pan = ends,
                    _ => ranges.tilt = ends,
                }
            }
        }
        Some(())
    }

    /// The ends of a range, the lower first.
    fn ends(&mut self, clause: &Clause<'a>, within: (f64, f64), range: &str) -> Option<[f64; 2]> {
        let mut ends = [0.0; 2];
        for (end, word) in ends.iter_mut().zip(&clause.values) {
            *end = self.within(*word, Wanted::Angle, within, range)?;
        }
        let [low, high] = ends;
        if low < high {
            return Some(ends);
        }
        let message = format!("this range of `{}` ends where it begins", clause.word.text);
        let help = "the low end of a range stands first, as -270 to 270";
        let at = (clause.span, "empty");
        self.report.error(codes::RANGE, message, at, help)
    }

    /// The head of a light with `moves`.
    pub fn head(
        &mut self,
        light: &ast::Light<'a>,
        ranges: &Ranges,
        kind: &LightKind,
    ) -> Option<Head> {
        let (position, aim, beam, field) = match kind {
            LightKind::Spot(spot) => (spot.position, spot.aim, spot.beam, spot.field),
            LightKind::Projection { mount, field, .. } => {
                (mount.position, mount.aim, *field, *field)
            }
            _ => return None,
        };
        let zoom = ranges.zoom.unwrap_or([beam.min(4.0), field.max(60.0)]);
        let mut head = Head {
            home: Pose::default(),
            pan: ranges.pan.unwrap_or([-270.0, 270.0]),
            tilt: ranges.tilt.unwrap_or([-135.0, 135.0]),
            zoom,
            speed: ranges.speed.unwrap_or(180.0),
            standing: ranges.standing,
        };
        let name = light.name;
        for (word, angle) in [("beam", beam), ("field", field)] {
            if !(zoom[0]..=zoom[1]).contains(&angle) {
                let message = format!(
                    "the {word} of `{}` ({angle} degrees) is outside its zoom, {} to {}",
                    name.text, zoom[0], zoom[1]
                );
                let at = (name.span, "cannot be so");
                let help = "the zoom is the range of the beam and field angles";
                return self.report.error(codes::RANGE, message, at, help);
            }
        }
        let (pan, tilt) = self.way(&head, (position, aim), (name, (0.0, 0.0)))?;
        head.home = Pose {
            pan,
            tilt,
            beam,
            field,
        };
        Some(head)
    }

    /// Pan and tilt towards a point for the head called `name`, as it hangs or stands in `from`.
    fn way(
        &mut self,
        head: &Head,
        (position, target): (Vec3, Vec3),
        (name, from): (Word<'_>, (f64, f64)),
    ) -> Option<(f64, f64)> {
        let (pan, tilt) = match head.aim(position, target, from) {
            Ok(way) => return Some(way),
            Err(nearest) => nearest,
        };
        let Vec3 { x, y, z } = target;
        let mut message = format!("`{}` cannot point to {x}, {y}, {z}: ", name.text);
        let mut help = "aim it at another place, or give it a wider range where it is declared";
        let [low, high] = head.tilt;
        if position == target {
            message += "it hangs there";
            help = "aim it at another place";
        } else if !(low..=high).contains(&tilt) {
            message += &format!("its tilt would be {tilt:.1} degrees, and is {low} to {high}");
            if !head.standing && tilt.abs() > 90.0 {
                help = "a head that stands on the floor is declared with `moves  standing`";
            }
        } else {
            let [low, high] = head.pan;
            message += &format!("its pan would be {pan:.1} degrees, and is {low} to {high}");
        }
        let at = (name.span, "out of its reach");
        self.report.error(codes::OUT_OF_REACH, message, at, help)
    }

    /// Finds the heads in banks, and reports those that cannot move as they should.
    pub fn heads_in_banks(&mut self) {
        let of = |(light, head, bank): (usize, &Head, usize)| InBank {
            light,
            head: *head,
            bank,
        };
        self.heads = self.show.heads().into_iter().map(of).collect();
        self.first_pose = self.show.first_pose();
        let mut places: BTreeMap<usize, Vec<NodeId>> = BTreeMap::new();
        let banks = self.show.banks.iter().map(|b| (b.id, &b.lights, true));
        let fixed = self.show.fixed.iter().map(|f| (f.id, &f.lights, false));
        let mut found = Vec::new();
        for (id, lights, moves) in banks.chain(fixed) {
            for light in lights {
                let Some(own) = self.show.lights.get(*light).filter(|l| l.head.is_some()) else {
                    continue;
                };
                let earlier = places.entry(*light).or_default();
                let first = earlier.first().copied();
                earlier.push(id);
                if !moves || first.is_some() {
                    found.push((own.name.clone(), own.id, id, first));
                }
            }
        }
        for (name, own, id, first) in found {
            let (message, there, label, help) = match first {
                Some(first) => (
                    format!("the head `{name}` is in two banks"),
                    first,
                    "and here",
                    format!("a head stands in one bank: leave `{name}` out of one of the two"),
                ),
                None => (
                    format!("the head `{name}` is a fixed light: no cue can move it"),
                    own,
                    "declared here",
                    format!("leave `{name}` out here, and {}", self.bank_line(&name)),
                ),
            };
            self.report.add(
                Diagnostic::error(codes::HEAD_PLACE, message)
                    .place_of(id, &self.spans, "here")
                    .place_of(there, &self.spans, label)
                    .help(help),
            );
        }
    }

    /// A line that puts a head into a bank: one that has heads already, or a new one.
    fn bank_line(&self, name: &str) -> String {
        let heads = self
            .heads
            .iter()
            .find_map(|head| self.show.banks.get(head.bank));
        let lights = heads.iter().flat_map(|bank| &bank.lights);
        let names = lights.filter_map(|light| Some(self.show.lights.get(*light)?.name.as_str()));
        let names: Vec<&str> = names.chain([name]).collect();
        match heads {
            Some(bank) => format!(
                "add it to a bank: `bank {} = {}`",
                bank.name,
                names.join(" ")
            ),
            None => format!("give it a bank: `bank {name}_bank = {name}`"),
        }
    }

    // ---- cues -----------------------------------------------------------------------------------

    /// The heads that a move points, with their parameters and targets. [`Lower::aim_heads`] finds
    /// the pan of aims later.
    pub fn aims(&mut self, written: &ast::Move<'a>, id: NodeId) -> Vec<(usize, Motion)> {
        let (Some(aim), Some(target)) = (&written.aim, written.target) else {
            return Vec::new();
        };
        let at = match aim.at.as_slice() {
            [] => None,
            [name] => self
                .find(*name, &[Kind::Point], &[])
                .and_then(|(_, i)| self.show.points.get(i).map(|p| p.at)),
            lengths => self.position(lengths),
        };
        let angles = self.angles(aim, target.name.text);
        let heads = self.heads_of(target, matches!(written.motion, Written::Bare));
        if (at.is_none() && !aim.at.is_empty()) || !self.spend(4 * heads.len(), aim.span) {
            return Vec::new();
        }
        let mut out = Vec::new();
        for index in heads {
            let Some(InBank { head, light, .. }) = self.heads.get(index).cloned() else {
                continue;
            };
            let first = self.first_pose + 4 * index;
            if let Some(at) = at {
                self.aims.insert((id, index), (at, aim.span));
                out.extend(
                    [HeadAxis::Pan, HeadAxis::Tilt].map(|a| (first + a as usize, Motion::To(0.0))),
                );
            }
            for (axis, angle, span) in &angles {
                let kind = self.show.lights.get(light).map(|l| &l.kind);
                let thrown = matches!(kind, Some(LightKind::Projection { .. }));
                match self.turned(&head, light, (*axis, *angle), (*span, thrown)) {
                    Some(to) => out.push((first + *axis as usize, Motion::To(to))),
                    None => return out,
                }
            }
        }
        out
    }

    /// Angles by axis, each once.
    fn angles(&mut self, aim: &ast::Aim<'a>, target: &str) -> Vec<(HeadAxis, f64, Span)> {
        let mut out: Vec<(HeadAxis, f64, Span)> = Vec::new();
        for (word, value) in &aim.angles {
            let Some(axis) = HeadAxis::ALL.into_iter().find(|a| a.word() == word.text) else {
                continue;
            };
            if let Some((.., earlier)) = out.iter().find(|(a, ..)| *a == axis) {
                self.once(&mut Some(*earlier), word.text, word.span);
                continue;
            }
            if matches!(axis, HeadAxis::Pan | HeadAxis::Tilt) && !aim.at.is_empty() {
                let message = format!("`{}` stands behind a place to point to", word.text);
                let help = format!(
                    "a head points to a place, or by its angles: `{target} pan 30 tilt -20`"
                );
                let at = (word.span, "one too many");
                self.report
                    .error::<()>(codes::DOES_NOT_FIT, message, at, help);
                continue;
            }
            let range = "the angles of a head are -1080 to 1080 degrees";
            if let Some(angle) = self.within(*value, Wanted::Angle, (-MOST, MOST), range) {
                out.push((axis, angle, value.span));
            }
        }
        out
    }

    /// The parameter of an axis at an angle, which must be in its range.
    fn turned(
        &mut self,
        head: &Head,
        light: usize,
        (axis, angle): (HeadAxis, f64),
        (span, thrown): (Span, bool),
    ) -> Option<f64> {
        let name = self.show.lights.get(light).map_or("", |l| l.name.as_str());
        let (word, [low, high]) = (axis.word(), head.range(axis));
        let (code, message, label, help) = if thrown && axis == HeadAxis::Beam {
            let message = format!("`{name}` is a projection: it has no beam");
            let help = "the size of its image is its `field`";
            (codes::DOES_NOT_FIT, message, "not here", help)
        } else if !(low..=high).contains(&angle) {
            let message =
                format!("`{name}` has no {word} of {angle} degrees: it is {low} to {high}");
            let help = "its declaration gives the range, behind `moves`";
            (codes::RANGE, message, "out of range", help)
        } else {
            return Some(head.parameter(axis, angle));
        };
        self.report.error(code, message, (span, label), help)
    }

    /// The heads of a light, a bank or a group; reports a target without heads.
    fn heads_of(&mut self, target: Target<'a>, alone: bool) -> Vec<usize> {
        let kinds = [Kind::Light, Kind::Bank, Kind::Group];
        let known = self.names.get(target.name.text).map(|e| e.kind);
        // A faulty target that also has a level is reported for the level.
        if !alone && known.is_none_or(|kind| !kinds.contains(&kind) || kind == Kind::Light) {
            return Vec::new();
        }
        let Some((kind, index)) = self.find(target.name, &kinds, &[]) else {
            return Vec::new();
        };
        let banks = match kind {
            Kind::Group => self.show.groups.get(index).map_or(&[][..], |g| &g.banks),
            _ => &[],
        };
        let own = |head: &InBank| match kind {
            Kind::Light => head.light == index,
            Kind::Bank => head.bank == index,
            _ => banks.contains(&head.bank),
        };
        let heads = self.heads.iter().enumerate();
        let found: Vec<usize> = heads.filter(|(_, h)| own(h)).map(|(i, _)| i).collect();
        let name = target.name.text;
        if let (Some(channel), false) = (target.channel, found.is_empty()) {
            let message = format!(
                "`{name}.{}` is an emitter: a whole bank moves",
                channel.text
            );
            let at = (channel.span, "not here");
            let help = format!("write `{name} to …`");
            self.report
                .error::<()>(codes::DOES_NOT_FIT, message, at, help);
            return Vec::new();
        }
        // A light with an error, already reported, has no head.
        let is_broken = |light: &usize| {
            let kind = self.show.lights.get(*light).map(|l| &l.kind);
            matches!(kind, Some(LightKind::Panel { material, .. }) if material.is_empty())
        };
        let broken = match kind {
            Kind::Light => is_broken(&index),
            _ => self
                .show
                .lights
                .iter()
                .enumerate()
                .any(|(i, _)| is_broken(&i)),
        };
        if found.is_empty() && !broken {
            let light = self.show.lights.get(index).filter(|_| kind == Kind::Light);
            let (message, help) = match light {
                Some(light) if light.head.is_some() => (
                    format!("the head `{name}` is in no bank"),
                    self.bank_line(name),
                ),
                Some(_) => (
                    format!("the light `{name}` does not move"),
                    "write `moves` at the end of its declaration".to_owned(),
                ),
                None => (
                    format!("no light of `{name}` moves"),
                    "write `moves` at the end of a light's declaration".to_owned(),
                ),
            };
            let at = (target.span, "nothing moves here");
            self.report.error::<()>(codes::NO_HEAD, message, at, help);
        }
        found
    }

    /// Finds the pan and tilt of every aim, cue by cue: the solution reached soonest from where the
    /// head points before.
    pub fn aim_heads(&mut self) {
        let home = |h: &InBank| (h.head.home.pan, h.head.home.tilt);
        let mut now: Vec<(f64, f64)> = self.heads.iter().map(home).collect();
        let mut lasting = now.clone();
        let mut back: BTreeSet<usize> = BTreeSet::new();
        let mut beyond: Vec<(usize, Vec3)> = Vec::new();
        let mut cues = std::mem::take(&mut self.show.cues);
        for cue in &mut cues {
            let to = self.aimed(cue, &now, &mut beyond);
            for head in std::mem::take(&mut back) {
                if let (false, Some(now), Some(lasting)) =
                    (to.contains_key(&head), now.get_mut(head), lasting.get(head))
                {
                    *now = *lasting;
                }
            }
            for (head, way) in to {
                if let (Some(now), Some(lasting)) = (now.get_mut(head), lasting.get_mut(head)) {
                    *now = way;
                    if cue.cueonly {
                        back.insert(head);
                    } else {
                        *lasting = way;
                    }
                }
            }
        }
        self.show.cues = cues;
        self.written_places();
    }

    /// Sets the aims of a cue: pan and tilt of each head that it turns, once complete. A point out
    /// of a head's reach is reported once and recorded in `beyond`.
    fn aimed(
        &mut self,
        cue: &mut Cue,
        now: &[(f64, f64)],
        beyond: &mut Vec<(usize, Vec3)>,
    ) -> BTreeMap<usize, (f64, f64)> {
        let mut ways: BTreeMap<(NodeId, usize), (f64, f64)> = BTreeMap::new();
        let mut to: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for one in cue.parts.iter_mut().flat_map(|part| &mut part.moves) {
            let Some(pose) = one.parameter.checked_sub(self.first_pose) else {
                continue;
            };
            let index = pose / 4;
            let axis = HeadAxis::ALL.get(pose % 4).copied();
            let Some(axis @ (HeadAxis::Pan | HeadAxis::Tilt)) = axis else {
                continue;
            };
            let (Some(from), Some(InBank { head, light, .. })) =
                (now.get(index).copied(), self.heads.get(index).cloned())
            else {
                continue;
            };
            let aim = (one.id, index);
            if let Some((at, span)) = self.aims.get(&aim).copied() {
                let is_beyond = beyond.contains(&(index, at)).then_some(from);
                let way = ways.get(&aim).copied().or(is_beyond);
                let way = way.unwrap_or_else(|| {
                    let light = self.show.lights.get(light);
                    let place = light.and_then(|l| l.kind.place()).unwrap_or_default();
                    let name = light.map_or(String::new(), |l| l.name.clone());
                    let word = Word { text: &name, span };
                    let way = self.way(&head, (place, at), (word, from));
                    way.unwrap_or_else(|| {
                        beyond.push((index, at));
                        from
                    })
                });
                ways.insert(aim, way);
                let angle = if axis == HeadAxis::Pan { way.0 } else { way.1 };
                one.motion = Motion::To(head.parameter(axis, angle));
            }
            let angle = head.degrees(axis, one.motion.target());
            let (pan, tilt) = to.entry(index).or_insert(from);
            *(if axis == HeadAxis::Pan { pan } else { tilt }) = angle;
        }
        to
    }

    /// Splits `written` where one of its angles is the name of a bank, a group or a look: that name
    /// begins a second move, which takes the timing.
    pub fn told_apart(&self, written: &ast::Move<'a>) -> Option<[ast::Move<'a>; 2]> {
        let aim = written.aim.as_ref()?;
        let moved = |word: &Word<'_>| {
            let kind = self.names.get(word.text).map(|e| e.kind);
            matches!(kind, Some(Kind::Bank | Kind::Group | Kind::Look))
        };
        let at = aim.angles.iter().position(|(word, _)| moved(word))?;
        let (before, rest) = aim.angles.split_at(at);
        let (word, value) = *rest.first()?;
        let until = Span {
            end: word.span.start,
            ..written.span
        };
        let from = Span {
            start: word.span.start,
            ..written.span
        };
        let part = |at: &[Word<'a>], angles: &[_], span| ast::Aim {
            at: at.to_vec(),
            angles: angles.to_vec(),
            span,
        };
        let first = ast::Move {
            aim: (at > 0 || !aim.at.is_empty()).then(|| part(&aim.at, before, until)),
            effect: None,
            timing: Vec::new(),
            span: until,
            ..written.clone()
        };
        let target = Target {
            name: word,
            channel: None,
            span: word.span,
        };
        let after = rest.get(1..).unwrap_or_default();
        let second = ast::Move {
            target: Some(target),
            motion: Written::To(value, None),
            aim: (!after.is_empty()).then(|| part(&[], after, from)),
            span: from,
            beside: None,
            ..written.clone()
        };
        Some([first, second])
    }
}
