//! Moving heads: their axes, ranges and poses.
//!
//! A head hangs by its base. The base is level and its front faces the house, so that at pan 0 the
//! yoke's axis runs across the stage. At pan 0 and tilt 0 the head points straight down. Tilt turns
//! the head about the yoke's axis: at pan 0 a positive tilt raises the beam upstage. Pan turns the
//! yoke about the vertical: a positive pan goes anticlockwise as seen from above, so that at tilt
//! 90 the head points upstage at pan 0, to stage right at pan 90, to the house at pan 180. These
//! are the axes of GDTF (DIN SPEC 15800). A standing head is a hanging one turned over about the
//! axis from the house upstage: it points straight up at tilt 0, a positive tilt still leans
//! upstage at pan 0, and a positive pan goes clockwise as seen from above.
//!
//! The pose (pan, tilt, beam angle, field angle) is four parameters of the show, each from 0 at the
//! low end of its range to 1 at the high end. A pose is linear in them.

use super::NodeId;
use super::light::{LightKind, Luminaire, Output};
use crate::geometry::mount::Mount;
use crate::geometry::profile::Profile;
use crate::geometry::{Vec3, vec3};

/// A parameter of a head.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum HeadAxis {
    /// Turn of the yoke about the vertical.
    Pan,
    /// Turn of the head about the yoke's axis.
    Tilt,
    /// Full angle at half the peak intensity.
    Beam,
    /// Full angle at a tenth of the peak intensity; for a projection, from bottom to top.
    Field,
}

impl HeadAxis {
    /// All axes, in the order of a head's parameters.
    pub const ALL: [HeadAxis; 4] = [
        HeadAxis::Pan,
        HeadAxis::Tilt,
        HeadAxis::Beam,
        HeadAxis::Field,
    ];

    /// The word of the language.
    pub fn word(self) -> &'static str {
        match self {
            HeadAxis::Pan => "pan",
            HeadAxis::Tilt => "tilt",
            HeadAxis::Beam => "beam",
            HeadAxis::Field => "field",
        }
    }
}

/// Pose of a head, in degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Turn of the yoke.
    pub pan: f64,
    /// Turn of the head in the yoke.
    pub tilt: f64,
    /// Full angle at half the peak intensity.
    pub beam: f64,
    /// Full angle at a tenth of the peak intensity; for a projection, from bottom to top.
    pub field: f64,
}

impl Pose {
    /// The angle of an axis.
    pub fn angle(&self, axis: HeadAxis) -> f64 {
        match axis {
            HeadAxis::Pan => self.pan,
            HeadAxis::Tilt => self.tilt,
            HeadAxis::Beam => self.beam,
            HeadAxis::Field => self.field,
        }
    }
}

/// The moving part of a luminaire: ranges in degrees, each with its low end first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// The declared pose, which a head has until a cue moves it.
    pub home: Pose,
    /// Range of pan.
    pub pan: [f64; 2],
    /// Range of tilt.
    pub tilt: [f64; 2],
    /// Range of the beam and field angles.
    pub zoom: [f64; 2],
    /// Fastest turn of either axis, degrees a second.
    pub speed: f64,
    /// True when the base is below.
    pub standing: bool,
}

/// Tolerance of ranges, degrees: smaller excesses are rounding.
const ROUNDING: f64 = 1e-9;

impl Head {
    /// Range of an axis.
    pub fn range(&self, axis: HeadAxis) -> [f64; 2] {
        match axis {
            HeadAxis::Pan => self.pan,
            HeadAxis::Tilt => self.tilt,
            HeadAxis::Beam | HeadAxis::Field => self.zoom,
        }
    }

    /// The parameter of an axis at an angle: 0 at the low end of the range, 1 at the high end.
    pub fn parameter(&self, axis: HeadAxis, degrees: f64) -> f64 {
        let [low, high] = self.range(axis);
        (degrees - low) / (high - low)
    }

    /// The angle of an axis at a parameter.
    pub fn degrees(&self, axis: HeadAxis, parameter: f64) -> f64 {
        let [low, high] = self.range(axis);
        (1.0 - parameter) * low + parameter * high
    }

    /// The pose at the four parameters in the order of [`HeadAxis::ALL`].
    pub fn pose(&self, parameters: [f64; 4]) -> Pose {
        let [pan, tilt, beam, field] = parameters;
        Pose {
            pan: self.degrees(HeadAxis::Pan, pan),
            tilt: self.degrees(HeadAxis::Tilt, tilt),
            beam: self.degrees(HeadAxis::Beam, beam),
            field: self.degrees(HeadAxis::Field, field),
        }
    }

