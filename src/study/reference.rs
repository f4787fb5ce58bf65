//! Reference pictures in a folder: `BANK.exr`, or the halves `BANK_A.exr` and `BANK_B.exr`.

use std::path::{Path, PathBuf};

use crate::files::{FileError, Store};
use crate::picture::{Image, PictureError, exr};

/// The largest reference file that is read, in bytes.
const LARGEST: u64 = 1 << 30;

/// A picture that is taken for the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The best estimate.
    pub mean: Image,
    /// Two estimates with independent noise, whose mean it is.
    pub halves: Option<[Image; 2]>,
}

/// Why a reference cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// Neither the picture nor both halves are there.
    #[error(
        "`{}` has no reference for {missing}: it needs {bank}.exr, or both {bank}_A.exr and \
         {bank}_B.exr; {has}",
        folder.display()
    )]
    Missing {
        /// Where they were looked for.
        folder: PathBuf,
        /// The first bank without one.
        bank: String,
        /// All of them, in words.
        missing: String,
        /// What is there, in words.
        has: String,
    },
    /// It is no picture.
    #[error("`{}`: {source}", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: PictureError,
    },
    /// It has another size than the view.
    #[error(
        "`{}` is {}x{}, the show's view is {}x{}; give the view that size",
        path.display(), found.0, found.1, expected.0, expected.1
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Its width and height.
        found: (usize, usize),
        /// The view's.
        expected: (usize, usize),
    },
    /// The folder or a file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
}

impl Reference {
    /// One picture, of unknown noise.
    pub fn of(mean: Image) -> Reference {
        Reference { mean, halves: None }
    }

    /// Two halves; `None` when their sizes differ.
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

    /// The references of `banks` in `folder`, all of `size`; halves where there are any.
    ///
    /// # Errors
    /// [`ReferenceError`]; every bank without a reference is named.
    pub fn load(
        store: &dyn Store,
        folder: &Path,
        banks: &[String],
        size: (usize, usize),
        memory: usize,
    ) -> Result<Vec<Reference>, ReferenceError> {
        let files = store.list(folder, ".exr")?;
        let has = |name: &str| files.iter().any(|f| f == name);
        let halves = |bank: &str| has(&format!("{bank}_A.exr")) && has(&format!("{bank}_B.exr"));
        let lacking = |bank: &&String| !halves(bank) && !has(&format!("{bank}.exr"));
        let missing: Vec<&String> = banks.iter().filter(lacking).collect();
        if let Some(first) = missing.first() {
            return Err(ReferenceError::Missing {
                folder: folder.to_owned(),
                bank: first.to_string(),
                missing: some(missing.iter().map(|b| b.as_str()), "no bank"),
                has: match files.is_empty() {
                    true => "it has no .exr file".to_owned(),
                    false => format!("it has {}", some(files.iter().map(String::as_str), "")),
                },
            });
        }
        let open = |name: String| read(store, &folder.join(name), size, memory);
        let load = |bank: &String| {
            if halves(bank) {
                let (a, b) = (
                    open(format!("{bank}_A.exr"))?,
                    open(format!("{bank}_B.exr"))?,
                );
                // Both were just found to be of one size.
                if let Some(reference) = Reference::of_halves(a, b) {
                    return Ok(reference);
                }
            }
            Ok(Reference::of(open(format!("{bank}.exr"))?))
        };
        banks.iter().map(load).collect()
    }
}

fn read(
    store: &dyn Store,
    path: &Path,
    expected: (usize, usize),
    memory: usize,
) -> Result<Image, ReferenceError> {
    let bytes = store.read(path, LARGEST)?;
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

/// The first names of a list, and how many more there are.
fn some<'a>(names: impl ExactSizeIterator<Item = &'a str>, none: &str) -> String {
    const SHOWN: usize = 12;
    let more = names.len().saturating_sub(SHOWN);
    let shown: Vec<&str> = names.take(SHOWN).collect();
    match (shown.is_empty(), more) {
        (true, _) => none.to_owned(),
        (_, 0) => shown.join(", "),
        (_, n) => format!("{} and {n} more", shown.join(", ")),
    }
}
