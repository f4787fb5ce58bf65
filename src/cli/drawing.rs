//! Images in the terminal, and frames that replace each other.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::draw;
use footlight_picture::terminal::{self, Room};
use footlight_report::film::{Canvas, Shown};

/// Widest image in half blocks, in columns: a wider one shows no more detail, and leaves less text.
const WIDEST: usize = 120;

/// Lines kept free for the input and the reply.
const FREE: usize = 4;

/// Least time between frames: terminals show no more, and fall behind.
const PACE: Duration = Duration::from_millis(50);

/// Drawing methods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// Coloured half blocks.
    Blocks,
    /// Kitty's graphics protocol.
    Kitty,
}

impl Drawing {
    /// Text that draws an image, sized to the current window.
    pub fn draw(self, picture: &Shown) -> String {
        self.drawn(picture, None)
    }

    fn drawn(self, picture: &Shown, number: Option<u32>) -> String {
        let (width, height) = picture.size;
        match self {
            Drawing::Blocks => terminal::half_blocks(width, height, &picture.rgb, self.room()),
            Drawing::Kitty => terminal::kitty(width, height, &picture.rgb, self.room(), number)
                .unwrap_or_else(|error| format!("{error}\n")),
        }
    }

    fn room(self) -> Room {
        let (lines, columns) = console::Term::stdout().size();
        Room {
            columns: usize::from(columns).clamp(20, WIDEST),
            lines: usize::from(lines).saturating_sub(FREE).max(4),
        }
    }
}

/// Number of frames in Kitty's protocol, so that each replaces the one before.
const FRAME: u32 = 1;

/// Frames drawn over each other.
pub struct InPlace {
    drawing: Drawing,
    /// Clears the area of the first frame.
    clear: Box<dyn Fn() + Send>,
    /// When the last frame was drawn, and its height in lines.
    last: Mutex<Option<(Instant, usize)>>,
}

impl InPlace {
    pub fn new(drawing: Drawing, clear: Box<dyn Fn() + Send>) -> InPlace {
        InPlace {
            drawing,
            clear,
            last: Mutex::new(None),
        }
    }
}

impl Canvas for InPlace {
    fn frame(&self, picture: &Shown) -> bool {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let over = match *last {
            // Hide the cursor, which would jump about.
            None => {
                (self.clear)();
                "\x1b[?25l".to_owned()
            }
            Some((drawn, lines)) => {
                std::thread::sleep(PACE.saturating_sub(drawn.elapsed()));
                format!("\x1b[{}A\r", lines.max(1))
            }
        };
        let text = self.drawing.drawn(picture, Some(FRAME));
        *last = Some((Instant::now(), text.matches('\n').count()));
        draw(&(over + &text))
    }

    fn end(&self) {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.take().is_some() {
            draw("\x1b[?25h");
        }
    }
}
