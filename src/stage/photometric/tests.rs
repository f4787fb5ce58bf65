#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use super::*;

/// A file of type C: head, angles, and intensities by a function of the angles in degrees.
fn file(vertical: &[f64], horizontal: &[f64], candela: impl Fn(f64, f64) -> f64) -> String {
    let row = |numbers: &[f64]| {
        let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
        words.join(" ")
    };
    let mut out = format!(
        "IESNA:LM-63-2002\n[TEST] own\n[MANUFAC] nobody\nTILT=NONE\n1 1000 1 {} {} 1 2 0 0 0\n1 1 50\n{}\n{}\n",
        vertical.len(),
        horizontal.len(),
        row(vertical),
        row(horizontal)
    );
    for h in horizontal {
        let values: Vec<f64> = vertical.iter().map(|v| candela(*v, *h)).collect();
        out += &format!("{}\n", row(&values));
    }
    out
}

fn steps(from: f64, to: f64, count: usize) -> Vec<f64> {
    let at = |i: usize| from + (to - from) * i as f64 / (count - 1) as f64;
    (0..count).map(at).collect()
}

fn parsed(text: &str) -> Distribution {
    Distribution::parse(text.as_bytes()).unwrap()
}

#[test]
fn candela_in_ten_directions_of_planes_that_stop_short_of_360() {
    // Bilinear in the angles, so that interpolation is exact within a cell; periodic in steps
    // of 15.
    let shape = |v: f64, h: f64| 2000.0 - 20.0 * v + 0.5 * v * f64::min(h, 360.0 - h);
    let d = parsed(&file(&steps(0.0, 90.0, 19), &steps(0.0, 345.0, 24), shape));
    for (v, h) in [
        (0.0, 0.0),
        (5.0, 15.0),
        (12.5, 7.5),
        (33.0, 171.0),
        (40.0, 180.0),
        (41.0, 199.5),
        (60.0, 270.0),
        (62.5, 345.0),
        (77.0, 352.5),
        (89.0, 359.9),
    ] {
        let found = d.intensity(f64::to_radians(v), f64::to_radians(h));
        let wanted = shape(v, h);
        assert!(
            (found / wanted - 1.0).abs() < 1e-12,
            "{v} {h}: {found} {wanted}"
        );
    }
}

#[test]
fn flux_of_known_distributions() {
    // A Lambertian disc of 1000 cd has 1000 pi lm. Linear interpolation in steps of 5 degrees loses
    // (5 degrees)^2 / 12 of the cosine: 6.3e-4.
    let cosine = |v: f64, _| 1000.0 * v.to_radians().cos().max(0.0);
    let lambert = parsed(&file(&steps(0.0, 90.0, 19), &[0.0], cosine));
    let loss = 1.0 - lambert.flux() / (1000.0 * PI);
    assert!((4e-4..7e-4).contains(&loss), "{loss}");
    // Equal all around: 4 pi, exact, for every symmetry.
    for last in [90.0, 180.0, 360.0] {
        let round = parsed(&file(
            &steps(0.0, 180.0, 5),
            &steps(0.0, last, 4),
            |_, _| 80.0,
        ));
        assert!((round.flux() / (320.0 * PI) - 1.0).abs() < 1e-12);
    }
    // 1 + cos 2h times a downward cosine: the second harmonic adds no flux.
    let wavy = |v: f64, h: f64| cosine(v, h) * (1.0 + (2.0 * h).to_radians().cos());
    let wavy = parsed(&file(&steps(0.0, 90.0, 91), &steps(0.0, 90.0, 10), wavy));
    assert!((wavy.flux() / (1000.0 * PI) - 1.0).abs() < 1e-4);
}

