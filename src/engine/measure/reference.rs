//! Reference images in a folder: `BANK.exr`, or the halves `BANK_A.exr` and `BANK_B.exr`.

use std::path::Path;

use crate::error::ReferenceError;
use footlight_host::files::Store;
use footlight_picture::{Image, exr};

/// Most bytes of a reference file.
const LARGEST: u64 = 1 << 30;

/// An image used as ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The best estimate.
    pub mean: Image,
    /// Two estimates with independent noise; `mean` is their mean.
    pub halves: Option<[Image; 2]>,
}

impl Reference {
    /// A single image of unknown noise.
    pub fn of(mean: Image) -> Reference {
        Reference { mean, halves: None }
    }

    /// A reference from two halves; `None` when their sizes differ.
    pub fn of_halves(a: Image, b: Image) -> Option<Reference> {
        let numbers = a.data().iter().zip(b.data());
        let mean = numbers.map(|(p, q)| 0.5 * (p + q)).collect();
        let same = (a.width(), a.height()) == (b.width(), b.height());
        let mean = Image::from_data(a.width(), a.height(), mean).filter(|_| same)?;
        Some(Reference {
            mean,
            halves: Some([a, b]),
        })
    }

    /// Bytes of its images.
    pub fn bytes(&self) -> usize {
        let pictures = 1 + self.halves.as_ref().map_or(0, |halves| halves.len());
        pictures * size_of_val(self.mean.data())
    }

    /// Loads the references of `banks` in `folder`, all of `size`, in at most `memory` bytes;
    /// halves are preferred.
    ///
    /// # Errors
    /// [`Error::Reference`](crate::Error::Reference); every bank without a reference is named.
    pub fn load(
        store: &dyn Store,
        folder: &Path,
        banks: &[String],
        size: (usize, usize),
        memory: usize,
    ) -> Result<Vec<Reference>, ReferenceError> {
        let files = store.list(folder, ".exr")?;
        let has = |name: &str| files.iter().any(|f| f == name);
        let [one, first, second] =
            [".exr", "_A.exr", "_B.exr"].map(|end| move |bank: &str| [bank, end].concat());
        let halves = |bank: &str| has(&first(bank)) && has(&second(bank));
        let lacking = |bank: &&String| !halves(bank) && !has(&one(bank));
        let missing: Vec<String> = banks.iter().filter(lacking).cloned().collect();
        if let [bank, ..] = missing.as_slice() {
            return Err(ReferenceError::Missing {
                folder: folder.to_owned(),
                bank: bank.clone(),
                missing,
                files,
            });
        }
        let open = |name: String, left| read(store, &folder.join(name), size, left);
        let load = |bank: &String, left: usize| -> Result<Reference, ReferenceError> {
            if halves(bank) {
                let (a, b) = (open(first(bank), left / 3)?, open(second(bank), left / 3)?);
                // Both have equal sizes, as checked before.
                if let Some(reference) = Reference::of_halves(a, b) {
                    return Ok(reference);
                }
            }
            Ok(Reference::of(open(one(bank), left)?))
        };
        let mut left = memory;
        let mut loaded = Vec::with_capacity(banks.len());
        for bank in banks {
            let reference = load(bank, left)?;
            left = left.saturating_sub(reference.bytes());
            loaded.push(reference);
        }
        Ok(loaded)
    }
}

fn read(
    store: &dyn Store,
    path: &Path,
    expected: (usize, usize),
    memory: usize,
) -> Result<Image, ReferenceError> {
    let bytes = store.read(path, LARGEST.min(memory as u64))?;
    let image = exr::decode(&bytes, memory).map_err(|source| ReferenceError::Picture {
        path: path.to_owned(),
        source,
    })?;
    let found = (image.width(), image.height());
    if found != expected {
        return Err(ReferenceError::Size {
            path: path.to_owned(),
            found,
            expected,
        });
    }
    Ok(image)
}
