#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use super::*;
use footlight_picture::png::encode;

/// A pattern of black and white cells of `cell` texels.
fn checked(size: [usize; 2], cell: usize) -> Texture {
    let code = |i: usize| {
        let (x, y) = (i % size[0] / cell, i / size[0] / cell);
        let v = if (x + y) % 2 == 0 { 255 } else { 0 };
        [v, v, v, 255]
    };
    let codes: Vec<[u8; 4]> = (0..size[0] * size[1]).map(code).collect();
    Texture {
        pixels: Arc::new(Pixels::new(size, &codes)),
        ..Texture::plain([1.0; 4], Alpha::Opaque)
    }
}

#[test]
fn texels_stand_at_their_centres_and_the_image_repeats() {
    let texture = checked([4, 4], 1);
    let at = |u: f64, v: f64| texture.reflectance([u, v], [[0.0; 2]; 2])[0];
    for whole in [-3.0, 0.0, 2.0] {
        assert!((at(whole + 0.125, 0.125) - 1.0).abs() < 1e-4);
        assert!(at(whole + 0.375, 0.125) < 1e-4);
        assert!((at(whole + 0.25, 0.125) - 0.5).abs() < 1e-4);
    }
    assert_eq!(wrapped(-1.0, 4, Wrap::Mirror), 0);
    assert_eq!(wrapped(4.0, 4, Wrap::Mirror), 3);
    assert_eq!(wrapped(9.0, 4, Wrap::Clamp), 3);
    assert_eq!(wrapped(f64::NAN, 4, Wrap::Repeat), 0);
}

#[test]
fn a_footprint_is_averaged_along_its_longer_side_only() {
    // Rows of one texel: grey when averaged across them, black or white along them.
    let rows: Vec<[u8; 4]> = (0..64 * 64)
        .map(|i| {
            if (i / 64) % 2 == 0 {
                [255; 4]
            } else {
                [0, 0, 0, 255]
            }
        })
        .collect();
    let texture = Texture {
        pixels: Arc::new(Pixels::new([64, 64], &rows)),
        ..Texture::plain([1.0; 4], Alpha::Opaque)
    };
    let place = [0.5, 0.5 / 64.0];
    let along = texture.reflectance(place, [[0.2, 0.0], [0.0, 0.2 / 64.0]]);
    assert!(along[0] > 0.99, "{along:?}");
    let across = texture.reflectance(place, [[1.0 / 64.0, 0.0], [0.0, 0.25]]);
    assert!((across[0] - 0.5).abs() < 0.05, "{across:?}");
}

/// Noise under rotated footprints of 0.3 to 6 texels, up to six times as long as wide, against the
/// mean of 2304 samples of each. A single sample of a level as wide as the footprint errs by 9.5 %
/// at one texel, 11 % at two.
#[test]
fn footprints_as_fine_as_the_image_see_its_mean() {
    let mut state = 1_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / (1_u64 << 24) as f64
    };
    let codes: Vec<[u8; 4]> = (0..128 * 128)
        .map(|_| {
            if random() < 0.5 {
                [255; 4]
            } else {
                [0, 0, 0, 255]
            }
        })
        .collect();
    let texture = Texture {
        pixels: Arc::new(Pixels::new([128, 128], &codes)),
        ..Texture::plain([1.0; 4], Alpha::Opaque)
    };
    for (texels, most) in [
        (0.3, 0.02),
        (0.7, 0.02),
        (1.0, 0.03),
        (1.5, 0.04),
        (3.0, 0.06),
        (6.0, 0.05),
    ] {
        for stretch in [1.0, 2.5, 6.0] {
            let mut square = 0.0;
            for _ in 0..100 {
                let place = [random(), random()];
                let (sin, cos) = (std::f64::consts::TAU * random()).sin_cos();
                let wide = texels / 128.0;
                let sides = [
                    [wide * stretch * cos, wide * stretch * sin],
                    [-wide * sin, wide * cos],
                ];
                let part = |i: usize| (i as f64 + 0.5) / 48.0 - 0.5;
                let mut exact = 0.0;
                for i in 0..48 * 48 {
                    let (s, t) = (part(i % 48), part(i / 48));
                    let at = [0, 1].map(|k| place[k] + s * sides[0][k] + t * sides[1][k]);
                    exact += texture.reflectance(at, [[0.0; 2]; 2])[0] / (48.0 * 48.0);
                }
                square += (texture.reflectance(place, sides)[0] - exact).powi(2) / 100.0;
            }
            assert!(
                square.sqrt() < most,
                "{texels} {stretch}: {}",
                square.sqrt()
            );
        }
    }
}

#[test]
fn means_are_of_light_and_large_images_are_halved() {
    for size in [[1, 1], [7, 5], [64, 3], [4096, 2]] {
        let texture = checked(size, 1);
        let white = (0..size[0] * size[1])
            .filter(|i| (i % size[0] + i / size[0]) % 2 == 0)
            .count();
        let exact = white as f64 / (size[0] * size[1]) as f64;
        let mean = texture.mean_reflectance()[0];
        assert!((mean - exact).abs() < 1e-3, "{size:?} {mean} {exact}");
        assert!(texture.pixels.size().iter().all(|n| *n <= MOST_SIDE));
    }
}

#[test]
fn what_is_transparent_lends_no_colour() {
    let codes = [[255, 0, 0, 255], [0, 255, 0, 0]];
    let pixels = Arc::new(Pixels::new([2, 1], &codes));
    let texture = |alpha| Texture {
        pixels: Arc::clone(&pixels),
        ..Texture::plain([1.0; 4], alpha)
    };
    let [r, g, _] = texture(Alpha::Blend).mean_reflectance();
    assert!((r - 1.0).abs() < 1e-3 && g < 1e-3);
    assert!(texture(Alpha::Blend).is_cut() && !texture(Alpha::Opaque).is_cut());
    let mask = texture(Alpha::Mask(0.5));
    assert!(mask.opacity([0.25, 0.5]) == 1.0 && mask.opacity([0.75, 0.5]) == 0.0);
    let half = texture(Alpha::Blend).opacity([0.5, 0.5]);
    assert!((0.4..0.6).contains(&half), "{half}");
    assert!(!Texture::plain([1.0; 4], Alpha::Blend).is_cut());
}

/// A 256 x 256 image takes 0.98 MB to decode and 0.70 MB to keep. Only kept images limit the
/// number, and the message about the first refused one gives a way out.
#[test]
fn images_are_read_while_what_is_left_holds_one_more() {
    let png = encode(256, 256, &[200; 256 * 256 * 3]).unwrap();
    let mut reader = reader::TextureReader::new(6_600_000);
    let mut read =
        |i: usize| reader.read(&i.to_string(), reader::Channels::All, || Ok(png.clone()));
    let taken = (0..20).take_while(|i| read(*i).is_ok()).count();
    assert_eq!(taken, 9);
    let said = read(20).unwrap_err();
    assert_eq!(
        said,
        "256 x 256 pixels need 1.0 MB to be read, and 0.3 MB are left for textures; make the image \
         smaller, or allow more with `--memory 8`"
    );
    // Nine kept and two refused so far; another needs more. Beyond the fixed limit of textures no
    // memory helps.
    let said = read(21).unwrap_err();
    assert!(said.ends_with("or allow more with `--memory 9`"), "{said}");
    let much = (22..1200).filter_map(|i| read(i).err()).last().unwrap();
    assert!(much.ends_with("make the image smaller"), "{much}");
}
