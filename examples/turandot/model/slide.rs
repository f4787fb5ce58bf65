//! The two scenic projections: one landscape of hills under a sky at dusk and at night.
//!
//! Colours are mixed display-coded, as a painter mixes. Only sums, products and square roots are
//! used, and clouds come from hashed integers, so that every machine paints equal pixels.

/// Columns.
pub const WIDTH: usize = 640;
/// Rows.
pub const HEIGHT: usize = 280;

type Colour = [f64; 3];

/// RGB at dusk, 8 bits per channel, row by row from the top.
pub fn dusk() -> Vec<u8> {
    let sky = [
        (0.0, [0.22, 0.20, 0.36]),
        (0.25, [0.46, 0.27, 0.40]),
        (0.45, [0.80, 0.37, 0.30]),
        (0.62, [1.0, 0.56, 0.24]),
        (0.8, [1.0, 0.76, 0.40]),
    ];
    paint(|u, v| {
        let mut colour = gradient(&sky, v + 0.05 * (fractal(u * 3.0, v * 6.0, 5) - 0.5));
        let sun = halo(u, v, [0.640, 0.50]);
        colour = mix(colour, [1.0, 0.80, 0.45], (0.9 * sun).min(0.9));
        colour = mix(colour, [1.0, 0.97, 0.80], disc(u, v, [0.640, 0.50], 0.020));
        let cloud = clouds(u, v);
        // Lit from below, by the setting sun.
        colour = mix(colour, [0.42, 0.20, 0.30], 0.62 * cloud * (1.0 - 0.7 * v));
        let edge = (clouds(u, v + 0.012) - cloud).clamp(0.0, 1.0);
        colour = mix(colour, [1.0, 0.72, 0.42], (2.2 * edge).min(0.8));
        hills(u, v, colour, [0.62, 0.30, 0.27], [0.20, 0.10, 0.16])
    })
}

/// RGB at night, 8 bits per channel, row by row from the top.
pub fn night() -> Vec<u8> {
    let sky = [
        (0.0, [0.035, 0.07, 0.22]),
        (0.3, [0.06, 0.13, 0.36]),
        (0.55, [0.12, 0.26, 0.55]),
        (0.8, [0.26, 0.46, 0.74]),
    ];
    paint(|u, v| {
        let mut colour = gradient(&sky, v + 0.04 * (fractal(u * 3.0, v * 6.0, 5) - 0.5));
        let moon = [0.335, 0.27];
        colour = mix(
            colour,
            [0.62, 0.76, 0.95],
            (0.75 * halo(u, v, moon)).min(0.75),
        );
        let cloud = clouds(u, v);
        let star = star(u, v) * (1.0 - cloud).max(0.0) * (1.0 - v);
        colour = mix(colour, [0.95, 0.97, 1.0], star);
        colour = mix(colour, [1.0, 0.98, 0.90], disc(u, v, moon, 0.030));
        colour = mix(colour, [0.20, 0.30, 0.52], 0.5 * cloud);
        let edge = (clouds(u, v - 0.012) - cloud).clamp(0.0, 1.0);
        colour = mix(colour, [0.55, 0.70, 0.92], (1.6 * edge).min(0.5));
        hills(u, v, colour, [0.11, 0.20, 0.40], [0.02, 0.04, 0.12])
    })
}

fn paint(colour: impl Fn(f64, f64) -> Colour) -> Vec<u8> {
    let mut out = Vec::with_capacity(WIDTH * HEIGHT * 3);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let u = (x as f64 + 0.5) / WIDTH as f64;
            let v = (y as f64 + 0.5) / HEIGHT as f64;
            out.extend(colour(u, v).map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8));
        }
    }
    out
}

fn mix(a: Colour, b: Colour, t: f64) -> Colour {
    let ([ar, ag, ab], [br, bg, bb]) = (a, b);
    [ar + t * (br - ar), ag + t * (bg - ag), ab + t * (bb - ab)]
}

/// Interpolates between colour stops, constant beyond the first and the last.
fn gradient(stops: &[(f64, Colour)], v: f64) -> Colour {
    let mut out = stops.first().map_or([0.0; 3], |s| s.1);
    for ((from, a), (to, b)) in stops.iter().zip(stops.iter().skip(1)) {
        if v >= *from {
            let t = ((v - from) / (to - from)).min(1.0);
            out = mix(*a, *b, t * t * (3.0 - 2.0 * t));
        }
    }
    out
}

