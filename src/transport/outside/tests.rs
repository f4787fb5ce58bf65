//! External renderers as fake programs.

#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use super::*;
use footlight_host::files::process::Done;
use footlight_host::work::Progress;
use footlight_picture::exr::Precision;
use footlight_show::geometry::vec3;
use footlight_show::hash::{GOLDEN, mix};
use footlight_stage::{Rig, Scene, Source};

fn setup(names: &[&str]) -> Setup {
    let source = |name: &&str| Source {
        name: (*name).to_owned(),
        emitters: Vec::new(),
    };
    let rig = Rig {
        lights: Vec::new(),
        sources: names.iter().map(source).collect(),
    };
    let view = View {
        from: vec3(0.0, -1.0, 2.0),
        to: vec3(0.0, 0.0, 0.0),
        fov: 40.0,
        roll: 0.0,
        width: 3,
        height: 2,
    };
    Setup::new(Scene::default(), rig, view)
}

/// Settings of a request, which must not be negative.
fn values(job: &Job<'_>) -> Vec<f64> {
    let (mark, _, bytes) = job.inputs[0];
    assert_eq!(mark, SETTINGS);
    let request: serde_json::Value = serde_json::from_slice(bytes).unwrap();
    assert_eq!(request["view"]["width"], 3);
    let list = request["coordinates"].as_array().unwrap();
    let values: Vec<f64> = list.iter().map(|c| c["value"].as_f64().unwrap()).collect();
    assert!(values.iter().all(|v| *v >= 0.0));
    values
}

fn done(width: usize, height: usize, value: f64) -> Result<Done, ProcessError> {
    let image = Image::from_data(width, height, vec![value as f32; width * height * 3]).unwrap();
    Ok(Done {
        output: exr::encode(&image, Precision::Float, &[]).unwrap(),
        seconds: 2.0,
    })
}