#[test]
fn flux_is_the_integral_of_what_is_interpolated() {
    let shape = |v: f64, h: f64| 100.0 + v + 0.3 * h + (v * h).sin().abs() * 50.0;
    for (from, to, count) in [
        (0.0, 360.0, 7),
        (0.0, 180.0, 5),
        (0.0, 90.0, 3),
        (90.0, 270.0, 4),
    ] {
        let d = parsed(&file(
            &steps(10.0, 150.0, 8),
            &steps(from, to, count),
            shape,
        ));
        let (rows, columns) = (2800, 720);
        let mut sum = 0.0;
        for i in 0..rows {
            let v = (10.0 + 140.0 * (f64::from(i) + 0.5) / f64::from(rows)).to_radians();
            for j in 0..columns {
                let h = TAU * (f64::from(j) + 0.5) / f64::from(columns);
                sum += d.intensity(v, h) * v.sin();
            }
        }
        sum *= 140.0_f64.to_radians() / f64::from(rows) * TAU / f64::from(columns);
        assert!(
            (sum / d.flux() - 1.0).abs() < 1e-5,
            "{to}: {sum} {}",
            d.flux()
        );
    }
}

#[test]
fn intensities_are_the_files_and_symmetric() {
    let shape = |v: f64, h: f64| 1000.0 - 3.0 * v + 0.5 * h;
    let at = |d: &Distribution, v: f64, h: f64| d.intensity(v.to_radians(), h.to_radians());
    let verticals = steps(0.0, 90.0, 10);
    for (first, last) in [(0.0, 90.0), (0.0, 180.0), (90.0, 270.0), (0.0, 360.0)] {
        let d = parsed(&file(&verticals, &steps(first, last, 7), shape));
        for v in [0.0, 7.0, 45.0, 90.0] {
            for h in steps(first, last, 23) {
                // A function linear in both angles is reproduced exactly.
                if last < 360.0 || h < 360.0 {
                    assert!((at(&d, v, h) - shape(v, h)).abs() < 1e-9, "{last}: {v} {h}");
                }
            }
            for h in [3.0, 77.0, 120.0, 200.0, 359.0] {
                let here = at(&d, v, h);
                let mirrored: &[f64] = match (first, last) {
                    (0.0, 90.0) => &[-h, 180.0 - h, 180.0 + h],
                    (0.0, 180.0) => &[-h],
                    (90.0, _) => &[180.0 - h],
                    _ => &[h + 360.0, h - 720.0],
                };
                for other in mirrored {
                    assert!(
                        (at(&d, v, *other) - here).abs() < 1e-9,
                        "{last}: {h} {other}"
                    );
                }
            }
        }
        assert_eq!(at(&d, 90.1, 10.0), 0.0);
    }
    let round = parsed(&file(&verticals, &[0.0], shape));
    assert_eq!(at(&round, 33.0, 0.0), at(&round, 33.0, 217.0));
}

#[test]
fn factors_multiply_and_editions_differ_little() {
    let numbers = "2 500 1.5 3 1 1 1 0.1 0.2 0.3 0.9 0.8 100 0 45 90 0 300 200 0";
    let editions = [
        format!("Old file of 1986\nTILT=NONE\n{numbers}"),
        format!(
            "IESNA91\n[TEST] x\nTILT=NONE\r\n{}\r\n",
            numbers.replace(' ', ",\r\n")
        ),
        format!(
            "IESNA:LM-63-1995\n[TEST] \u{fc}\nTILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8\n{numbers}"
        ),
    ];
    for text in editions {
        let d = parsed(&text);
        assert!((d.peak() - 300.0 * 1.5 * 0.9 * 0.8).abs() < 1e-9);
        assert_eq!(d.lamp_lumens(), Some(1000.0));
        assert!((d.end() - PI / 2.0).abs() < 1e-12);
    }
    // Keywords in Latin-1 are accepted.
    let latin = [
        b"IESNA:LM-63-2002\n[LAMP] gl\xfchend\nTILT=NONE\n",
        numbers.as_bytes(),
    ]
    .concat();
    assert!(Distribution::parse(&latin).is_ok());
    let absolute = numbers.replacen("500", "-1", 1);
    assert_eq!(
        parsed(&format!("TILT=NONE\n{absolute}")).lamp_lumens(),
        None
    );
}

#[test]
fn light_ends_where_the_file_says() {
    let narrow = |v: f64, _| if v < 25.0 { 100.0 } else { 0.0 };
    let d = parsed(&file(&steps(0.0, 90.0, 10), &[0.0], narrow));
    assert!((d.end() - 30.0_f64.to_radians()).abs() < 1e-12);
    assert_eq!(d.intensity(30.1_f64.to_radians(), 0.0), 0.0);
}

