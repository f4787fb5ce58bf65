//! Large cue sheets for measurements; equal parameters always give equal texts.

use std::fmt::Write as _;

#[path = "../../examples/studies/src/dice.rs"]
#[allow(dead_code, reason = "not all of it is wanted here")]
pub mod dice;

use dice::Dice;

/// Size of a show.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Banks, one light each.
    pub banks: usize,
    /// Cues.
    pub cues: usize,
    /// Banks that a cue moves; at most all.
    pub moved: usize,
}

/// A show of that size without a stage. Every cue fades `moved` banks with separate up and down
/// times; every third also has a slow part with a delay and an eased curve, every eighth a spline
/// that begins at its bank's level.
pub fn cue_sheet(size: Size) -> String {
    let mut dice = Dice::new(7);
    let mut text = "show \"Large\"\n".to_owned();
    for bank in 1..=size.banks {
        let x = 0.1 * bank as f64;
        let _ = writeln!(
            text,
            "light l{bank} spot at {x:.2}, -3, 5 aim {x:.2}, 0, 1 beam 20 field 30 900 cd"
        );
    }
    for bank in 1..=size.banks {
        let _ = writeln!(text, "bank b{bank} = l{bank} channel {bank}");
    }
    let mut levels = vec![0; size.banks];
    for number in 1..=size.cues {
        text.push_str(&cue(&mut dice, number, size, &mut levels));
    }
    text
}

/// One cue; `levels` are the banks' levels, before and after.
pub fn cue(dice: &mut Dice, number: usize, size: Size, levels: &mut [usize]) -> String {
    let moved = chosen(dice, size);
    let mut text = format!("cue {number} \"Change {number}\" {{\n");
    let [up, down] = [1, 2].map(|least| dice.whole(least * 10, 90) as f64 / 10.0);
    let _ = writeln!(text, "  up {up}  down {down}");
    let slow = if number.is_multiple_of(3) {
        moved.len() / 4
    } else {
        0
    };
    let spline = number.is_multiple_of(8) && moved.len() > slow;
    let (in_part, direct) = moved.split_at(slow);
    for (i, &bank) in direct.iter().enumerate() {
        let level = dice.whole(0, 100);
        if spline && i == 0 {
            let (from, between) = (levels[bank], dice.whole(0, 100));
            let _ = writeln!(
                text,
                "  b{} spline 0 {from}, 1.5 {between}, 6 {level}",
                bank + 1
            );
        } else {
            let _ = writeln!(text, "  b{} {level}", bank + 1);
        }
        levels[bank] = level;
    }
    if slow > 0 {
        let delay = dice.whole(0, 30) as f64 / 10.0;
        let _ = writeln!(text, "  part 2 {{ time 12  delay {delay}  curve ease");
        for &bank in in_part {
            levels[bank] = dice.whole(0, 100);
            let _ = writeln!(text, "    b{} {}", bank + 1, levels[bank]);
        }
        text.push_str("  }\n");
    }
    text.push_str("}\n");
    text
}

/// Different banks, in order.
fn chosen(dice: &mut Dice, size: Size) -> Vec<usize> {
    let mut all: Vec<usize> = (0..size.banks).collect();
    for i in 0..size.moved.min(size.banks) {
        let j = dice.whole(i, size.banks - 1);
        all.swap(i, j);
    }
    all.truncate(size.moved);
    all.sort_unstable();
    all
}