fn outside(
    run: impl Fn(&Job<'_>) -> Result<Done, ProcessError> + Send + Sync + 'static,
) -> Outside {
    let call = RendererCall::parse("render {settings} {output}").unwrap();
    Outside::with(RendererCall { steps: 3, ..call }, Box::new(run))
}

fn prepare(outside: &Outside, names: &[&str]) -> Result<Box<dyn Prepared>, TransportError> {
    outside.prepare(&setup(names), Quality(2), Work::silent())
}

fn failed(run: impl Fn(&Job<'_>) -> Result<Done, ProcessError> + Send + Sync + 'static) -> String {
    match prepare(&outside(run), &["a", "b"]) {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_linear_renderer_is_taken_at_its_word_and_its_cost_measured() {
    let sum = |job: &Job<'_>| done(3, 2, values(job).iter().sum());
    let outside = outside(sum);
    let cost = || outside.cost(&setup(&["a"]), Quality(2));
    assert_eq!((cost(), outside.finest()), (Cost::default(), Quality(3)));
    let mut prepared = prepare(&outside, &["a", "b", "c"]).unwrap();
    assert_eq!(outside.linearity().unwrap(), Linearity::default());
    assert!(outside.warnings().is_empty());
    assert_eq!(cost().per_image, 2.0);
    // Negative light is rendered separately and subtracted.
    let settings = [vec![1.0, -0.5, 0.25], vec![-1.0, 0.0, 0.0], vec![0.0; 3]];
    let images = prepared.render(&settings, Work::silent()).unwrap();
    for (image, value) in images.iter().zip([0.75, -1.0, 0.0]) {
        assert_eq!(image.data(), [value; 18]);
    }
    for wrong in [vec![1.0], vec![f64::NAN, 0.0, 0.0]] {
        assert!(prepared.render(&[wrong], Work::silent()).is_err());
    }
    let lean = Work {
        memory: 18 * 4 * 5 - 1,
        ..Work::silent()
    };
    let refused = prepared.render(&settings, lean);
    assert!(matches!(refused, Err(TransportError::Memory { .. })));
    let off = outside.prepare(&setup(&["a"]), Quality(4), Work::silent());
    assert!(matches!(off, Err(TransportError::Quality(4, 3))));
}

#[test]
fn what_is_not_linear_is_warned_about_with_the_figure() {
    // A bias of 0.1 on sums of 2 (two of three sources and one): 5 %; 0.1 of 4: 2.5 %.
    let bias = |job: &Job<'_>| done(3, 2, values(job).iter().sum::<f64>() + 0.1);
    let outside_bias = outside(bias);
    prepare(&outside_bias, &["a", "b", "c"]).unwrap();
    let found = outside_bias.linearity().unwrap();
    assert!((found.sum - 0.1 / 3.1).abs() < 1e-6, "{found:?}");
    assert!((found.double - 0.1 / 4.1).abs() < 1e-6, "{found:?}");
    let Linearity { sum, double } = found;
    assert_eq!(
        outside_bias.warnings(),
        [TransportWarning::NotLinear { sum, double }]
    );
    let said = outside_bias.warnings()[0].to_string();
    assert!(said.contains("3.23 %") && said.contains("2.44 %"), "{said}");

    // Clipped at 1, with one source: G(a) = 1, G(b) = 0.5, both and twice 1.
    let clipped = |job: &Job<'_>| done(3, 2, values(job).iter().sum::<f64>().min(1.0));
    let outside_clipped = outside(clipped);
    prepare(&outside_clipped, &["a"]).unwrap();
    let found = outside_clipped.linearity().unwrap();
    assert_eq!((found.sum, found.double), (0.5, 1.0));

    // Black is linear; light without any source is not.
    let black = outside(|_| done(3, 2, 0.0));
    prepare(&black, &["a", "b"]).unwrap();
    assert_eq!(black.linearity().unwrap(), Linearity::default());
}

/// A renderer that reads the scene may be noisy, but must be unbiased.
#[test]
fn noise_is_no_bias() {
    let reading = |light: fn(f64) -> f64| {
        let call = RendererCall::parse("render {scene} {settings} {output}").unwrap();
        let run = move |job: &Job<'_>| {
            let settings = job.inputs.iter().find(|input| input.0 == SETTINGS).unwrap();
            let request: serde_json::Value = serde_json::from_slice(settings.2).unwrap();
            let list = request["coordinates"].as_array().unwrap();
            let sum: f64 = list.iter().map(|c| c["value"].as_f64().unwrap()).sum();
            let mut state = request["seed"].as_u64().unwrap();
            let noisy = (0..48 * 27 * 3).map(|_| {
                state = mix(state.wrapping_add(GOLDEN));
                (light(sum) * (0.8 + 0.4 * (state >> 11) as f64 / (1_u64 << 53) as f64)) as f32
            });
            let image = Image::from_data(48, 27, noisy.collect()).unwrap();
            Ok(Done {
                output: exr::encode(&image, Precision::Float, &[]).unwrap(),
                seconds: 2.0,
            })
        };
        let outside = Outside::with(RendererCall { steps: 3, ..call }, Box::new(run));
        let mut setup = setup(&["a", "b"]);
        (setup.view.width, setup.view.height) = (48, 27);
        outside.prepare(&setup, Quality(2), Work::silent()).unwrap();
        outside
    };
    let linear = reading(|sum| sum);
    assert_eq!(linear.linearity(), Some(Linearity::default()));
    // Four times the samples per step, and proportional time.
    assert_eq!(linear.samples(Quality(3)), Some(16.0));
    assert_eq!(linear.cost(&setup(&["a"]), Quality(3)).per_image, 8.0);
    // Displayed instead of linear light.
    let displayed = reading(f64::sqrt);
    let Some(Linearity { sum, double }) = displayed.linearity() else {
        panic!("not measured");
    };
    assert!(
        (sum - (2.0 - 2_f64.sqrt()) / 2_f64.sqrt()).abs() < 0.02,
        "{sum}"
    );
    assert!(
        (double - (2.0 - 2_f64.sqrt()) / 2_f64.sqrt()).abs() < 0.02,
        "{double}"
    );
}

#[test]
fn what_it_leaves_is_checked() {
    assert!(failed(|_| done(3, 3, 1.0)).contains("3x3 pixels, the view has 3x2"));
    let garbage = |bytes: &[u8]| {
        let output = bytes.to_vec();
        failed(move |_| {
            Ok(Done {
                output: output.clone(),
                seconds: 0.0,
            })
        })
    };
    assert!(garbage(b"").contains("cannot be used"));
    assert!(garbage(b"P3 3 2 255").contains("OpenEXR"));
    let mut nan = done(3, 2, 1.0).unwrap().output;
    let end = nan.len();
    nan[end - 4..].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(garbage(&nan).contains("NaN or infinite"));
    let failing = |_: &Job<'_>| {
        Err(ProcessError::Exit {
            program: "render".to_owned(),
            status: "code 7".to_owned(),
            tail: "no GPU\n".to_owned(),
        })
    };
    let said = failed(failing);
    assert!(said.contains("code 7") && said.contains("no GPU"), "{said}");
}

#[test]
fn a_cancelled_run_is_a_cancel() {
    struct Stop;
    impl Progress for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let outside = outside(|job| {
        assert!((job.cancelled)());
        Err(ProcessError::Cancelled)
    });
    let work = Work {
        progress: &Stop,
        ..Work::silent()
    };
    let stopped = outside.prepare(&setup(&["a"]), Quality(1), work);
    assert!(matches!(stopped, Err(TransportError::Cancelled(_))));
}

#[test]
fn commands_without_their_marks_are_refused() {
    assert!(RendererCall::parse("render '{settings}' --to={output}").is_ok());
    assert!(matches!(
        RendererCall::parse("render {output}"),
        Err(OutsideError::Mark(SETTINGS))
    ));
    assert!(matches!(
        RendererCall::parse("render {settings}"),
        Err(OutsideError::Mark(OUTPUT))
    ));
    assert!(matches!(
        RendererCall::parse("render '{settings} {output}"),
        Err(OutsideError::Command(SplitError::Open))
    ));
}

/// A floor of two triangles, a spot on it, and an L-shaped panel.
fn lit_floor() -> Setup {
    use footlight_show::model::Spot;
    use footlight_show::units::Rgb;
    use footlight_stage::{Emitter, Light, Material, Polygon};
    let flat = |points: &[(f64, f64)]| points.iter().map(|&(x, y)| vec3(x, y, 0.0)).collect();
    let scene = Scene {
        materials: vec![
            Material::diffuse("floor", Rgb([0.5, 0.4, 0.3])),
            Material::diffuse("pane", Rgb([0.0; 3])),
        ],
        polygons: vec![
            Polygon::new(flat(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]), 0),
            Polygon::new(
                flat(&[
                    (0.0, 3.0),
                    (3.0, 3.0),
                    (3.0, 4.0),
                    (1.0, 4.0),
                    (1.0, 6.0),
                    (0.0, 6.0),
                ]),
                1,
            ),
        ],
        ..Scene::default()
    };
    let lights = vec![
        Light::Spot(Spot {
            position: vec3(1.0, 1.0, 3.0),
            aim: vec3(1.0, 1.0, 0.0),
            beam: 20.0,
            field: 40.0,
            intensity: Rgb([900.0, 800.0, 700.0]),
        }),
        Light::Panel {
            material: 1,
            radiance: Rgb([2.0; 3]),
        },
    ];
    let source = |(name, light): (&str, usize)| Source {
        name: name.to_owned(),
        emitters: vec![Emitter {
            light,
            filter: Rgb([1.0, 0.5, 0.25]),
        }],
    };
    let sources = [("lamp", 0), ("pane", 1)].map(source).to_vec();
    Setup::new(scene, Rig { lights, sources }, setup(&[]).view)
}

#[test]
fn the_scene_is_written_with_its_triangles_and_lights() {
    let (json, binary) = super::scene::files(&lit_floor()).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["schema"], 1);
    let meshes = json["meshes"].as_array().unwrap();
    assert_eq!(
        (
            meshes[0]["triangles"].as_u64(),
            meshes[1]["triangles"].as_u64()
        ),
        (Some(2), Some(4))
    );
    // Nine floats of corners and nine of normals for each triangle.
    assert_eq!(binary.len(), (2 + 4) * 18 * 4);
    let offset = meshes[1]["offset"].as_u64().unwrap() as usize;
    let float = |at: usize| f32::from_le_bytes(binary[at..at + 4].try_into().unwrap());
    let corner = |i: usize| {
        vec3(
            f64::from(float(offset + 12 * i)),
            f64::from(float(offset + 12 * i + 4)),
            0.0,
        )
    };
    let area = |t: usize| {
        (corner(3 * t + 1) - corner(3 * t))
            .cross(corner(3 * t + 2) - corner(3 * t))
            .z
            / 2.0
    };
    let total: f64 = (0..4).map(area).sum();
    assert!(
        (0..4).all(|t| area(t) > 0.0) && (total - 5.0).abs() < 1e-6,
        "{total}"
    );
    let spot = &json["lights"][0];
    assert_eq!(
        (&spot["kind"], spot["intensity"][2].as_f64()),
        (&"spot".into(), Some(700.0))
    );
    let shares = spot["shares"].as_array().unwrap();
    let end = spot["end"].as_f64().unwrap();
    // Half the intensity at half the beam angle, between two steps of the table.
    let at = 10.0_f64.to_radians() / end * (shares.len() - 1) as f64;
    let share = |i: usize| shares[i].as_f64().unwrap();
    let low = at.floor() as usize;
    let half = share(low) + (share(low + 1) - share(low)) * at.fract();
    assert!((half - 0.5).abs() < 1e-3, "{half}");
    assert_eq!(
        json["sources"][1]["emitters"],
        serde_json::json!([[1, [1.0, 0.5, 0.25]]])
    );
}

