#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use super::*;
use footlight_picture::Image;
use footlight_picture::tone::Tone;
use footlight_show::timeline::blend;
use footlight_show::units::ToneCurve;
use proptest::prelude::*;

const TONE: Tone = Tone {
    exposure: -1.3,
    curve: ToneCurve::Filmic,
};

/// Four different images with darks, lights and lamps; with negative values on request.
fn pictures((width, height): (usize, usize), negative: bool) -> Vec<Image> {
    let channel = |picture: usize, i: usize| {
        let noise = (i * 7919 + picture * 104_729) % 10_007;
        let light = (noise as f32 / 10_007.0).powi(3) * 8.0;
        let lamp = if noise % 400 == 7 { 60.0 } else { 1.0 };
        let sign = if negative && noise % 5 == 2 {
            -0.3
        } else {
            1.0
        };
        light * lamp * sign
    };
    let picture = |p| (0..width * height * 3).map(|i| channel(p, i)).collect();
    let pictures = (0..4).map(|p| Image::from_data(width, height, picture(p)).unwrap());
    pictures.collect()
}

fn channels(images: &[Image]) -> Vec<&[f32]> {
    images.iter().map(Image::data).collect()
}

/// Light and bytes of a blend.
fn frame(images: &[Image], factors: Factors, threads: usize) -> (Vec<f32>, Vec<u8>) {
    let keys = channels(images);
    let count = keys[0].len();
    let (mut light, mut bytes) = (vec![7.0; count], vec![7; count]);
    super::blend(&keys, factors, BlendTarget::Light(&mut light), threads);
    let table = TONE.table();
    super::blend(
        &keys,
        factors,
        BlendTarget::Bytes(&mut bytes, &table),
        threads,
    );
    (light, bytes)
}

/// Every degree on an image of a fractional number of blocks, against double precision, with bytes
/// against the thresholds' own encoder.
#[test]
fn a_frame_is_the_blend_of_its_keys() {
    let size = (37, 11);
    for images in [pictures(size, false), pictures(size, true)] {
        for degree in 0..4 {
            let blend = blend(degree, 0.37);
            let (light, bytes) = frame(&images, Factors::new(blend), 1);
            let shown = TONE.encode(&Image::from_data(37, 11, light.clone()).unwrap());
            assert_eq!(bytes, shown, "{degree}");
            for (i, light) in light.iter().enumerate() {
                let weighed = |(w, k): (f64, &Image)| w * f64::from(k.data()[i]);
                let terms = blend.weights().into_iter().zip(&images).map(weighed);
                let terms: Vec<f64> = terms.collect();
                let scale: f64 = terms.iter().map(|t| t.abs()).sum();
                let off = (f64::from(*light) - terms.iter().sum::<f64>()).abs();
                assert!(off <= 5e-7 * scale, "{degree}: {off:e} of {scale:e}");
            }
        }
    }
}

/// Equal bits for every instruction set and number of threads.
#[test]
fn frames_do_not_depend_on_processor_or_threads() {
    let images = pictures((640, 331), true);
    let keys = channels(&images);
    for degree in 0..4 {
        let factors = Factors::new(blend(degree, 0.81));
        let (light, bytes) = frame(&images, factors, 1);
        let (mut plain, mut shown) = (vec![0.0; light.len()], vec![0; light.len()]);
        plainly(&keys, factors, BlendTarget::Light(&mut plain));
        plainly(
            &keys,
            factors,
            BlendTarget::Bytes(&mut shown, &TONE.table()),
        );
        let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<u32>>();
        assert!(bits(&light) == bits(&plain) && bytes == shown, "{degree}");
        for threads in [2, 3, 64] {
            let (more, shown) = frame(&images, factors, threads);
            assert!(bits(&more) == bits(&light) && shown == bytes, "{threads}");
        }
    }
}

#[test]
fn where_keys_agree_lerps_keep_them_to_the_bit() {
    let one = pictures((16, 16), true).swap_remove(2);
    let keys = vec![one.clone(); 4];
    for t in [0.0, 0.1, 0.5, 0.77, 1.0] {
        assert_eq!(frame(&keys, Factors::new(blend(3, t)), 1).0, one.data());
    }
}

#[test]
fn keys_that_are_missing_or_short_do_no_harm() {
    let images = pictures((8, 8), false);
    // Three blends of two keys: nothing is written.
    let (_, bytes) = frame(&images[..2], Factors::new(blend(3, 0.5)), 1);
    assert!(bytes.iter().all(|b| *b == 7));
    let short = Image::from_data(1, 1, vec![9.0; 3]).unwrap();
    let (light, _) = frame(&[Image::new(8, 8), short], Factors::new(blend(1, 1.0)), 1);
    assert_eq!(light, [0.0; 192]);
}

proptest! {
    /// For any keys and any moment, light stays between the darkest and the brightest key of a
    /// channel.
    #[test]
    fn a_blend_stays_between_its_keys(seed: u32, t in 0.0..1.0_f64, degree in 1_usize..4) {
        let pictures: Vec<Image> = (0..4_u32)
            .map(|p| {
                let bits = |i: u32| (seed ^ (p * 977 + i).wrapping_mul(2_654_435_761)) % 4096;
                let data = (0..48).map(|i| (bits(i) as f32 - 300.0) / 512.0).collect();
                Image::from_data(4, 4, data).unwrap()
            })
            .collect();
        let (light, _) = frame(&pictures, Factors::new(blend(degree, t)), 1);
        for (i, light) in light.iter().enumerate() {
            let values: Vec<f32> = pictures[..=degree].iter().map(|k| k.data()[i]).collect();
            let least = values.iter().copied().fold(f32::MAX, f32::min);
            let most = values.iter().copied().fold(f32::MIN, f32::max);
            prop_assert!(*light >= least - 1e-5 && *light <= most + 1e-5, "{light} {values:?}");
        }
    }
}
