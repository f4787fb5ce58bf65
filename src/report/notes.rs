//! Warnings about the store of pictures, in words.

use crate::pool::disk_cache::Note;

/// Trouble with the store of pictures.
pub fn of_store(note: &Note) -> String {
    match note {
        Note::Damaged {
            path,
            reason,
            pictures,
        } => {
            let others = match pictures {
                0 | 1 => String::new(),
                n => format!(" ({} more like it)", n - 1),
            };
            format!(
                "a stored picture is of no use and was dropped; what is needed is rendered again: \
                 {}: {reason}{others}",
                path.display()
            )
        }
        Note::Outdated { pictures, bytes } => {
            let megabytes = *bytes as f64 / 1e6;
            format!(
                "{pictures} stored pictures ({megabytes:.1} MB) were made by another version of \
                 the renderer and are not used; `pool drop unused` frees them"
            )
        }
        Note::Stopped { reason } => {
            format!("pictures are no longer stored, only kept until you leave: {reason}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::Warning;

    #[test]
    fn a_renderer_that_is_not_linear_is_warned_about_with_the_figures() {
        let warning = Warning::NotLinear {
            sum: 0.1 / 3.1,
            double: 0.1 / 4.1,
        };
        let warning = warning.to_string();
        assert!(
            warning.contains("3.23 %") && warning.contains("2.44 %"),
            "{warning}"
        );
    }

    #[test]
    fn the_store_tells_the_first_damage_and_how_many_more() {
        let damaged = |pictures| {
            of_store(&Note::Damaged {
                path: "p/1.exr".into(),
                reason: "cut off".to_owned(),
                pictures,
            })
        };
        assert!(damaged(1).ends_with("rendered again: p/1.exr: cut off"));
        assert!(damaged(3).ends_with("cut off (2 more like it)"));
        let outdated = of_store(&Note::Outdated {
            pictures: 2,
            bytes: 1_500_000,
        });
        assert!(outdated.starts_with("2 stored pictures (1.5 MB)"));
    }
}
