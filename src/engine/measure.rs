//! Measurements of the operator on a show: typed results, against references or against the finest
//! step.

mod compare;
mod quality;
mod trial;
mod tune;
