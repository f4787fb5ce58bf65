//! Commands on files alone: `fmt` and `diff`, with exit codes of their own.

use std::path::{Path, PathBuf};

use super::screen::Screen;
use super::{folder_of, print};
use crate::engine::{self, Host, Serving, TEXT_LIMIT, Version};
use crate::files::{Disk, Folder, Store};
use crate::repl::Error;
use crate::report::versions::Comparison;

/// Formats files in place, or looks; 1 when a file was only looked at and would change.
pub fn format(files: &[PathBuf], look: bool) -> Result<u8, Error> {
    let mut changed = 0;
    for path in files {
        if lay_out(path, look)? {
            changed += 1;
            let did = if look { "would change" } else { "formatted" };
            print(&format!("{did} {}\n", path.display()));
        }
    }
    Ok(u8::from(look && changed > 0))
}

/// Brings a file into its canonical layout, or only looks; true where it had another.
fn lay_out(path: &Path, look: bool) -> Result<bool, Error> {
    let bytes = Disk.read(path, TEXT_LIMIT)?;
    let text = engine::format(&path.display().to_string(), &bytes)?;
    let other = text.as_bytes() != bytes;
    if other && !look {
        Disk.write(path, text.as_bytes())?;
    }
    Ok(other)
}

/// Prints what changed, and how many of the host's pictures serve on. 0: nothing, 1: something, 2:
/// it cannot be told; for git, which takes any other code for a crash of its driver, always 0.
pub fn difference(
    files: &[PathBuf; 2],
    output: Option<&Path>,
    of_git: Option<&str>,
    (host, screen): (&Host, &Screen),
) -> Result<u8, Error> {
    if let Some(name) = of_git {
        print(&format!("{name}\n"));
    }
    // Git hands over copies in a folder of its own; what they include lies beside the original.
    let beside = |path: &Path| Folder::new(folder_of(of_git.map_or(path, Path::new)), TEXT_LIMIT);
    let code = match compare(files, output, beside, host) {
        Ok(text) => {
            print(&text);
            u8::from(!text.is_empty())
        }
        Err(error) => {
            screen.fail(&error);
            2
        }
    };
    Ok(if of_git.is_some() { 0 } else { code })
}

fn compare(
    [old, new]: &[PathBuf; 2],
    output: Option<&Path>,
    beside: impl Fn(&Path) -> Folder,
    host: &Host,
) -> Result<String, Error> {
    let (a, b) = (read(old)?, read(new)?);
    let names = [old, new].map(|p| p.display().to_string());
    let old = Version::read(&names[0], &a, &beside(old))?;
    let new = Version::read(&names[1], &b, &beside(new))?;
    let serving = Serving::in_store(&old, &new, host);
    let mut compared = Comparison::new(old, new);
    compared.serving = Some(serving);
    let mut text = compared.text();
    if let Some(path) = output.filter(|_| !text.is_empty()) {
        Disk.write(path, &compared.chart(path)?)?;
        text.push_str(&format!("wrote {}\n", path.display()));
    }
    Ok(text)
}

/// A file's bytes; git gives the null device for a side that does not exist, which is the show
/// without anything in it.
fn read(path: &Path) -> Result<Vec<u8>, Error> {
    if path == Path::new("/dev/null") {
        return Ok(b"show \"\"\n".to_vec());
    }
    Ok(Disk.read(path, TEXT_LIMIT)?)
}
