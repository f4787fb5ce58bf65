//! Pictures in the terminal, and frames in the place of the ones before.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::draw;
use footlight_picture::terminal::{self, Room};
use footlight_report::film::{Canvas, Shown};

/// Widest picture in half blocks, in columns: beyond it one sees no more, only less text.
const WIDEST: usize = 120;

/// Lines that stay free for what was typed and what is printed.
const FREE: usize = 4;

/// A frame is not followed by the next before this: terminals show no more, and fall behind.
const PACE: Duration = Duration::from_millis(50);

/// How pictures are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// Half blocks in colours.
    Blocks,
    /// Kitty's graphics protocol.
    Kitty,
}

impl Drawing {
    /// A picture as text that draws it, sized to the window as it is now.
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

/// The number that frames have in Kitty's protocol, so that each replaces the one before.
const FRAME: u32 = 1;

/// Frames one over the other.
pub struct InPlace {
    drawing: Drawing,
    /// Clears what stands where the first frame goes.
    clear: Box<dyn Fn() + Send>,
    /// When the last frame was drawn, and the lines it took.
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
            // The cursor is hidden while it would jump about.
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
