//! Images of light: a bank or the fixed lights, rendered elsewhere.
//!
//! Invariants: every number is finite, and all images together fit the caller's budget. The caller
//! checks that sizes agree with each other and with the view. A file is recognised by its first
//! bytes, never by its name.

use std::collections::BTreeMap;
use std::sync::Arc;

use footlight_host::files::{FileError, Files};
use footlight_picture::exr::layer;
use footlight_picture::{Image, PictureError, decode};
use footlight_show::model::ImageFile;

/// Images by file and layer.
pub type StillImages = BTreeMap<ImageFile, Arc<Image>>;

/// Reason why an image cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It holds no image, or not this one.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// An image that cannot be used, and the reason.
pub type Refused = (ImageFile, ImageError);

/// Reads the `wanted` images, each file once, except those in `known`. OpenEXR holds linear light;
/// PNG is sRGB-coded and converted to linear. All together take at most `budget` bytes.
///
/// # Errors
/// Every image that cannot be used, with the reason.
pub fn read(
    files: &dyn Files,
    wanted: &[ImageFile],
    known: &StillImages,
    budget: usize,
) -> Result<StillImages, Vec<Refused>> {
    let mut images = StillImages::new();
    let mut missing: BTreeMap<&str, Vec<&ImageFile>> = BTreeMap::new();
    for file in wanted {
        if let Some(image) = known.get(file) {
            images.insert(file.clone(), Arc::clone(image));
            continue;
        }
        let of_file = missing.entry(&file.path).or_default();
        if !of_file.contains(&file) {
            of_file.push(file);
        }
    }
    let mut left = budget.saturating_sub(images.values().map(|i| bytes(i)).sum());
    let mut refused = Vec::new();
    for (path, wanted) in missing {
        let read = match decoded(files, path, &wanted, left) {
            Ok(read) => read,
            Err(error) => {
                // A fault of the whole file is reported once.
                refused.extend(wanted.first().map(|file| ((*file).clone(), error)));
                continue;
            }
        };
        for (file, image) in wanted.into_iter().zip(read) {
            match image {
                Ok(image) => {
                    left = left.saturating_sub(bytes(&image));
                    images.insert(file.clone(), Arc::new(image));
                }
                Err(error) => refused.push((file.clone(), error.into())),
            }
        }
    }
    if refused.is_empty() {
        Ok(images)
    } else {
        Err(refused)
    }
}

fn bytes(image: &Image) -> usize {
    size_of_val(image.data())
}

fn decoded(
    files: &dyn Files,
    path: &str,
    wanted: &[&ImageFile],
    limit: usize,
) -> Result<Vec<Result<Image, PictureError>>, ImageError> {
    let bytes = files.read(path)?;
    if bytes.starts_with(b"\x76\x2f\x31\x01") {
        let layers: Vec<Option<&str>> = wanted.iter().map(|f| f.layer.as_deref()).collect();
        return Ok(layer::decode(&bytes, &layers, limit)?);
    }
    if !decode::is_read(&bytes) {
        return Err(ImageError::Picture(PictureError::Malformed {
            format: "OpenEXR or PNG",
            reason: "it begins like neither".to_owned(),
        }));
    }
    let one = |file: &&ImageFile| match &file.layer {
        None => decode::light(&bytes, limit),
        Some(layer) => Err(PictureError::Layer {
            wanted: Some(layer.clone()),
            layers: Vec::new(),
        }),
    };
    Ok(wanted.iter().map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_host::files::Memory;
    use footlight_picture::exr::{Precision, encode};
    use footlight_picture::png;

    fn file(path: &str, layer: Option<&str>) -> ImageFile {
        ImageFile {
            path: path.to_owned(),
            layer: layer.map(str::to_owned),
        }
    }

    #[test]
    fn pictures_are_read_once_within_the_budget() {
        let image = Image::from_data(4, 1, vec![-1.5; 12]).unwrap();
        let bytes = encode(&image, Precision::Float, &[]).unwrap();
        let files = Memory::default()
            .with("a.exr", bytes.clone())
            .with("b.bin", bytes)
            .with("c.png", png::encode(2, 1, &[255, 0, 0, 0, 255, 0]).unwrap())
            .with("d.exr", "text");
        let wanted = [
            file("a.exr", None),
            file("b.bin", None),
            file("a.exr", None),
        ];
        let images = read(&files, &wanted, &StillImages::new(), 1 << 20).unwrap();
        assert_eq!(images.len(), 2);
        assert_eq!(*images[&wanted[0]], image);

        let again = read(&Memory::default(), &wanted, &images, 0).unwrap();
        assert!(Arc::ptr_eq(&again[&wanted[1]], &images[&wanted[1]]));

        let coded = file("c.png", None);
        let read_png = read(
            &files,
            std::slice::from_ref(&coded),
            &StillImages::new(),
            1 << 20,
        )
        .unwrap();
        assert_eq!(read_png[&coded].pixel(1, 0), Some([0.0, 1.0, 0.0]));

        let over = read(&files, &wanted, &StillImages::new(), 48 + 95).unwrap_err();
        assert!(matches!(
            over.as_slice(),
            [(f, ImageError::Picture(PictureError::Memory { .. }))] if f.path == "b.bin"
        ));
        let wrong = [
            file("d.exr", None),
            file("none.exr", Some("x")),
            file("c.png", Some("x")),
        ];
        let refused = read(&files, &wrong, &StillImages::new(), 1 << 20).unwrap_err();
        assert_eq!(refused.len(), 3);
    }
}