#[test]
fn haze_is_written_under_a_schema_of_its_own() {
    let mut setup = lit_floor();
    let json = |setup: &Setup| -> serde_json::Value {
        serde_json::from_slice(&super::scene::files(setup).unwrap().0).unwrap()
    };
    assert!(json(&setup).get("haze").is_none());
    let scene = Arc::make_mut(&mut setup.scene);
    scene.haze = Some(footlight_show::model::Haze {
        extinction: 0.05,
        forward: 0.6,
        albedo: 0.9,
    });
    let json = json(&setup);
    assert_eq!(json["schema"], 2);
    let wanted = serde_json::json!({ "extinction": 0.05, "albedo": 0.9, "forward": 0.6 });
    assert_eq!(json["haze"], wanted);
}

/// A texture of two texels over the floor; the right one is half transparent.
#[test]
fn a_texture_is_written_with_its_places() {
    use footlight_stage::shading::{Corner, Shading};
    use footlight_stage::texture::{Alpha, Pixels, Texture, Wrap};
    let mut setup = lit_floor();
    let scene = std::sync::Arc::make_mut(&mut setup.scene);
    scene.materials[0].texture = Some(Texture {
        pixels: Arc::new(Pixels::new([2, 1], &[[255; 4], [255, 255, 255, 128]])),
        factor: [0.5, 1.0, 1.0, 1.0],
        wrap: [Wrap::Mirror, Wrap::Clamp],
        alpha: Alpha::Blend,
        paint: None,
    });
    let corner = |point: &footlight_show::geometry::Vec3| Corner {
        point: *point,
        normal: None,
        place: Some([point.x / 2.0, point.y / 2.0]),
    };
    let floor = &mut scene.polygons[0];
    let corners: Vec<Corner> = floor.vertices.iter().map(corner).collect();
    floor.shading = Shading::of_corners(&corners).unwrap().map(Box::new);
    let (json, binary) = super::scene::files(&setup).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let floats = |at: &serde_json::Value, count: usize| -> Vec<f32> {
        let at = at.as_u64().unwrap() as usize;
        let bytes = binary[at..at + 4 * count].chunks(4);
        bytes
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect()
    };
    let texture = &json["materials"][0]["texture"];
    assert_eq!(texture["wrap"], serde_json::json!(["mirror", "clamp"]));
    assert_eq!(texture["cut"], true);
    let texels = floats(&texture["offset"], 8);
    let wanted = [0.5, 1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 128.0 / 255.0];
    for (found, wanted) in texels.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-4, "{texels:?}");
    }
    // Two metres for the image's width and height.
    let mesh = &json["meshes"][0];
    let (corners, places) = (floats(&mesh["offset"], 18), floats(&mesh["places"], 12));
    for (corner, place) in corners.chunks(3).zip(places.chunks(2)) {
        assert!((corner[0] / 2.0 - place[0]).abs() < 1e-5, "{places:?}");
        assert!((corner[1] / 2.0 - place[1]).abs() < 1e-5, "{places:?}");
    }
    assert!(json["materials"][1].get("texture").is_none());
    assert_eq!(super::scene::image_bytes(&setup), 32);
}

