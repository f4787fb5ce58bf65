//! Commands on files: `fmt` and `diff`, with separate exit codes.

use std::path::{Path, PathBuf};

use super::screen::Screen;
use super::{file_limit, folder_of, print};
use footlight_engine::{self as engine, Document, StageFile, TEXT_LIMIT, Version};
use footlight_host::files::{Disk, Files as _, Folder, Store as _, is_same};
use footlight_prompt::Error;
use footlight_report::{self as report, versions::VersionComparison};

/// Formats files in place, or checks them; 1 when a checked file would change.
pub fn format(files: &[PathBuf], look: bool) -> Result<u8, Error> {
    let mut changed = 0;
    for path in files {
        if lay_out(path, look)? {
            changed += 1;
            let did = if look { "would change" } else { "formatted" };
            print(format!("{did} {}\n", path.display()));
        }
    }
    Ok(u8::from(look && changed > 0))
}

/// Formats a file in its canonical layout, or only checks it; true when the layout differs.
fn lay_out(path: &Path, look: bool) -> Result<bool, Error> {
    let bytes = Disk.read(path, TEXT_LIMIT)?;
    let text = engine::format(&path.display().to_string(), &bytes)?;
    let other = text.as_bytes() != bytes;
    if other && !look {
        Disk.sweep(path.parent().unwrap_or(Path::new("")));
        Disk.edit(path, text.as_bytes())?;
    }
    Ok(other)
}

/// Describes a stage's file.
pub fn stage(path: &Path, memory: usize) -> Result<u8, Error> {
    let files = Folder::new(folder_of(path), file_limit(memory));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stage = StageFile::read(&files, &name, memory)?;
    print(report::stage::describe(&name, &stage));
    Ok(0)
}

/// Two versions of a show.
pub struct Versions<'f> {
    old: &'f Path,
    new: &'f Path,
    /// Original path of the file, when called by git: the given files are copies elsewhere, stage
    /// and includes are next to the original, and git expects exit code 0.
    of_git: Option<&'f Path>,
}

impl<'f> Versions<'f> {
    /// `OLD NEW`, or the seven words of a git diff driver: the file's name, then for the old and
    /// the new side a file, its hash and its mode.
    pub fn of(files: &'f [PathBuf]) -> Result<Versions<'f>, Error> {
        let (old, new, of_git) = match files {
            [old, new] => (old, new, None),
            [name, old, _, _, new, _, _] => (old, new, Some(name.as_path())),
            _ => {
                let message = "say two files: footlight diff OLD.lxq NEW.lxq";
                return Err(Error::Usage(message.to_owned()));
            }
        };
        Ok(Versions { old, new, of_git })
    }

    fn read(&self, path: &Path) -> Result<Version, Error> {
        let name = path.display().to_string();
        let bytes = read(path)?;
        let files = self.folder(path);
        Ok(Version::read(&name, &bytes, &files)?)
    }

    fn folder(&self, path: &Path) -> Folder {
        Folder::new(folder_of(self.of_git.unwrap_or(path)), TEXT_LIMIT)
    }

    /// Refuses to overwrite a version, or a file that one names.
    fn spare(&self, output: &Path) -> Result<(), Error> {
        for path in [self.old, self.new] {
            let files = self.folder(path);
            if output.exists() {
                // Versions are compared without stage and images, which need not exist; existing
                // ones are read here.
                let name = path.display().to_string();
                let _ = Document::new(&name, &read(path)?, &files);
            }
            if is_same(path, output) || files.has_read(output) {
                return Err(report::Error::ShowsFile(output.to_owned()).into());
            }
        }
        Ok(())
    }
}

/// Prints the changes, and whether images stay valid. Exit codes: 0 no changes, 1 changes, 2 error;
/// always 0 for git, which takes any other code for a crash of its driver.
pub fn difference(
    versions: &Versions<'_>,
    output: Option<&Path>,
    screen: &Screen,
) -> Result<u8, Error> {
    if let Some(name) = versions.of_git {
        print(format!("{}\n", name.display()));
    }
    let code = match compare(versions, output) {
        Ok(text) => {
            let changed = !text.is_empty();
            print(text);
            u8::from(changed)
        }
        Err(error) => {
            screen.fail(&error);
            2
        }
    };
    Ok(if versions.of_git.is_some() { 0 } else { code })
}

fn compare(versions: &Versions<'_>, output: Option<&Path>) -> Result<String, Error> {
    if let Some(path) = output {
        versions.spare(path)?;
        Disk.sweep(path.parent().unwrap_or(Path::new("")));
    }
    let old = versions.read(versions.old)?;
    let new = versions.read(versions.new)?;
    let compared = VersionComparison::new(old, new);
    let mut text = compared.text();
    if let Some(path) = output.filter(|_| !text.is_empty()) {
        Disk.output(path, &compared.chart(path)?)?;
        text.push_str(&format!("wrote {}\n", path.display()));
    }
    Ok(text)
}

/// A file's bytes; git passes the null device for a missing side, which means an empty show.
fn read(path: &Path) -> Result<Vec<u8>, Error> {
    if path == Path::new("/dev/null") {
        return Ok(b"show \"\"\n".to_vec());
    }
    Ok(Disk.read(path, TEXT_LIMIT)?)
}
