//! Animated PNG: a sequence of 8-bit sRGB frames.
//!
//! Invariants: the same bytes for the same frames; an animation's length is the sequence's to a
//! millisecond, however many frames it has; frames are asked for in the order of time and held one
//! at a time. It plays once, as a show does.

mod pace;

use std::cell::RefCell;
use std::io;
use std::rc::Rc;

use self::pace::{Moment, Pace};
use super::PictureError;
use super::png::{encoder, refused, require_size};

/// What an animation may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The most frames.
    pub frames: usize,
    /// The most bytes.
    pub bytes: usize,
}

impl Default for Limits {
    /// 300 frames and 20 MB.
    fn default() -> Limits {
        Limits {
            frames: 300,
            bytes: 20_000_000,
        }
    }
}

/// An animation that kept its limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation {
    /// The file.
    pub bytes: Vec<u8>,
    /// How many frames it has.
    pub frames: usize,
    /// Frames a second where something moves: what was asked for, or less to keep the limits.
    pub rate: f64,
}

/// The sequence of `duration` seconds as an animated PNG of `size` (width, height). `frame` draws
/// an instant (seconds from the start) as interleaved sRGB bytes.
///
/// `still` lists the stretches (start, end) without change, in any order: each becomes one long
/// frame. Elsewhere `rate` frames a second are drawn, each at the middle of its own time. The rate
/// is lowered until the limits hold; frames are then drawn again.
///
/// # Errors
/// [`PictureError::Size`] for a duration or rate that is not positive and finite, or frames of the
/// wrong size; [`PictureError::Bytes`] when even the fewest frames take too many bytes.
pub fn animate(
    size: (usize, usize),
    duration: f64,
    rate: f64,
    still: &[(f64, f64)],
    frame: &mut dyn FnMut(f64) -> Vec<u8>,
    limits: Limits,
) -> Result<Animation, PictureError> {
    let mut pace = Pace::new(duration, rate, still, limits.frames).ok_or_else(|| {
        PictureError::Size(format!(
            "no animation of {duration} s at {rate} frames a second, {} frames at most",
            limits.frames
        ))
    })?;
    loop {
        let moments = pace.moments();
        match draw(size, &moments, frame, limits.bytes)? {
            Ok(bytes) => {
                return Ok(Animation {
                    bytes,
                    frames: moments.len(),
                    rate: pace.rate(),
                });
            }
            Err(estimate) => {
                // Frames farther apart compress no better: the size goes with their number.
                let wanted = moments.len() as f64 * limits.bytes as f64 / estimate as f64;
                if !pace.slow_to((wanted * 0.97) as usize) {
                    return Err(PictureError::Bytes {
                        needed: estimate,
                        limit: limits.bytes,
                    });
                }
            }
        }
    }
}

/// An animation that kept its limit, or else the bytes that it would have become.
type Drawn = Result<Vec<u8>, usize>;

fn draw(
    (width, height): (usize, usize),
    moments: &[Moment],
    frame: &mut dyn FnMut(f64) -> Vec<u8>,
    limit: usize,
) -> Result<Drawn, PictureError> {
    let mut file = File::new(width, height, moments.len())?;
    for (done, moment) in moments.iter().enumerate() {
        file.push(&frame(moment.at), moment.delay)?;
        let bytes = file.bytes.borrow().len();
        if bytes > limit {
            let estimate = bytes as f64 * moments.len() as f64 / (done + 1) as f64;
            return Ok(Err(estimate as usize));
        }
    }
    let bytes = file.finish()?;
    Ok(match bytes.len() > limit {
        true => Err(bytes.len()),
        false => Ok(bytes),
    })
}

/// A file being written. The writer keeps its target to itself, so the bytes are shared with it to
/// see how many there are.
struct File {
    bytes: Rc<RefCell<Vec<u8>>>,
    writer: ::png::Writer<Sink>,
    size: (usize, usize),
}

impl File {
    fn new(width: usize, height: usize, frames: usize) -> Result<File, PictureError> {
        let bytes = Rc::new(RefCell::new(Vec::new()));
        let mut encoder = encoder(Sink(Rc::clone(&bytes)), width, height)?;
        let count = u32::try_from(frames).map_err(|e| PictureError::Size(e.to_string()))?;
        encoder.set_animated(count, 1).map_err(refused)?;
        Ok(File {
            bytes,
            writer: encoder.write_header().map_err(refused)?,
            size: (width, height),
        })
    }

    fn push(
        &mut self,
        rgb: &[u8],
        (numerator, denominator): (u16, u16),
    ) -> Result<(), PictureError> {
        require_size(self.size.0, self.size.1, rgb)?;
        self.writer
            .set_frame_delay(numerator, denominator)
            .and_then(|()| self.writer.write_image_data(rgb))
            .map_err(refused)
    }