#[test]
fn a_program_that_reads_the_scene_gets_it_with_a_seed() {
    let seeds = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&seeds);
    let run = move |job: &Job<'_>| {
        let marks: Vec<&str> = job.inputs.iter().map(|input| input.0).collect();
        assert_eq!(marks, [SETTINGS, SCENE, "{numbers}"]);
        let request: serde_json::Value = serde_json::from_slice(job.inputs[0].2).unwrap();
        assert_eq!(request["schema"], 1);
        let mut seeds = seen.lock().unwrap();
        seeds.push((
            request["coordinates"].to_string(),
            request["seed"].as_u64().unwrap(),
        ));
        done(3, 2, 1.0)
    };
    let call = RendererCall::parse("render {scene} {settings} {output}").unwrap();
    let outside = Outside::with(call, Box::new(run));
    let mut operator = outside
        .prepare(&lit_floor(), Quality(1), Work::silent())
        .unwrap();
    operator
        .render(
            &[vec![1.0, 0.0], vec![0.0, 1.0], vec![1.0, 0.0]],
            Work::silent(),
        )
        .unwrap();
    let seeds = seeds.lock().unwrap();
    let last = &seeds[seeds.len() - 3..];
    assert!(last[0] == last[2] && last[0].1 != last[1].1, "{seeds:?}");
}

