//! Build script: computes the version of the operator G as a digest of its code.
//!
//! The address of a stored image holds this version (`footlight-engine`, module `pool::address`),
//! so it must change whenever an image could. The digest covers the sources of `transport`, `stage`
//! and `picture`, the mathematics of `show` that they use, and the versions of their external
//! dependencies in `Cargo.lock`. Tests and external renderers are excluded; the latter have
//! versions of their own. A changed comment discards valid images; a changed formula never reuses a
//! stale one. The digest does not cover compilers, nor the dependencies that an embedding program
//! selects.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// Sources below `src` that determine images.
const SOURCES: [&str; 8] = [
    "transport",
    "stage",
    "picture",
    "show/geometry",
    "show/geometry.rs",
    "show/hash.rs",
    "show/units",
    "show/units.rs",
];
/// Crate whose dependencies are included.
const OPERATOR: &str = "footlight-transport";

#[allow(
    clippy::print_stdout,
    reason = "this is how a build script speaks to cargo"
)]
fn main() -> Result<(), Box<dyn Error>> {
    let own = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR")?);
    let root = own.join("../..");
    println!("cargo::rustc-env=FOOTLIGHT_OPERATOR={}", digest(&root)?);
    let sources = SOURCES.map(|source| root.join("src").join(source));
    for path in sources.iter().chain([&root.join("Cargo.lock")]) {
        // Cargo would rebuild every time for a missing path.
        if path.exists() {
            println!("cargo::rerun-if-changed={}", path.display());
        }
    }
    Ok(())
}

/// Digest of the operator's code in the workspace at `root`, 32 hexadecimal digits.
///
/// # Errors
/// When a file cannot be read.
fn digest(root: &Path) -> Result<String, Box<dyn Error>> {
    let mut files = Vec::new();
    for source in SOURCES {
        collect(&root.join("src").join(source), &mut files)?;
    }
    files.sort();
    let mut state = OFFSET;
    for path in &files {
        let name = path.strip_prefix(root)?.to_string_lossy();
        for part in [name.replace('\\', "/").as_bytes(), &fs::read(path)?] {
            state = add(state, &(part.len() as u64).to_le_bytes());
            state = add(state, part);
        }
    }
    let lock = root.join("Cargo.lock");
    if lock.is_file() {
        for package in below(&fs::read_to_string(lock)?) {
            state = add(state, package.as_bytes());
        }
    }
    Ok(format!("{state:032x}"))
}

/// Collects the sources at `path` except tests and external renderers; none when `path` is missing.
fn collect(path: &Path, out: &mut Vec<PathBuf>) -> Result<(), Box<dyn Error>> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    if stem == "tests" || stem == "outside" || stem.ends_with("_test") {
        return Ok(());
    }
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), out)?;
        }
    } else if path.extension().is_some_and(|e| e == "rs") {
        out.push(path.to_owned());
    }
    Ok(())
}

/// Name and version of every package of a lock file that the operator depends on, directly or not.
fn below(lock: &str) -> BTreeSet<String> {
    let mut packages: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for package in lock.split("[[package]]").skip(1) {
        let value = |key: &str| {
            let line = package.lines().find(|line| line.starts_with(key))?;
            line.split('"').nth(1)
        };
        let listed = package.split("dependencies = [").nth(1).unwrap_or_default();
        let mut all: Vec<&str> = listed.split('"').skip(1).step_by(2).collect();
        all.extend(value("version = "));
        packages
            .entry(value("name = ").unwrap_or_default())
            .or_default()
            .extend(all);
    }
    let mut out = BTreeSet::new();
    let mut open = vec![OPERATOR];
    let mut seen = BTreeSet::new();
    while let Some(name) = open.pop() {
        if !seen.insert(name) {
            continue;
        }
        for word in packages.get(name).into_iter().flatten() {
            let dependency = word.split(' ').next().unwrap_or_default();
            if packages.contains_key(dependency) {
                open.push(dependency);
            } else {
                out.insert(format!("{name} {word}"));
            }
        }
    }
    out
}

/// Offset basis and prime of the 128-bit FNV-1a hash: sufficient against accidental collisions, and
/// needs no crate.
const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;

fn add(state: u128, bytes: &[u8]) -> u128 {
    let step = |state: u128, byte: &u8| (state ^ u128::from(*byte)).wrapping_mul(PRIME);
    bytes.iter().fold(state, step)
}
