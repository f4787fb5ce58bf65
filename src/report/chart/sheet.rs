//! A contact sheet: images in a grid, each with a caption.

use super::ChartError;
use super::colour::{Palette, Theme};
use super::drawing::{Drawing, Label, MARGIN, Picture, TITLE};
use super::font;
use super::frame::{Frame, Point};

/// Images to compare.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Title; empty for none.
    pub title: String,
    /// Images in rows from the top left.
    pub tiles: Vec<Tile>,
    /// Images per row; `None` chooses by their number.
    pub columns: Option<usize>,
    /// A last line below the images, such as an explanation of the captions' figures; empty for
    /// none.
    pub legend: String,
}

/// One image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tile {
    /// Columns and rows.
    pub size: (usize, usize),
    /// Display-coded RGB8, row 0 on top.
    pub rgb: Vec<u8>,
    /// Caption: at most two lines, the rest is cut.
    pub caption: String,
}

/// Width of the sheet, unless a given number of columns needs more.
const WIDTH: f32 = 840.0;
const GUTTER: f32 = 12.0;
const CAPTION: f32 = 12.0;
const LINE: f32 = 16.0;
/// Least width of a cell, to hold a caption.
const NARROWEST: f32 = 120.0;
/// Most lines of the legend.
const LEGEND_LINES: usize = 4;

/// Positions of the sheet's parts.
struct Layout {
    columns: usize,
    width: f32,
    /// Size of an image's cell, without its caption.
    cell: (f32, f32),
    caption_lines: usize,
    top: f32,
}

/// Draws the sheet.
///
/// # Errors
/// [`ChartError::Picture`] for the first tile whose bytes do not fit its size.
pub fn sheet(data: &Sheet, theme: Theme) -> Result<Drawing, ChartError> {
    let palette = theme.palette();
    let layout = layout(data);
    let pitch = layout.cell.1 + layout.caption_lines as f32 * LINE + GUTTER + 6.0;
    let rows = data.tiles.len().div_ceil(layout.columns);
    let room = layout.width - 2.0 * MARGIN;
    let legend = font::wrap(&data.legend, CAPTION, room, LEGEND_LINES);
    let foot = layout.top + (rows as f32 * pitch).max(if rows == 0 { 40.0 } else { 0.0 });
    let legend_height = match legend.len() {
        0 => 0.0,
        lines => lines as f32 * LINE + 8.0,
    };
    let height = foot - GUTTER + MARGIN + legend_height;
    let mut drawing = Drawing::titled(&data.title, layout.width, height.ceil(), &palette);
    for (index, tile) in data.tiles.iter().enumerate() {
        let (row, column) = (index / layout.columns, index % layout.columns);
        let x = MARGIN + column as f32 * (layout.cell.0 + GUTTER);
        let y = layout.top + row as f32 * pitch;
        place(&mut drawing, tile, (x, y), layout.cell, &palette)?;
    }
    if data.tiles.is_empty() {
        let at = (MARGIN, layout.top + 16.0);
        drawing.text(Label::new("no pictures", at, CAPTION, palette.quiet));
    }
    for (index, line) in legend.iter().enumerate() {
        let at = (MARGIN, foot - GUTTER + 20.0 + index as f32 * LINE);
        drawing.text(Label::new(line, at, CAPTION, palette.quiet));
    }
    Ok(drawing)
}

fn layout(data: &Sheet) -> Layout {
    let count = data.tiles.len().max(1);
    let columns = data.columns.unwrap_or(match count {
        1..=4 => count.min(2),
        5..=9 => 3,
        10..=24 => 4,
        _ => 5,
    });
    let columns = columns.clamp(1, count);
    let widest = data.tiles.iter().map(|tile| tile.size.0).max().unwrap_or(0);
    let gutters = (columns - 1) as f32 * GUTTER;
    let room = ((WIDTH - 2.0 * MARGIN - gutters) / columns as f32).floor();
    // Enlarged only to hold a caption; wider than the page only if columns are given.
    let cell = room.min(widest as f32).max(NARROWEST);
    // The median height, so that one upright image among many wide ones does not stretch every row.
    let heights = data.tiles.iter().map(|tile| height(tile.size, cell));
    let mut heights: Vec<f32> = heights.collect();
    heights.sort_by(f32::total_cmp);
    let cell_height = heights.get(heights.len() / 2).copied().unwrap_or(0.0);
    let lines = data.tiles.iter();
    let lines = lines.map(|tile| font::wrap(&tile.caption, CAPTION, cell, 2).len());
    let title = font::width(&data.title, TITLE) + 2.0 * MARGIN;
    let width = (2.0 * MARGIN + columns as f32 * cell + gutters).max(title.min(WIDTH));
    Layout {
        columns,
        width: width.ceil(),
        cell: (cell, cell_height),
        caption_lines: lines.max().unwrap_or(0),
        top: MARGIN + if data.title.is_empty() { 0.0 } else { 28.0 },
    }
}

/// Height of an image as wide as the cell, at most three times the width.
fn height((width, height): (usize, usize), cell: f32) -> f32 {
    let ratio = height.max(1) as f32 / width.max(1) as f32;
    (cell * ratio.min(3.0)).ceil().max(1.0)
}

/// Displayed size of an image in a cell; enlarged only by whole numbers, to keep its pixels.
fn shown((width, height): (usize, usize), cell: (f32, f32)) -> (f32, f32) {
    let (width, height) = (width.max(1) as f32, height.max(1) as f32);
    let factor = (cell.0 / width).min(cell.1 / height);
    let factor = if factor > 1.0 { factor.floor() } else { factor };
    (
        (width * factor).round().max(1.0),
        (height * factor).round().max(1.0),
    )
}

fn place(
    drawing: &mut Drawing,
    tile: &Tile,
    (x, y): Point,
    cell: (f32, f32),
    palette: &Palette,
) -> Result<(), ChartError> {
    let picture = Picture::new(tile.size.0, tile.size.1, tile.rgb.clone())?;
    let (width, height) = shown(tile.size, cell);
    drawing.rectangle(Frame::new(x, y, cell.0, cell.1), palette.field);
    let frame = Frame::new(
        x + ((cell.0 - width) / 2.0).floor(),
        y + ((cell.1 - height) / 2.0).floor(),
        width,
        height,
    );
    drawing.picture(frame, picture);
    let lines = font::wrap(&tile.caption, CAPTION, cell.0, 2);
    for (index, line) in lines.iter().enumerate() {
        let at = (x, y + cell.1 + 15.0 + index as f32 * LINE);
        let colour = match index {
            0 => palette.ink,
            _ => palette.quiet,
        };
        drawing.text(Label::new(line, at, CAPTION, colour));
    }
    Ok(())
}