#[test]
fn a_known_renderer_is_called_by_its_name() {
    let call = RendererCall::parse("mitsuba --samples 64").unwrap();
    assert_eq!(call.program, "python3");
    assert_eq!(
        call.arguments[1..],
        [SCENE, SETTINGS, OUTPUT, "--samples", "64"]
    );
    assert!(call.steps == 4 && call.script.unwrap().contains("mi.render"));
    let call = RendererCall::parse("blender --denoise").unwrap();
    assert_eq!(call.program, "blender");
    let own = call.arguments.iter().position(|word| word == "--").unwrap();
    assert_eq!(
        call.arguments[own..],
        ["--", SCENE, SETTINGS, OUTPUT, "--denoise"]
    );
    assert!(call.script.unwrap().contains("bpy.ops.render"));
}

/// An image of two texels, and a photometric file with a batwing distribution, wider across than
/// along.
#[test]
fn projections_and_photometric_files_are_written_with_their_numbers() {
    use footlight_show::geometry::mount::Mount;
    use footlight_show::units::Rgb;
    use footlight_stage::gobo::Gobo;
    use footlight_stage::photometric::Distribution;
    use footlight_stage::{Light, MeasuredLight, Projection};
    let mut setup = lit_floor();
    let mount = Mount {
        position: vec3(0.0, 0.0, 2.0),
        aim: vec3(0.0, 5.0, 2.0),
        turn: 0.0,
    };
    let image = Image::from_data(2, 1, vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).unwrap();
    let file = include_bytes!("../../../examples/luminaires/batwing.ies");
    let distribution = Arc::new(Distribution::parse(file).unwrap());
    Arc::make_mut(&mut setup.rig).lights = vec![
        Light::Projection(Projection {
            mount,
            field: 90.0,
            gobo: Arc::new(Gobo::new(image).unwrap()),
            plane: 1,
            intensity: Rgb([0.0, 700.0, 0.0]),
        }),
        Light::Measured(MeasuredLight {
            mount,
            distribution: Arc::clone(&distribution),
            factor: Rgb([1.0, 0.5, 0.25]),
        }),
    ];
    let (json, binary) = super::scene::files(&setup).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let floats = |grid: &serde_json::Value| -> Vec<f32> {
        let whole = |name: &str| grid[name].as_u64().unwrap() as usize;
        let (at, count) = (whole("offset"), whole("width") * whole("height"));
        let bytes = binary[at..at + 4 * count].chunks(4);
        bytes
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect()
    };
    let thrown = &json["lights"][0];
    assert_eq!(thrown["kind"], "projection");
    assert_eq!(thrown["up"], serde_json::json!([0.0, 0.0, 1.0]));
    let half = |side: usize| thrown["half"][side].as_f64().unwrap();
    assert!((half(0) - 2.0).abs() < 1e-9 && (half(1) - 1.0).abs() < 1e-9);
    assert_eq!(floats(&thrown["image"]), [0.2, 0.5]);
    assert_eq!(super::scene::image_bytes(&setup), 8);
    let measured = &json["lights"][1];
    assert_eq!(measured["kind"], "measured");
    let table = floats(&measured["table"]);
    let end = measured["end"].as_f64().unwrap();
    let (width, height) = (361, 257);
    assert_eq!(table.len(), width * height);
    let mut differ = false;
    for (row, column) in [(0, 0), (100, 0), (100, 90), (180, 300), (256, 360)] {
        let down = end * row as f64 / (height - 1) as f64;
        let around = (column as f64).to_radians();
        let wanted = distribution.intensity(down, around);
        let found = f64::from(table[row * width + column]);
        assert!(
            (found - wanted).abs() < 1e-4 * (1.0 + wanted),
            "{row} {column}"
        );
        differ |= (found - f64::from(table[row * width])).abs() > 1.0;
    }
    assert!(differ);
}

#[test]
fn pictures_without_light_are_told() {
    let render = |light: f64| {
        let outside = outside(move |job| done(3, 2, light * values(job).iter().sum::<f64>()));
        let mut prepared = prepare(&outside, &["a", "b"]).unwrap();
        prepared.render(&[vec![1.0, 0.5]], Work::silent()).unwrap();
        outside.warnings()
    };
    assert_eq!(render(1.0), []);
    assert!(matches!(
        render(0.0)[..],
        [TransportWarning::Black { pictures: 5 }]
    ));
    assert!(matches!(
        render(-1.0)[..],
        [TransportWarning::Negative { pictures: 5 }]
    ));
    assert!(render(0.0)[0].to_string().contains("5 pictures are black"));
}