    fn finish(self) -> Result<Vec<u8>, PictureError> {
        self.writer.finish().map_err(refused)?;
        Ok(self.bytes.take())
    }
}

struct Sink(Rc<RefCell<Vec<u8>>>);

impl io::Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use std::io::Cursor;

    /// Every frame's pixels and its delay in seconds.
    fn read(bytes: &[u8]) -> Vec<(Vec<u8>, f64)> {
        let mut reader = ::png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let count = reader.info().animation_control().unwrap().num_frames;
        let mut frames = Vec::new();
        for _ in 0..count {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            let control = reader.info().frame_control().unwrap();
            let delay = f64::from(control.delay_num) / f64::from(control.delay_den);
            frames.push((pixels, delay));
        }
        frames
    }

    fn noise(at: f64, size: usize) -> Vec<u8> {
        let mut state = at.to_bits() | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 24) as u8
        };
        (0..size).map(|_| next()).collect()
    }

    #[test]
    fn frames_come_back_with_their_delays() {
        let mut file = File::new(2, 2, 3).unwrap();
        for (value, delay) in [(3, (1, 25)), (200, (9, 2)), (9, (1, 1))] {
            file.push(&[value; 12], delay).unwrap();
        }
        assert!(file.push(&[0; 18], (1, 1)).is_err());
        let expected = [
            (vec![3; 12], 0.04),
            (vec![200; 12], 4.5),
            (vec![9; 12], 1.0),
        ];
        assert_eq!(read(&file.finish().unwrap()), expected);
        assert!(File::new(2, 2, 0).is_err());
    }

    #[test]
    fn still_stretches_are_one_long_frame() {
        let mut asked = Vec::new();
        let mut draw = |t: f64| {
            asked.push(t);
            vec![(t * 10.0) as u8; 3]
        };
        let still = [(1.0, 9.5), (0.0, 0.5)];
        let made = animate((1, 1), 10.0, 4.0, &still, &mut draw, Limits::default()).unwrap();
        assert_eq!((made.frames, made.rate), (6, 4.0));
        assert_eq!(asked, [0.25, 0.625, 0.875, 5.25, 9.625, 9.875]);
        let delays: Vec<f64> = read(&made.bytes).iter().map(|f| f.1).collect();
        assert_eq!(delays, [0.5, 0.25, 0.25, 8.5, 0.25, 0.25]);
    }

    #[test]
    fn the_rate_falls_to_keep_the_frames() {
        let limits = Limits::default();
        let mut draw = |t: f64| vec![t as u8; 3];
        let made = animate((1, 1), 100.0, 25.0, &[(40.0, 80.0)], &mut draw, limits).unwrap();
        assert!(made.frames <= 300 && made.frames >= 295, "{}", made.frames);
        assert!((made.rate - 299.0 / 60.0).abs() < 0.1, "{}", made.rate);
        let total: f64 = read(&made.bytes).iter().map(|f| f.1).sum();
        assert!((total - 100.0).abs() < 1e-3, "{total}");
    }

    #[test]
    fn the_rate_falls_to_keep_the_bytes() {
        let size = 40 * 30 * 3;
        let limits = Limits {
            frames: 300,
            bytes: 100_000,
        };
        let mut draw = |t: f64| noise(t, size);
        let made = animate((40, 30), 10.0, 25.0, &[], &mut draw, limits).unwrap();
        assert!(made.bytes.len() <= 100_000);
        // About 3.7 kB a frame of noise: not many fewer frames than would fit.
        assert!(made.frames >= 22, "{}", made.frames);
        let again = animate((40, 30), 10.0, 25.0, &[], &mut draw, limits).unwrap();
        assert_eq!(again, made);
        let tiny = Limits {
            frames: 300,
            bytes: 1000,
        };
        let refused = animate((40, 30), 10.0, 25.0, &[], &mut draw, tiny);
        assert!(matches!(
            refused,
            Err(PictureError::Bytes { limit: 1000, .. })
        ));
    }

    #[test]
    fn nonsense_is_refused() {
        let mut draw = |_: f64| vec![0; 3];
        for (duration, rate) in [
            (0.0, 25.0),
            (f64::NAN, 25.0),
            (1.0, 0.0),
            (1.0, f64::INFINITY),
        ] {
            assert!(animate((1, 1), duration, rate, &[], &mut draw, Limits::default()).is_err());
        }
        let mut wrong = |_: f64| vec![0; 4];
        assert!(animate((1, 1), 1.0, 5.0, &[], &mut wrong, Limits::default()).is_err());
    }
}
