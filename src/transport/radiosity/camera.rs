//! What the view shows: fragments of facets, the shares of pixels they cover, and visible lights.

mod coverage;
pub mod emitter_mask;
pub mod fragment;