    /// The parameters of the home pose, in the order of [`HeadAxis::ALL`].
    pub fn at_home(&self) -> [f64; 4] {
        HeadAxis::ALL.map(|axis| self.parameter(axis, self.home.angle(axis)))
    }

    /// Converts a direction or axis between a hanging head and this one; its own inverse.
    fn turned_over(&self, v: Vec3) -> Vec3 {
        if self.standing {
            vec3(-v.x, v.y, -v.z)
        } else {
            v
        }
    }

    /// Unit vector along the beam at `pan` and `tilt` degrees.
    pub fn direction(&self, pan: f64, tilt: f64) -> Vec3 {
        let (sin_pan, cos_pan) = pan.to_radians().sin_cos();
        let (sin_tilt, cos_tilt) = tilt.to_radians().sin_cos();
        self.turned_over(vec3(-sin_pan * sin_tilt, cos_pan * sin_tilt, -cos_tilt))
    }

    /// The two solutions that point from `at` to `target`, as pan and tilt in degrees: pan within
    /// 180 of 0 with a positive tilt, and the head turned over with a negative tilt. `None` when
    /// the points coincide.
    pub fn angles(&self, at: Vec3, target: Vec3) -> Option<[(f64, f64); 2]> {
        let to = self.turned_over((target - at).normalized());
        if to == Vec3::ZERO || !to.is_finite() {
            return None;
        }
        let across = to.x.hypot(to.y);
        let tilt = across.atan2(-to.z).to_degrees();
        let pan = if across > 0.0 {
            (-to.x).atan2(to.y).to_degrees()
        } else {
            0.0
        };
        let over = if pan > 0.0 { pan - 180.0 } else { pan + 180.0 };
        Some([(pan, tilt), (over, -tilt)])
    }

    /// Pan and tilt that point from `at` to `target` and are reached soonest from `from`. Of all
    /// solutions within the ranges, whole turns of pan included, this is the one whose larger turn
    /// is least; among equals, the one with the least sum of turns. A head that points along its
    /// pan axis keeps its pan.
    ///
    /// # Errors
    /// The pan and tilt nearest to the ranges, when none is within them.
    pub fn aim(&self, at: Vec3, target: Vec3, from: (f64, f64)) -> Result<(f64, f64), (f64, f64)> {
        let mut best: Option<([f64; 2], (f64, f64))> = None;
        let mut outside: Option<(f64, (f64, f64))> = None;
        for (pan, tilt) in self.angles(at, target).into_iter().flatten() {
            let (on_axis, [low, high]) = (tilt.to_radians().sin().abs() < 1e-12, self.pan);
            let first = ((low - pan) / 360.0 - ROUNDING).ceil();
            let last = ((high - pan) / 360.0 + ROUNDING).floor();
            let turns = (first as i64..=last as i64).map(|turn| pan + 360.0 * turn as f64);
            let on_axis = on_axis.then_some(from.0);
            let mut ways: Vec<f64> = on_axis.into_iter().chain(turns).collect();
            if ways.is_empty() {
                ways.push(pan);
            }
            for pan in ways {
                let beyond = |x: f64, [low, high]: [f64; 2]| (low - x).max(x - high).max(0.0);
                let off = beyond(pan, self.pan).max(beyond(tilt, self.tilt));
                let way = (
                    pan.clamp(self.pan[0], self.pan[1]),
                    tilt.clamp(self.tilt[0], self.tilt[1]),
                );
                let (pans, tilts) = ((pan - from.0).abs(), (tilt - from.1).abs());
                let turn = [(pans.max(tilts) / ROUNDING).round(), pans + tilts];
                if off > ROUNDING {
                    if outside.is_none_or(|(least, _)| off < least) {
                        outside = Some((off, (pan, tilt)));
                    }
                } else if best.is_none_or(|(least, _)| turn < least) {
                    best = Some((turn, way));
                }
            }
        }
        match (best, outside) {
            (Some((_, way)), _) => Ok(way),
            (None, outside) => Err(outside.map_or(from, |(_, way)| way)),
        }
    }

    /// Turn of a projection's image about its axis in a pose, degrees, from upright: the image
    /// turns with the yoke.
    fn roll(&self, pose: Pose) -> f64 {
        let (sine, cosine) = pose.pan.to_radians().sin_cos();
        let across = self.turned_over(vec3(cosine, sine, 0.0));
        let upright = Mount {
            position: Vec3::ZERO,
            aim: self.direction(pose.pan, pose.tilt),
            turn: 0.0,
        };
        upright.axes().map_or(0.0, |axes| {
            let roll = across.dot(axes.up).atan2(across.dot(axes.right));
            roll.to_degrees()
        })
    }

