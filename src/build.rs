//! Build script: the version of the operator G, made of the code that G is.
//!
//! A stored picture is found by an address that holds this version (see `pool::address`), so it
//! must change whenever a picture could. It is a digest of every
//! source file of the module `radiosity` and of those below that it may import, and of
//! `Cargo.lock` where there is one. A changed comment costs pictures that were still right; a
//! changed formula never finds an old one. Files of tests alone are left out. What it cannot see is
//! a compiler, or in an embedding program an outside crate, that rounds otherwise.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// The modules that decide what a picture looks like: `radiosity` and all that it may import, by
/// the table of `lib.rs`; `tests/layering.rs` compares the two.
pub const MODULES: [&str; 10] = [
    "files",
    "geometry",
    "hash",
    "picture",
    "printable",
    "radiosity",
    "renderer",
    "scene",
    "units",
    "work",
];

#[allow(
    clippy::print_stdout,
    reason = "this is how a build script speaks to cargo"
)]
fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR")?);
    let digest = digest(&root)?;
    println!("cargo::rustc-env=FOOTLIGHT_OPERATOR={digest}");
    for module in MODULES {
        for path in [format!("src/{module}"), format!("src/{module}.rs")] {
            // A path that is missing would make cargo build again each time.
            if root.join(&path).exists() {
                println!("cargo::rerun-if-changed={path}");
            }
        }
    }
    if root.join("Cargo.lock").exists() {
        println!("cargo::rerun-if-changed=Cargo.lock");
    }
    println!("cargo::rerun-if-changed=src/build.rs");
    Ok(())
}

/// The digest of the operator's code in the package at `root`, 32 hexadecimal digits.
///
/// # Errors
/// When a file cannot be read.
pub fn digest(root: &Path) -> Result<String, Box<dyn Error>> {
    let mut files = Vec::new();
    for module in MODULES {
        collect(&root.join("src").join(module), &mut files)?;
        files.push(root.join("src").join(format!("{module}.rs")));
    }
    files.push(root.join("Cargo.lock"));
    files.sort();
    let mut state = OFFSET;
    for path in files.iter().filter(|path| path.is_file()) {
        let name = path
            .strip_prefix(root)?
            .to_string_lossy()
            .replace('\\', "/");
        for part in [name.as_bytes(), &fs::read(path)?] {
            state = add(state, &(part.len() as u64).to_le_bytes());
            state = add(state, part);
        }
    }
    Ok(format!("{state:032x}"))
}

/// The sources below `folder` that are not tests; none where there is no such folder.
fn collect(folder: &Path, out: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            collect(&path, out)?;
        } else if path.extension().is_some_and(|e| e == "rs")
            && stem != "tests"
            && !stem.ends_with("_test")
        {
            out.push(path);
        }
    }
    Ok(())
}

/// Start and prime of the Fowler-Noll-Vo hash 1a of 128 bits: enough against accidents, and a build
/// script that needs no crate.
const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;

fn add(state: u128, bytes: &[u8]) -> u128 {
    let step = |state: u128, byte: &u8| (state ^ u128::from(*byte)).wrapping_mul(PRIME);
    bytes.iter().fold(state, step)
}
