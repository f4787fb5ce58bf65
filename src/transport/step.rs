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
/// 1,000 faces 16 pixels leave 6.8 % of such a bank and 32 leave 3.9, while more elements or nodes
/// change nothing. Hence the 32 of the fourth; its 3000 elements leave .80 and 2.2 % on the tavern.
/// There, too, a pixel that is stretched on a floor is looked at in quarters: on the stage, bank by
/// bank, .40 % for .51 in a twentieth more time, on the tavern .76 for .80 in a sixth more. At the
/// finest it is the elements that count: on the stage 4000 of them leave 0.38 % whether they see in
/// 24 pixels or in 64 and whether 32,000 nodes gather or 64,000, and 8000 leave 0.24 %. It
/// interpolates no direct light, so that its errors are those of the rest.
pub const STEPS: [Step; 5] = [
    Step {
        elements: 300,
        resolution: 16,
        nodes: 0,
        node_resolution: 0,
        tolerance: 0.04,
        split: Split::Whole,
        stretched_split: Split::Whole,
        edge_split: Split::Halves,
    },
    Step {
        elements: 1000,
        resolution: 16,
        nodes: 0,
        node_resolution: 0,
        tolerance: 0.015,
        split: Split::Whole,
        stretched_split: Split::Whole,
        edge_split: Split::Halves,
    },
    Step {
        elements: 2000,
        resolution: 16,
        nodes: 5000,
        node_resolution: 16,
        tolerance: 0.006,
        split: Split::Whole,
        stretched_split: Split::Whole,
        edge_split: Split::Halves,
    },
    Step {
        elements: 6000,
        resolution: 16,
        nodes: 12000,
        node_resolution: 40,
        tolerance: 0.003,
        split: Split::Whole,
        stretched_split: Split::Halves,
        edge_split: Split::Halves,
    },
    Step {
        elements: 8000,
        resolution: 24,
        nodes: 32000,
        node_resolution: 40,
        tolerance: 0.0,
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
    /// How exactly direct light is interpolated between the picture's fragments, as a share of
    /// its root mean square in the picture; 0 for none.
    pub tolerance: f64,
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