    /// Returns `light`, whose head this is, as a fixed light in `pose`. The zoom keeps the flux: a
    /// narrower beam is brighter. An image turns with the yoke; at home it is as declared.
    pub fn aimed(&self, light: &Luminaire, pose: Pose) -> Luminaire {
        let mut fixed = Luminaire {
            head: None,
            ..light.clone()
        };
        let direction = self.direction(pose.pan, pose.tilt);
        let along = |position: Vec3, aim: Vec3| position + direction * (aim - position).length();
        match &mut fixed.kind {
            LightKind::Spot(spot) => {
                spot.aim = along(spot.position, spot.aim);
                let off = (spot.beam - pose.beam).abs() + (spot.field - pose.field).abs();
                if off > ROUNDING {
                    let flux = |beam, field| Profile::new(beam, field).map_or(1.0, |p| p.flux());
                    let share = flux(spot.beam, spot.field) / flux(pose.beam, pose.field);
                    spot.intensity = spot.intensity.scaled(share);
                    (spot.beam, spot.field) = (pose.beam, pose.field);
                }
            }
            LightKind::Projection {
                mount,
                field,
                output,
                ..
            } => {
                mount.aim = along(mount.position, mount.aim);
                mount.turn += self.roll(pose) - self.roll(self.home);
                let size = |field: f64| (0.5 * field).to_radians().tan();
                if let Output::Peak(candela) = output {
                    *candela *= (size(*field) / size(pose.field)).powi(2);
                }
                *field = pose.field;
            }
            _ => {}
        }
        fixed
    }
}

/// A point where heads can aim.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The statement.
    pub id: NodeId,
    /// Its name, or its coordinates if it has none.
    pub name: String,
    /// Its position, metres.
    pub at: Vec3,
}

