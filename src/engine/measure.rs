//! Measurements of the operator and of playback on a show: typed results, against references or
//! against the finest step.

mod compare;
mod playback;
mod quality;
mod trial;
mod tune;
