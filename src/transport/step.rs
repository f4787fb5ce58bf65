//! The scale of quality: what each step spends.
//!
//! Every step has the same fragments on edges, so that steps differ by their light alone and the
//! difference between two of them tells something of the error. This room knows no scene.

use crate::transport::eye::{Sampling, Split};
use crate::transport::{Quality, TransportError};

/// The five steps of its scale of quality, each slower and better than the one before on the
/// reference scenes.
///
/// From the third on a facet has a node for each 5 x 5 of its pixels, so that more nodes than those
/// buy little: on the tavern's 22 banks, against the finest, 1000 elements and 8000 nodes leave
/// 1.21 % on average and 4.1 % in the worst, 2000 and 5000 in the same time .94 and 2.7 %. What a
/// node sees of a small bright place decides where all light has been reflected twice: in a room of
/// 1,000 faces, one bank held against 65,536 paths a pixel, 3000 elements and 8000 nodes of 32 pixels
/// leave 4.1 %, 4000 elements 3.3, 6000 elements and 12,000 nodes of 40 pixels 2.7 (2.6 evened out,
/// `radiosity::links`). Hence the fourth, where a pixel that is stretched on a floor is looked at in
/// quarters, too. The finest interpolates no direct light, has all nodes look and cuts every shadow
/// exactly, so that its errors are those of the rest: on the stage .25 %, and .24 with nodes of 64
/// pixels in half as much time again.
///
/// The third and fourth leave out nodes that stand between others (`radiosity::between`). The first
/// two take shadows of panels by samples where several polygons cast them (`mask`): bright rooms behind
/// small windows are lit off by some percent there, in streaks that show when such a light is looked
/// at alone, so that the others cut every shadow exactly. On the tavern, in one run against the same
/// steps without either: .85 of the processor time at the first two, .82 at the third, .95 at the
/// fourth; 2.11 % for 2.09 in the mean of the banks, 1.81 for 1.78, .89 for .88 and .58 for .58.
pub const STEPS: [Step; 5] = [
    Step {
        elements: 300,
        resolution: 16,
        nodes: 0,
        node_resolution: 0,
        reach: 0.0,
        tolerance: 0.04,
        rough: 0.04,
        split: Split::Whole,
        stretched_split: Split::Whole,
        edge_split: Split::Halves,
    },
    Step {
        elements: 1000,
        resolution: 16,
        nodes: 0,
        node_resolution: 0,
        reach: 0.0,
        tolerance: 0.02,
        rough: 0.04,
        split: Split::Whole,
        stretched_split: Split::Whole,
        edge_split: Split::Halves,
    },
    Step {
        elements: 2000,
        resolution: 16,
        nodes: 5000,
        node_resolution: 16,
        reach: 0.07,
        tolerance: 0.015,
        rough: 0.0,
        split: Split::Whole,
        stretched_split: Split::Whole,
        edge_split: Split::Halves,
    },
    Step {
        elements: 6000,
        resolution: 16,
        nodes: 12000,
        node_resolution: 40,
        reach: 0.07,
        tolerance: 0.003,
        rough: 0.0,
        split: Split::Whole,
        stretched_split: Split::Halves,
        edge_split: Split::Halves,
    },
    Step {
        elements: 8000,
        resolution: 24,
        nodes: 32000,
        node_resolution: 40,
        reach: 0.0,
        tolerance: 0.0,
        rough: 0.0,
        split: Split::Halves,
        stretched_split: Split::Halves,
        edge_split: Split::Quarters,
    },
];

/// What a step of quality spends.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Elements aimed at.
    pub elements: usize,
    /// Pixels along the edge of their hemicubes.
    pub resolution: usize,
    /// Cells of the finer grid of a second gather; 0 for none.
    pub nodes: usize,
    /// Pixels along the edge of its hemicubes.
    pub node_resolution: usize,
    /// Nodes that stand nearer to others than this share of the distance over which the light of
    /// those changes take their mean; 0 for none.
    pub reach: f64,
    /// How exactly direct light is interpolated between the picture's fragments, as a share of
    /// its root mean square in the picture; 0 for none.
    pub tolerance: f64,
    /// How wrong a panel's light may be where a shadow's edge crosses it, as a share of what is left
    /// of it; 0 for not at all.
    pub rough: f64,
    /// Fragments along the side of a plain pixel.
    pub split: Split,
    /// The same where the pixel is stretched on what it shows.
    pub stretched_split: Split,
    /// Fragments along the side of a pixel with edges.
    pub edge_split: Split,
}

impl Step {
    /// The step of a quality.
    ///
    /// # Errors
    /// [`TransportError::Quality`] when there is none.
    pub fn of(quality: Quality) -> Result<Step, TransportError> {
        let at = usize::from(quality.0).wrapping_sub(1);
        STEPS
            .get(at)
            .copied()
            .ok_or(TransportError::Quality(quality.0, STEPS.len() as u8))
    }

    /// How its pixels are looked at.
    pub fn sampling(&self) -> Sampling {
        Sampling {
            split: self.split,
            stretched_split: self.stretched_split,
            edge_split: self.edge_split,
        }
    }
}
