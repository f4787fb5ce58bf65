//! Whole layouts: no overlaps, no clipping, no failures.

use super::drawing::Mark;
use super::frame::Frame;
use super::*;

/// Every text lies inside the drawing, and no two texts touch.
fn assert_clear(drawing: &Drawing) {
    let (width, height) = drawing.size;
    let page = Frame::new(0.0, 0.0, width, height);
    let boxes = drawing.text_boxes();
    for (index, (text, frame)) in boxes.iter().enumerate() {
        assert!(page.holds(frame), "{text:?} {frame:?} leaves {page:?}");
        for (other, taken) in boxes.iter().skip(index + 1) {
            // Bounding boxes use the font's tallest letters: lines below each other may share the
            // space of accents and descenders.
            let body = |frame: &Frame| Frame {
                y: frame.y + 0.18 * frame.height,
                height: 0.64 * frame.height,
                ..*frame
            };
            let clash = body(frame).overlaps(&body(taken));
            assert!(!clash, "{text:?} {frame:?} meets {other:?} {taken:?}");
        }
    }
}

/// Checks that tags nest, attributes are quoted, and `&` begins an entity: enough to catch errors
/// in a writer of elements and escapes.
fn assert_well_formed(svg: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = svg;
    while let Some(start) = rest.find('<') {
        let text = &rest[..start];
        assert!(!text.contains('>'), "stray > in {text:?}");
        for entity in text.split('&').skip(1) {
            let known = ["amp;", "lt;", "gt;", "quot;"];
            assert!(
                known.iter().any(|name| entity.starts_with(name)),
                "{entity:?}"
            );
        }
        let end = start + rest[start..].find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag:?}");
        assert!(!tag.contains('<'), "{tag:?}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap_or(tag));
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

fn show(rows: usize, cues: usize) -> CurveChart {
    let row = |index: usize| CurveRow {
        ends: (index % 4 == 3).then(|| ["-270°", "270°"].map(str::to_owned)),
        name: format!("bank {index} <a&b> with a name that is far too long to be written"),
        colour: (index % 3 == 1).then_some([255, 255, 255]),
        points: (0..9)
            .map(|k| (k as f64 * 20.0, ((index + k * 5) % 11) as f64 / 10.0))
            .collect(),
        before: Vec::new(),
        moves: (0..index % 5)
            .map(|k| (k as f64 * 30.0, k as f64 * 40.0))
            .collect(),
    };
    let cue = |index: usize| {
        let time = (index * index) as f64 * 160.0 / (cues * cues).max(1) as f64;
        (time, format!("{}.{index}", index / 2))
    };
    CurveChart {
        title: "Levels".repeat(30),
        start: 0.0,
        end: 160.0,
        rows: (0..rows).map(row).collect(),
        cues: (0..=cues).map(cue).collect(),
        playhead: Some(61.7),
    }
}

fn series(name: &str, points: Vec<(f64, f64)>) -> Series {
    Series {
        name: name.to_owned(),
        points,
        marker: Marker::Circle,
        labels: Vec::new(),
    }
}

fn measured(scale: Scale, count: usize) -> Panel {
    let names = [
        "SVD",
        "greedy <a&b>",
        "a series with a long name indeed",
        "cues",
    ];
    Panel {
        title: "Error against the number of refined pictures, on all shows".to_owned(),
        x: Axis::new("refined pictures", scale),
        y: Axis::new("RMS error", Scale::Log),
        series: names
            .iter()
            .enumerate()
            .map(|(index, name)| {
                let rate = 0.1 + 0.2 * index as f64;
                let at = |k: usize| (k as f64, (-rate * k as f64).exp());
                series(name, (1..=count).map(at).collect())
            })
            .collect(),
        reference: Some((0.01, "tolerance 1 %".to_owned())),
    }
}

#[test]
fn many_panels_stand_in_pairs_each_with_its_legend() {
    for theme in [Theme::Light, Theme::Dark] {
        for count in 3..=7 {
            let all: Vec<Panel> = (0..count).map(|_| measured(Scale::Whole, 9)).collect();
            let drawing = panels("Many panels", &all, theme);
            assert_eq!(drawing.size.0, 840.0);
            assert_clear(&drawing);
            let named = drawing.text_boxes();
            let own = named.iter().filter(|(text, _)| text == "SVD").count();
            assert_eq!(own, count);
        }
    }
}

fn tile(width: usize, height: usize, caption: &str) -> Tile {
    Tile {
        size: (width, height),
        rgb: vec![200; width * height * 3],
        caption: caption.to_owned(),
    }
}

#[test]
fn no_text_of_curves_meets_another_or_leaves_the_page() {
    for theme in [Theme::Light, Theme::Dark] {
        for rows in [0, 1, 3, 16, 25, 90] {
            for cues in [0, 1, 7, 40, 900] {
                let drawing = curves(&show(rows, cues), theme);
                assert_clear(&drawing);
                assert_well_formed(&drawing.svg());
            }
        }
    }
}

#[test]
fn the_playheads_time_takes_the_place_of_a_tick() {
    for tenth in 0..=1600 {
        let mut data = show(2, 3);
        data.playhead = Some(f64::from(tenth) / 10.0);
        assert_clear(&curves(&data, Theme::Dark));
    }
}

#[test]
fn what_lies_on_the_same_pixels_is_drawn_once() {
    let mut data = show(1, 0);
    let many = |count: usize| (0..count).map(move |k| k as f64 * 160.0 / count as f64);
    data.rows[0].moves = many(100_000).map(|t| (t, t + 1e-3)).collect();
    let marks = curves(&data, Theme::Dark).marks.len();
    assert!(marks < 10_000, "{marks}");
}

#[test]
fn cues_of_one_moment_share_a_name_and_those_outside_are_left_out() {
    let cues = [
        (5.0, "1"),
        (5.0, "2"),
        (90.0, "3"),
        (90.0, "4"),
        (90.0, "5"),
    ];
    let outside = [(-1.0, "6"), (161.0, "7"), (f64::NAN, "8")];
    let mut data = show(2, 0);
    let named = |(time, name): &(f64, &str)| (*time, (*name).to_owned());
    data.cues = cues.iter().chain(&outside).map(named).collect();
    let texts: Vec<String> = curves(&data, Theme::Dark)
        .text_boxes()
        .into_iter()
        .map(|(text, _)| text)
        .collect();
    assert!(texts.contains(&"1, 2".to_owned()) && texts.contains(&"3 +2".to_owned()));
    for absent in ["6", "7", "8"] {
        assert!(!texts.contains(&absent.to_owned()));
    }
}

#[test]
fn a_strip_is_filled_as_high_as_its_level() {
    let half = CurveRow {
        name: String::new(),
        colour: Some([255, 0, 0]),
        points: vec![(0.0, 0.5)],
        ..CurveRow::default()
    };
    let data = CurveChart {
        end: 10.0,
        rows: vec![half],
        ..CurveChart::default()
    };
    let (width, _, rgb) = curves(&data, Theme::Light).rgb8().unwrap();
    // The strip, without title and cues: from y = 16 + 6 down 84 - 8.
    let (top, height) = (22, 76);
    let redness = |y: usize| {
        let at = (y * width + 333) * 3;
        i32::from(rgb[at]) - i32::from(rgb[at + 1])
    };
    assert!(redness(top + 10).abs() < 10, "above the level");
    assert!(redness(top + height / 2).abs() > 200, "the line");
    assert!(redness(top + height - 10) > 60, "below the level");
    assert!(redness(top + height + 3).abs() < 10, "under the strip");
}

#[test]
fn curves_bear_bad_numbers() {
    let mut data = show(3, 5);
    data.rows[0].points = vec![(f64::NAN, 0.5), (1.0, f64::INFINITY)];
    data.rows[1].points = vec![(f64::NEG_INFINITY, 0.1), (1e300, 7.0), (-1e300, -7.0)];
    for (start, end) in [
        (0.0, 0.0),
        (5.0, 1.0),
        (f64::NAN, 1.0),
        (-1e300, 1e300),
        (1e12, 1e12 + 1e-6),
    ] {
        (data.start, data.end) = (start, end);
        let drawing = curves(&data, Theme::Light);
        assert_clear(&drawing);
        assert_well_formed(&drawing.svg());
        drawing.rgb8().unwrap();
    }
}

#[test]
fn many_points_become_few_and_many_rows_are_counted() {
    let mut data = show(1, 0);
    let noise = |k: usize| (k as f64 * 160.0 / 1e5, (k * 7919 % 1000) as f64 / 1000.0);
    data.rows[0].points = (0..100_000).map(noise).collect();
    assert!(curves(&data, Theme::Dark).svg().len() < 120_000);

    let drawing = curves(&show(3000, 2), Theme::Dark);
    let more = |(text, _): &(String, Frame)| text == "and 2488 more rows";
    assert!(drawing.text_boxes().iter().any(more));
    drawing.rgb8().unwrap();
}

#[test]
fn no_text_of_panels_meets_another_or_leaves_the_page() {
    for scales in [
        vec![],
        vec![Scale::Linear],
        vec![Scale::Linear, Scale::Log],
        vec![Scale::Log, Scale::Time, Scale::Linear],
    ] {
        for count in [0, 1, 2, 25, 300, 70_000] {
            let data: Vec<Panel> = scales.iter().map(|&scale| measured(scale, count)).collect();
            let drawing = panels("Convergence <a&b>", &data, Theme::Light);
            assert_clear(&drawing);
            assert_well_formed(&drawing.svg());
        }
    }
}

#[test]
fn panels_leave_out_what_has_no_place_and_break_the_line_there() {
    let points = vec![
        (1.0, 1.0),
        (2.0, 0.0),
        (3.0, f64::NAN),
        (4.0, 10.0),
        (5.0, 20.0),
    ];
    let mut panel = Panel {
        y: Axis::new("y", Scale::Log),
        series: vec![Series {
            marker: Marker::None,
            ..series("one", points)
        }],
        ..Panel::default()
    };
    // Strokes of a series are 2 wide: the legend's and the run of two; the single point is a disc.
    let lines = |panel: &Panel| {
        let drawing = panels("", std::slice::from_ref(panel), Theme::Light);
        assert_clear(&drawing);
        drawing.rgb8().unwrap();
        let wide = |mark: &&Mark| {
            matches!(mark, Mark::Line { stroke, .. }
                if stroke.width == 2.0 && stroke.colour != Theme::Light.palette().ground)
        };
        drawing.marks.iter().filter(wide).count()
    };
    assert_eq!(lines(&panel), 2);
    panel.series[0].points.clear();
    assert_eq!(lines(&panel), 1);
    panel.reference = Some((f64::NAN, "nowhere".to_owned()));
    assert_eq!(lines(&panel), 1);
}

#[test]
fn a_series_keeps_its_colour_through_all_panels() {
    let of = |names: &[&str]| Panel {
        series: names
            .iter()
            .map(|name| series(name, vec![(0.0, 0.0), (1.0, 1.0)]))
            .collect(),
        ..Panel::default()
    };
    let drawing = panels("", &[of(&["a", "b"]), of(&["b"])], Theme::Light);
    let hue = Theme::Light.palette().hue(1);
    let second = |mark: &&Mark| matches!(mark, Mark::Line { stroke, .. } if stroke.colour == hue);
    // Legend, left panel, right panel.
    assert_eq!(drawing.marks.iter().filter(second).count(), 3);
}

#[test]
fn sheets_hold_every_picture_and_caption_apart() {
    let long = "a caption far too long for a picture as narrow as this one, which is cut";
    for count in [0, 1, 2, 3, 7, 12, 30] {
        for columns in [None, Some(0), Some(1), Some(3), Some(100)] {
            let data = Sheet {
                title: "Key pictures".to_owned(),
                tiles: (0..count)
                    .map(|k| tile(40 + 30 * k, 60 + 7 * (k % 4), long))
                    .collect(),
                columns,
                legend: "What the figures mean. ".repeat(40),
            };
            let drawing = sheet(&data, Theme::Dark).unwrap();
            assert_clear(&drawing);
            let (width, height) = drawing.size;
            let page = Frame::new(0.0, 0.0, width, height);
            let frames: Vec<Frame> = drawing
                .marks
                .iter()
                .filter_map(|mark| match mark {
                    Mark::Picture { frame, .. } => Some(*frame),
                    _ => None,
                })
                .collect();
            assert_eq!(frames.len(), count);
            for (index, frame) in frames.iter().enumerate() {
                assert!(page.holds(frame));
                assert!(!frames[..index].iter().any(|other| other.overlaps(frame)));
                let boxes = drawing.text_boxes();
                assert!(!boxes.iter().any(|(_, text)| text.overlaps(frame)));
            }
        }
    }
}

#[test]
fn a_sheet_refuses_bytes_that_do_not_fill_the_picture() {
    let mut data = Sheet::default();
    data.tiles.push(tile(4, 4, ""));
    data.tiles[0].rgb.pop();
    let refused = sheet(&data, Theme::Light).unwrap_err();
    assert!(matches!(
        refused,
        ChartError::Picture {
            needed: 48,
            found: 47,
            ..
        }
    ));
}

#[test]
fn the_svg_embeds_pictures_as_png_and_the_png_is_one() {
    let data = Sheet {
        tiles: vec![tile(30, 20, "one")],
        ..Sheet::default()
    };
    let drawing = sheet(&data, Theme::Light).unwrap();
    let svg = drawing.svg();
    assert_well_formed(&svg);
    // Base64 of "\x89PNG\r\n\x1a\n".
    assert!(svg.contains("href=\"data:image/png;base64,iVBORw0KGgo"));
    assert!(drawing.png().unwrap().starts_with(b"\x89PNG\r\n\x1a\n"));
}
