//! Edits of the source.
