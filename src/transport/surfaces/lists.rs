//! Lists of different lengths in one allocation.

#![allow(
    clippy::indexing_slicing,
    reason = "ends are positions in the items, lists are numbered by the caller"
)]

use std::ops::Range;

/// Numbered lists of items.
#[derive(Clone, Debug)]
pub struct Lists<T> {
    items: Vec<T>,
    ends: Vec<usize>,
}

impl<T> Default for Lists<T> {
    fn default() -> Lists<T> {
        Lists {
            items: Vec::new(),
            ends: Vec::new(),
        }
    }
}

impl<T> Lists<T> {
    /// Empty, with memory for this many items and lists.
    pub fn with_capacity(items: usize, lists: usize) -> Lists<T> {
        Lists {
            items: Vec::with_capacity(items),
            ends: Vec::with_capacity(lists),
        }
    }

    /// Releases unused memory.
    pub fn shrink(&mut self) {
        self.items.shrink_to_fit();
        self.ends.shrink_to_fit();
    }

    /// All lists of several parts, in order.
    pub fn concat(parts: Vec<Lists<T>>) -> Lists<T> {
        let items = parts.iter().map(|p| p.items.len()).sum();
        let ends = parts.iter().map(|p| p.ends.len()).sum();
        let mut out = Lists::with_capacity(items, ends);
        for part in parts {
            let before = out.items.len();
            out.ends.extend(part.ends.iter().map(|end| before + end));
            out.items.extend(part.items);
        }
        out
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.items.as_slice()) + size_of_val(self.ends.as_slice())
    }

    /// Removes all lists and keeps the memory.
    pub fn clear(&mut self) {
        self.items.clear();
        self.ends.clear();
    }

    /// Adds an item to the current list, which [`Lists::end`] closes.
    pub fn add(&mut self, item: T) {
        self.items.push(item);
    }

    /// Closes the current list; returns its index.
    pub fn end(&mut self) -> usize {
        self.ends.push(self.items.len());
        self.ends.len() - 1
    }

    /// Adds a list; returns its index.
    pub fn push(&mut self, items: impl IntoIterator<Item = T>) -> usize {
        self.items.extend(items);
        self.end()
    }

    /// Number of lists.
    pub fn count(&self) -> usize {
        self.ends.len()
    }

    /// The items of all lists.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// The items of all lists, mutable.
    pub fn items_mut(&mut self) -> &mut [T] {
        &mut self.items
    }

    /// Index range of a list's items.
    pub fn range(&self, list: usize) -> Range<usize> {
        let start = list.checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[list]
    }

    /// The items of a list.
    pub fn get(&self, list: usize) -> &[T] {
        &self.items[self.range(list)]
    }
}