#[test]
fn every_error_has_its_line() {
    let good = file(&[0.0, 45.0, 90.0], &[0.0, 90.0], |_, _| 10.0);
    assert!(Distribution::parse(good.as_bytes()).is_ok());
    for (from, to, line, say) in [
        ("TILT=NONE\n", "", 9, "no line has `TILT=`"),
        ("1 1000 1", "1 1000 x", 5, "`x` is not a number"),
        (
            "1 1000 1",
            "1 1000 -1",
            5,
            "the multiplier of the intensities is -1",
        ),
        ("1 1000 1", "1 1000 1e999", 5, "is not a number"),
        (" 3 2 1 2", " 3 2 2 2", 5, "type B"),
        (" 3 2 1 2", " 3 2 3 2", 5, "type A"),
        (" 3 2 1 2", " 3 2 7 2", 5, "type of photometry is 7"),
        (" 3 2 1 2", " 4 2 1 2", 8, "angles: 0 follows 90"),
        (
            " 3 2 1 2",
            " 99999999 2 1 2",
            5,
            "whole number from 1 to 3601",
        ),
        (
            " 3 2 1 2",
            " 3600 3600 1 2",
            5,
            "number of intensities is 12960000",
        ),
        (" 3 2 1 2", " 2.5 2 1 2", 5, "whole number"),
        ("1 1 50", "0 1 50", 6, "the ballast factor is 0"),
        ("0 45 90\n", "0 45 45\n", 7, "45 follows 45"),
        ("0 45 90\n", "0 45 190\n", 7, "run from 0 to 190"),
        ("0 90\n", "0 100\n", 8, "run from 0 to 100"),
        ("0 90\n", "10 90\n", 8, "run from 10 to 90"),
        ("10 10 10\n10", "10 -10 10\n10", 9, "an intensity is -10"),
        (
            "10 10 10\n10 10 10",
            "10 10 10\n10 10",
            10,
            "ends where an intensity",
        ),
        (
            "10 10 10\n10 10 10",
            "10 10 10\n10 10 10 7",
            10,
            "`7` stands after the last",
        ),
        (
            "10 10 10\n10 10 10",
            "0 0 0\n0 0 0",
            10,
            "all intensities are zero",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let bad = good.replacen(from, to, 1);
        let error = Distribution::parse(bad.as_bytes()).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(say), "{to}: {message}");
        assert_eq!(error.line, line, "{to}: {message}");
    }
    let tilted = good.replace("TILT=NONE", "TILT=lamp.tlt");
    let (read, note) = Distribution::noted(tilted.as_bytes()).unwrap();
    assert_eq!(read, parsed(&good));
    assert_eq!(note.unwrap(), "`TILT=lamp.tlt`: read as `TILT=NONE`");
    for nothing in ["", "TILT=NONE", "TILT=INCLUDE\n1 9999", "\0\u{1a}", "TILT="] {
        assert!(Distribution::parse(nothing.as_bytes()).is_err());
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    let good = file(&steps(0.0, 180.0, 7), &steps(0.0, 360.0, 5), |v, h| {
        1.5 + v + h
    });
    let end = good.trim_end().len();
    // The last number, cut short, is still a number.
    for length in 0..end - 5 {
        assert!(
            Distribution::parse(&good.as_bytes()[..length]).is_err(),
            "{length}"
        );
    }
    for i in 0..end {
        for flip in [1, 16, 128] {
            let mut bytes = good.clone().into_bytes();
            bytes[i] ^= flip;
            if let Ok(d) = Distribution::parse(&bytes) {
                assert!(d.flux() > 0.0 && d.intensity(1.0, 2.0).is_finite());
            }
        }
    }
}

/// 0 to 345 by 15: the last step leads back to the first plane.
#[test]
fn planes_that_stop_one_step_short_go_round() {
    let candela = |v: f64, h: f64| 100.0 + v + 50.0 * h.to_radians().cos();
    let whole = parsed(&file(&steps(0.0, 90.0, 7), &steps(0.0, 360.0, 25), candela));
    let short = parsed(&file(&steps(0.0, 90.0, 7), &steps(0.0, 345.0, 24), candela));
    for h in [0.0_f64, 100.0, 345.0, 352.5, 359.0] {
        let at = |d: &Distribution| d.intensity(0.7, h.to_radians());
        assert!((at(&whole) - at(&short)).abs() < 1e-9, "{h}");
    }
    assert!((whole.flux() - short.flux()).abs() < 1e-9);
}

/// A EULUMDAT file of these planes and angles: 2000 lumens, half of a thousandth per unit.
fn eulumdat(symmetry: u8, candela: impl Fn(f64, f64) -> f64) -> String {
    eulumdat_of(symmetry, &steps(0.0, 330.0, 12), candela)
}

/// Like [`eulumdat`], with planes at any angles.
fn eulumdat_of(symmetry: u8, planes: &[f64], candela: impl Fn(f64, f64) -> f64) -> String {
    let angles = steps(0.0, 90.0, 10);
    let mut lines = vec!["Nobody".to_owned(), "2".into(), symmetry.to_string()];
    lines.push(planes.len().to_string());
    lines.extend(["30", "10", "10"].map(String::from));
    lines.extend(["", "Lamp", "", "a.ldt", ""].map(String::from));
    lines.extend(["100"; 9].map(String::from));
    lines.extend(["100", "80", "0,5", "0", "1"].map(String::from));
    lines.extend(["1", "LED", "2000", "3000 K", "80", "20"].map(String::from));
    lines.extend(["0.5"; 10].map(String::from));
    let given: Vec<f64> = match symmetry {
        1 => vec![0.0],
        2 => planes.iter().copied().filter(|c| *c <= 180.0).collect(),
        3 => {
            let late = planes.iter().filter(|c| **c >= 270.0);
            late.chain(planes.iter().filter(|c| **c <= 90.0))
                .copied()
                .collect()
        }
        4 => planes.iter().copied().filter(|c| *c <= 90.0).collect(),
        _ => planes.to_vec(),
    };
    lines.extend(planes.iter().chain(&angles).map(f64::to_string));
    for h in given {
        lines.extend(
            angles
                .iter()
                .map(|v| candela(*v, h.rem_euclid(360.0)).to_string()),
        );
    }
    lines.join("\r\n")
}

#[test]
fn eulumdat_gives_candela_in_every_symmetry() {
    let of = |v: f64, x: f64| 100.0 + v + x;
    for symmetry in 0..=4_u8 {
        let around = |h: f64| match symmetry {
            0 => 20.0 * h.to_radians().cos() + 5.0 * h.to_radians().sin(),
            2 => 20.0 * h.to_radians().cos(),
            3 => 20.0 * h.to_radians().sin(),
            4 => 20.0 * (2.0 * h).to_radians().cos(),
            _ => 0.0,
        };
        let file = eulumdat(symmetry, |v, h| of(v, around(h)));
        let found = parsed(&file);
        for i in 0..12 {
            let h = 30.0 * f64::from(i);
            // 2 klm times a factor of a half.
            let wanted = of(40.0, around(h));
            let light = found.intensity(40_f64.to_radians(), h.to_radians());
            assert!(
                (light - wanted).abs() < 1e-9,
                "{symmetry} at {h}: {light} {wanted}"
            );
        }
        assert_eq!(found.lamp_lumens(), Some(2000.0));
        for cut in [30, 60, 100] {
            let part: Vec<&str> = file.lines().take(cut).collect();
            let result = Distribution::parse(part.join("\n").as_bytes());
            assert!(
                result.is_err() || symmetry == 1 && cut == 100,
                "{symmetry} {cut}"
            );
        }
    }
}

/// Planes of a road luminaire, dense where its light changes. The expected values are linear
/// between neighbouring planes, by hand.
#[test]
fn eulumdat_keeps_uneven_planes() {
    let planes = [0.0, 20.0, 90.0, 160.0, 180.0, 200.0, 270.0, 340.0];
    let at = |d: &Distribution, c: f64| d.intensity(45_f64.to_radians(), c.to_radians());
    let close =
        |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    // Mirrored at the plane of 90: bright around C0 and C180, dark across.
    let across = |_: f64, h: f64| {
        if (h - 90.0).abs() < 1.0 || (h - 270.0).abs() < 1.0 {
            100.0
        } else {
            1000.0
        }
    };
    let road = parsed(&eulumdat_of(3, &planes, across));
    for (c, wanted) in [
        (0.0, 1000.0),
        (45.0, 1000.0 - 900.0 * 25.0 / 70.0),
        (90.0, 100.0),
        (135.0, 1000.0 - 900.0 * 25.0 / 70.0),
        (305.0, 550.0),
    ] {
        close(at(&road, c), wanted);
    }
    // Mirrored at the plane of 0.
    let along = |_: f64, h: f64| 100.0 + h.min(360.0 - h);
    let half = parsed(&eulumdat_of(2, &planes, along));
    for c in [10.0, 55.0, 170.0, 190.0, 305.0] {
        close(at(&half, c), along(0.0, c));
    }
    let short = eulumdat_of(3, &[0.0, 20.0, 90.0, 160.0, 200.0, 300.0], across);
    let refused = Distribution::parse(short.as_bytes()).unwrap_err();
    assert!(refused.to_string().contains("symmetry"), "{refused}");
}

#[test]
fn eulumdat_begins_at_any_plane() {
    let of = |_: f64, h: f64| {
        if (90.0..=270.0).contains(&h) {
            100.0
        } else {
            1000.0
        }
    };
    let found = parsed(&eulumdat_of(0, &[45.0, 135.0, 225.0, 315.0], of));
    let at = |c: f64| found.intensity(0.5, c.to_radians());
    for (c, wanted) in [
        (0.0, 1000.0),
        (30.0, 1000.0),
        (60.0, 850.0),
        (180.0, 100.0),
        (270.0, 550.0),
        (359.0, 1000.0),
    ] {
        assert!((at(c) - wanted).abs() < 1e-9, "{c}: {} {wanted}", at(c));
    }
}

#[test]
fn eulumdat_takes_the_first_set_of_lamps_and_says_so() {
    let one = eulumdat(1, |_, _| 100.0);
    let mut lines: Vec<&str> = one.lines().collect();
    lines[25] = "2";
    lines.splice(32..32, ["1", "LED", "3000", "3000 K", "80", "30"]);
    let (read, note) = Distribution::noted(lines.join("\n").as_bytes()).unwrap();
    assert_eq!(read, parsed(&one));
    assert!(
        note.unwrap()
            .contains("the first of 2 sets of lamps, 2000 lm")
    );
    assert_eq!(Distribution::noted(one.as_bytes()).unwrap().1, None);
}

#[test]
fn eulumdat_faults_are_in_its_own_words() {
    let good = eulumdat(1, |_, _| 100.0);
    for (line, text, said) in [
        (2, "7", "nor EULUMDAT (lines 2 and 3"),
        (
            28,
            "0",
            "line 29: the lumens of the lamps is 0; it must be above 0",
        ),
    ] {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[line] = text;
        let error = Distribution::parse(lines.join("\n").as_bytes()).unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn the_edition_of_2019_has_a_type_where_older_ones_have_a_factor() {
    let plain = file(&[0.0, 90.0], &[0.0], |v, _| 1000.0 - 10.0 * v);
    let typed = plain.replace("\n1 1 50\n", "\n0.5 1.11 50\n");
    let older = parsed(&typed);
    assert!((older.intensity(0.0, 0.0) - 555.0).abs() < 1e-9);
    let newer = parsed(&typed.replace("IESNA:LM-63-2002", "IES:LM-63-2019"));
    assert!((newer.intensity(0.0, 0.0) - 500.0).abs() < 1e-9);
    for tilt in ["TILT = NONE ", "tilt=none", "Tilt=None\r"] {
        assert_eq!(
            parsed(&plain.replace("TILT=NONE", tilt)),
            parsed(&plain),
            "{tilt}"
        );
    }
}
