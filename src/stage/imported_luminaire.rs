//! Lights of the stage's file, with the show's changes.

use super::rig_error::RigError;
use super::{Lamp, LampShape};
use footlight_show::geometry::profile::Profile;
use footlight_show::model::{ImportedLuminaire, NodeId, Output, Spot};
use footlight_show::units::Rgb;

/// Beam and field angle of an omnidirectional light: even to within 2e-5 up to 179 degrees from the
/// axis, because the profile of spots falls off only near its end.
const EVERYWHERE: (f64, f64) = (359.8, 360.0);

/// The first light of this name, as a spot.
pub(super) fn spot(id: NodeId, hung: &ImportedLuminaire, lamps: &[Lamp]) -> Result<Spot, RigError> {
    let name = || hung.name.clone();
    let found = lamps.iter().find(|l| l.name == hung.name);
    let lamp = found.ok_or_else(|| RigError::NoLamp {
        id,
        name: name(),
        known: lamps.iter().map(|l| l.name.clone()).collect(),
    })?;
    let (beam, field) = match lamp.shape {
        LampShape::Point => EVERYWHERE,
        LampShape::Spot { beam, field } => (beam, field),
        LampShape::Distant => return Err(RigError::Distant { id, name: name() }),
    };
    let (beam, field) = (hung.beam.unwrap_or(beam), hung.field.unwrap_or(field));
    let no_spot = |reason: String| RigError::NoSpot {
        id,
        name: name(),
        reason,
    };
    let profile = Profile::new(beam, field).ok_or_else(|| {
        no_spot(format!(
            "its field ({field:.1} degrees) is not wider than its beam ({beam:.1})"
        ))
    })?;
    let position = hung.position.unwrap_or(lamp.position);
    let aim = hung.aim.unwrap_or(position + lamp.direction);
    if position == aim {
        return Err(no_spot("it hangs at the point it is aimed at".to_owned()));
    }
    let candela = match hung.output {
        Output::Own => lamp.peak,
        Output::Peak(candela) => candela,
        Output::Flux(lumens) => lumens / profile.flux(),
    };
    let colour = hung.white.unwrap_or(lamp.colour).filtered(hung.gel);
    if colour.scaled(candela) == Rgb::default() {
        return Err(no_spot("it is dark in the file".to_owned()));
    }
    Ok(Spot {
        position,
        aim,
        beam,
        field,
        intensity: colour.scaled(candela),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use footlight_show::geometry::vec3;

    fn lamp(name: &str, shape: LampShape) -> Lamp {
        Lamp {
            name: name.to_owned(),
            shape,
            position: vec3(1.0, 2.0, 3.0),
            direction: vec3(0.0, 0.0, -1.0),
            colour: Rgb([1.0, 0.5, 0.25]),
            peak: 800.0,
        }
    }

    fn hung(name: &str) -> ImportedLuminaire {
        ImportedLuminaire {
            name: name.to_owned(),
            position: None,
            aim: None,
            beam: None,
            field: None,
            white: None,
            gel: Rgb::WHITE,
            output: Output::Own,
        }
    }

    #[test]
    fn the_show_has_the_last_word() {
        let shape = LampShape::Spot {
            beam: 20.0,
            field: 30.0,
        };
        let lamps = [lamp("Key", shape), lamp("Sun", LampShape::Distant)];
        let id = NodeId(7);
        let own = spot(id, &hung("Key"), &lamps).unwrap();
        assert_eq!((own.beam, own.field), (20.0, 30.0));
        assert_eq!(own.aim, vec3(1.0, 2.0, 2.0));
        assert_eq!(own.intensity, Rgb([800.0, 400.0, 200.0]));
        let said = ImportedLuminaire {
            position: Some(vec3(0.0, 0.0, 5.0)),
            field: Some(50.0),
            white: Some(Rgb::WHITE),
            gel: Rgb([1.0, 1.0, 0.0]),
            output: Output::Peak(100.0),
            ..hung("Key")
        };
        let other = spot(id, &said, &lamps).unwrap();
        assert_eq!(
            (other.position, other.aim),
            (vec3(0.0, 0.0, 5.0), vec3(0.0, 0.0, 4.0))
        );
        assert_eq!(
            (other.field, other.intensity),
            (50.0, Rgb([100.0, 100.0, 0.0]))
        );
        assert!(matches!(
            spot(id, &hung("Kee"), &lamps),
            Err(RigError::NoLamp { .. })
        ));
        assert!(matches!(
            spot(id, &hung("Sun"), &lamps),
            Err(RigError::Distant { .. })
        ));
        let narrow = ImportedLuminaire {
            field: Some(10.0),
            ..hung("Key")
        };
        assert!(matches!(
            spot(id, &narrow, &lamps),
            Err(RigError::NoSpot { .. })
        ));
    }

    /// A point light is equal in every direction, and its flux is that of a sphere.
    #[test]
    fn a_point_shines_everywhere() {
        let bulb = spot(NodeId(0), &hung("Bulb"), &[lamp("Bulb", LampShape::Point)]).unwrap();
        let profile = Profile::new(bulb.beam, bulb.field).unwrap();
        for degrees in [0.0_f64, 45.0, 90.0, 150.0, 178.0, 179.0] {
            let share = profile.share(degrees.to_radians());
            assert!((share - 1.0).abs() < 1e-3, "{degrees}: {share}");
        }
        let sphere = 4.0 * std::f64::consts::PI;
        assert!(
            (profile.flux() / sphere - 1.0).abs() < 1e-3,
            "{}",
            profile.flux()
        );
    }
}