/// Squared distance in slide heights.
fn square(u: f64, v: f64, [cu, cv]: [f64; 2]) -> f64 {
    let (x, y) = ((u - cu) * WIDTH as f64 / HEIGHT as f64, v - cv);
    x * x + y * y
}

fn halo(u: f64, v: f64, at: [f64; 2]) -> f64 {
    let r = square(u, v, at);
    0.55 / (1.0 + 40.0 * r) / (1.0 + 6.0 * r) + 0.45 / (1.0 + 900.0 * r)
}

/// 1 inside, 0 outside, with an edge one pixel wide.
fn disc(u: f64, v: f64, at: [f64; 2], radius: f64) -> f64 {
    let off = (radius - square(u, v, at).sqrt()) * HEIGHT as f64;
    (off + 0.5).clamp(0.0, 1.0)
}

/// Long streaks, thicker in the middle of the sky.
fn clouds(u: f64, v: f64) -> f64 {
    let bent = v + 0.06 * (fractal(u * 2.0 + 7.0, v * 2.0, 3) - 0.5);
    let streak = fractal(u * 4.5 + 3.0, bent * 20.0, 5);
    let bank = 1.0 - (2.4 * (v - 0.36)) * (2.4 * (v - 0.36));
    ((streak - 0.50) * 4.0 * bank.max(0.0)).clamp(0.0, 1.0)
}

/// Three ridges, paler with distance.
fn hills(u: f64, v: f64, sky: Colour, far: Colour, near: Colour) -> Colour {
    let mut colour = sky;
    for (i, (base, tall, wide)) in [(0.66, 0.20, 3.0), (0.74, 0.20, 4.5), (0.84, 0.16, 6.0)]
        .into_iter()
        .enumerate()
    {
        let ridge = base - tall * (fractal(u * wide + 11.0 * i as f64, 0.5, 6) - 0.42);
        let edge = ((v - ridge) * HEIGHT as f64 + 0.5).clamp(0.0, 1.0);
        let tone = mix(far, near, 0.5 * i as f64);
        // Haze lies in the valleys.
        let haze = (1.0 - (v - ridge) * 7.0).clamp(0.0, 1.0);
        colour = mix(colour, mix(mix(tone, sky, 0.22), tone, haze), edge);
    }
    colour
}

/// A hash from 0 to 1 for each pair of integers.
fn hash(x: i64, y: i64) -> f64 {
    let mut n = (x.wrapping_mul(374_761_393) ^ y.wrapping_mul(668_265_263)) as u64;
    n = (n ^ (n >> 13)).wrapping_mul(1_274_126_177);
    n = (n ^ (n >> 16)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (n >> 40) as f64 / (1_u64 << 24) as f64
}

/// Smooth noise between the hashes of a grid's corners.
fn noise(x: f64, y: f64) -> f64 {
    let (i, j) = (x.floor(), y.floor());
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (ease(x - i), ease(y - j));
    let at = |dx: i64, dy: i64| hash(i as i64 + dx, j as i64 + dy);
    let low = at(0, 0) + s * (at(1, 0) - at(0, 0));
    let high = at(0, 1) + s * (at(1, 1) - at(0, 1));
    low + t * (high - low)
}

/// Octaves of noise, each half as strong.
fn fractal(x: f64, y: f64, octaves: u32) -> f64 {
    let (mut sum, mut all, mut weight, mut scale) = (0.0, 0.0, 1.0, 1.0);
    for octave in 0..octaves {
        let shift = 17.0 * f64::from(octave);
        sum += weight * noise(x * scale + shift, y * scale - shift);
        all += weight;
        weight *= 0.5;
        scale *= 2.0;
    }
    sum / all
}

/// A star or none: one cell of a grid in thirty has one, of random brightness.
fn star(u: f64, v: f64) -> f64 {
    let (x, y) = (u * 160.0, v * 70.0);
    let (i, j) = (x.floor(), y.floor());
    let seed = |n: i64| hash(i as i64 + 1000 * n, j as i64 - 500 * n);
    if seed(1) > 0.035 {
        return 0.0;
    }
    let (dx, dy) = (x - i - 0.25 - 0.5 * seed(2), y - j - 0.25 - 0.5 * seed(3));
    let near = 1.0 - (dx * dx + dy * dy) * 12.0;
    near.max(0.0) * (0.35 + 0.65 * seed(4))
}
