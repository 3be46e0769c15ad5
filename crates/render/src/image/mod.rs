//! Picture files: EXR for values, PNG for eyes.

mod aces;
mod agx;
mod exr;
mod png;
mod tone;

pub use tone::ToneCurve;

use crate::{film::Film, params::RenderParams};
use std::{
    io,
    path::{Path, PathBuf},
};
use tempfile::NamedTempFile;
use thiserror::Error;

/// How a picture is written.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageOptions {
    /// PNG: factor on all values before the tone curve.
    pub exposure: f32,
    /// PNG: how values beyond the range of a screen are treated.
    pub tone_curve: ToneCurve,
    /// EXR: write albedo, normal and depth too, as far as the film has them.
    pub aovs: bool,
    /// Both: what the picture is, such as `("spp", "64")`; written in this order.
    pub metadata: Vec<(String, String)>,
}

impl ImageOptions {
    /// The options that suit a picture rendered with `params`: a tone curve for light only, and the parameters
    /// that decide on the picture as metadata.
    pub fn for_render(params: &RenderParams) -> ImageOptions {
        let metadata = [
            ("integrator", params.integrator.to_string()),
            ("spp", params.spp.to_string()),
            ("seed", params.seed.to_string()),
            ("ordering", "none".to_string()),
        ];
        ImageOptions {
            exposure: 1.0,
            tone_curve: if params.integrator.is_light() { ToneCurve::Neutral } else { ToneCurve::Clip },
            aovs: params.aovs,
            metadata: metadata.map(|(key, value)| (key.to_string(), value)).into(),
        }
    }

    fn metadata_line(&self) -> String {
        let pairs: Vec<String> = self.metadata.iter().map(|(key, value)| format!("{key}={value}")).collect();
        pairs.join(" ")
    }
}

/// Name and version of the program, for the files' metadata.
const SOFTWARE: &str = concat!("raystrips ", env!("CARGO_PKG_VERSION"));

/// Writes a picture as EXR or PNG by the ending of `path`. The file appears whole or not at all.
///
/// # Errors
/// Where the ending is another one, or the file cannot be written.
pub fn write_image(path: &Path, film: &Film, options: &ImageOptions) -> Result<(), ImageError> {
    let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    let write = match extension.as_deref() {
        Some("exr") => exr::write,
        Some("png") => png::write,
        _ => return Err(ImageError::Extension { path: path.into() }),
    };
    let file = create_beside(path).and_then(|mut file| {
        write(file.as_file_mut(), film, options)?;
        Ok(file)
    });
    let written = file.and_then(|file| Ok(file.persist(path).map(drop)?));
    written.map_err(|source| ImageError::Write { path: path.into(), source })
}

/// A file under a temporary name in the same folder, which can be renamed to `path`.
fn create_beside(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".raystrips-");
    // Temporary files are private by default; a picture is an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Why a picture was not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The name does not say which format.
    #[error("{}: a picture's name must end in .exr or .png", path.display())]
    Extension {
        /// The name.
        path: PathBuf,
    },
    /// The file could not be written.
    #[error("{}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        source: io::Error,
    },
}