impl Point {
    /// False for a place that a cue writes.
    pub fn is_named(&self) -> bool {
        !self.name.contains(',')
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::model::{NodeId, Output, Spot};
    use crate::units::Rgb;

    fn head(standing: bool) -> Head {
        let home = Pose {
            pan: 0.0,
            tilt: -30.0,
            beam: 10.0,
            field: 16.0,
        };
        Head {
            home,
            pan: [-270.0, 270.0],
            tilt: [-135.0, 135.0],
            zoom: [4.0, 60.0],
            speed: 180.0,
            standing,
        }
    }

    fn close(a: Vec3, b: Vec3, within: f64) -> bool {
        (a - b).length() < within
    }

    #[test]
    fn the_axes_are_as_documented() {
        let hung = head(false);
        for (pan, tilt, to) in [
            (0.0, 0.0, vec3(0.0, 0.0, -1.0)),
            (77.0, 0.0, vec3(0.0, 0.0, -1.0)),
            (0.0, 90.0, vec3(0.0, 1.0, 0.0)),
            (0.0, -90.0, vec3(0.0, -1.0, 0.0)),
            (90.0, 90.0, vec3(-1.0, 0.0, 0.0)),
            (180.0, 90.0, vec3(0.0, -1.0, 0.0)),
            (90.0, -90.0, vec3(1.0, 0.0, 0.0)),
        ] {
            assert!(close(hung.direction(pan, tilt), to, 1e-15), "{pan} {tilt}");
        }
        let stands = head(true);
        for (pan, tilt, to) in [
            (0.0, 0.0, vec3(0.0, 0.0, 1.0)),
            (0.0, 90.0, vec3(0.0, 1.0, 0.0)),
            (90.0, 90.0, vec3(1.0, 0.0, 0.0)),
        ] {
            assert!(
                close(stands.direction(pan, tilt), to, 1e-15),
                "{pan} {tilt}"
            );
        }
    }

    #[test]
    fn angles_are_the_inverse_of_the_direction() {
        let at = vec3(1.0, -2.0, 5.0);
        for standing in [false, true] {
            let head = head(standing);
            for i in 0..1000 {
                let (pan, tilt) = (-179.9 + 0.359 * f64::from(i), 0.5 + 0.174 * f64::from(i));
                let to = head.direction(pan, tilt);
                let ways = head.angles(at, at + to * 7.3).unwrap();
                let [(p, t), (over, turned)] = ways;
                // The pan is less precise where the sine of the tilt is small.
                let within = 1e-12 / tilt.to_radians().sin();
                assert!(
                    (p - pan).abs() < within.max(1e-12) * 60.0,
                    "{p} {pan} {tilt}"
                );
                assert!((t - tilt).abs() < 1e-11, "{t} {tilt}");
                for (pan, tilt) in [(p, t), (over, turned)] {
                    assert!(close(head.direction(pan, tilt), to, 1e-12));
                }
            }
        }
    }

    #[test]
    fn a_head_takes_the_soonest_way() {
        let head = head(false);
        let at = vec3(0.0, 0.0, 5.0);
        let aim = |pan: f64, tilt: f64, from| {
            let way = head.aim(at, at + head.direction(pan, tilt), from);
            way.map(|(pan, tilt)| (pan.round(), tilt.round()))
        };
        // From the band to the house over the stage, not around it.
        assert_eq!(aim(180.0, 40.0, (0.0, 50.0)), Ok((0.0, -40.0)));
        assert_eq!(aim(100.0, 50.0, (0.0, 50.0)), Ok((100.0, 50.0)));
        // On round the back, until the range ends.
        assert_eq!(aim(-160.0, 50.0, (170.0, 50.0)), Ok((200.0, 50.0)));
        assert_eq!(aim(-80.0, 50.0, (260.0, 50.0)), Ok((100.0, -50.0)));
        // Straight down has no pan.
        assert_eq!(aim(0.0, 0.0, (123.0, 50.0)), Ok((123.0, 0.0)));
        let (pan, tilt) = aim(20.0, 150.0, (0.0, 0.0)).unwrap_err();
        assert!((pan - 20.0).abs() + (tilt - 150.0).abs() < 1e-9);
    }

    fn light(kind: LightKind, head: Head) -> Luminaire {
        Luminaire {
            id: NodeId(0),
            name: "mh".to_owned(),
            kind,
            form: "spot".to_owned(),
            colour: String::new(),
            gel: None,
            head: Some(head),
        }
    }

    #[test]
    fn a_zoom_keeps_the_flux_and_home_is_as_declared() {
        let head = head(false);
        let position = vec3(1.0, 2.0, 6.0);
        let spot = Spot {
            position,
            aim: position + head.direction(head.home.pan, head.home.tilt) * 4.0,
            beam: 10.0,
            field: 16.0,
            intensity: Rgb([1000.0, 900.0, 800.0]),
        };
        let light = light(LightKind::Spot(spot.clone()), head);
        let at = |pose| match head.aimed(&light, pose).kind {
            LightKind::Spot(spot) => spot,
            _ => unreachable!(),
        };
        let (back, home) = (head.pose(head.at_home()), head.home);
        for axis in HeadAxis::ALL {
            assert!((back.angle(axis) - home.angle(axis)).abs() < 1e-13);
        }
        let home = at(head.home);
        assert!(close(home.aim, spot.aim, 1e-14) && home.intensity == spot.intensity);
        let narrow = at(Pose {
            pan: 30.0,
            beam: 5.0,
            field: 8.0,
            ..head.home
        });
        let lumens = |spot: &Spot| {
            let profile = Profile::new(spot.beam, spot.field).unwrap();
            spot.intensity.0[0] * profile.flux()
        };
        assert!((lumens(&narrow) / lumens(&spot) - 1.0).abs() < 1e-12);
        let along = (narrow.aim - position).normalized();
        assert!(close(along, head.direction(30.0, -30.0), 1e-15));
    }

    #[test]
    fn an_image_turns_with_the_yoke() {
        let head = head(false);
        let position = Vec3::ZERO;
        let mount = Mount {
            position,
            aim: head.direction(head.home.pan, head.home.tilt),
            turn: 25.0,
        };
        let kind = LightKind::Projection {
            path: String::new(),
            mount,
            field: 16.0,
            tint: Rgb::WHITE,
            output: Output::Peak(100.0),
        };
        let light = light(kind, head);
        let right = |pan, tilt| {
            let pose = Pose {
                pan,
                tilt,
                ..head.home
            };
            match head.aimed(&light, pose).kind {
                LightKind::Projection { mount, .. } => mount.axes().unwrap().right,
                _ => unreachable!(),
            }
        };
        assert!(close(right(0.0, -30.0), mount.axes().unwrap().right, 1e-12));
        // Through straight down without a jump, and all the way round with the yoke.
        for pan in [0.0, 50.0, 200.0] {
            for tilt in [-1e-6, 0.0, 1e-6] {
                let down = right(pan, 0.0);
                assert!(close(right(pan, tilt), down, 1e-7), "{pan} {tilt}");
                let (sine, cosine) = f64::to_radians(pan).sin_cos();
                let first = right(0.0, 0.0);
                let turned = vec3(
                    cosine * first.x - sine * first.y,
                    sine * first.x + cosine * first.y,
                    0.0,
                );
                assert!(close(down, turned, 1e-12));
            }
        }
    }
}
