//! Textures: which image, how it repeats, and where it lies.

use super::buffer::{Buffers, data_uri};
use super::document::{Document, Sampler, TextureEntry, TextureExtensions};
use crate::ImageSource;
use crate::emit::Emitter;
use crate::reference::{percent_decoded, resolve};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::NormalTexture;
use raystrips_geom::scene::MaterialTextures;
use raystrips_geom::texture::{Texture, Wrap};
use std::path::Path;

/// How a material names a texture.
pub(super) struct Named {
    pub index: usize,
    pub tex_coord: u32,
    pub transform: Option<TextureTransform>,
}

impl Named {
    pub fn of(info: &gltf::json::texture::Info) -> Named {
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.clone());
        Named { index: info.index.value(), tex_coord: info.tex_coord, transform }
    }

    pub fn of_normal(normal: &NormalTexture) -> Named {
        // The library does not know that these can be transformed as others.
        let others = normal.extensions.as_ref().map(|extensions| &extensions.others);
        let transform = others.and_then(|others| others.get("KHR_texture_transform"));
        Named {
            index: normal.index.value(),
            tex_coord: normal.tex_coord,
            transform: transform.and_then(|value| serde_json::from_value(value.clone()).ok()),
        }
    }
}

/// Makes textures of a document's.
#[derive(Clone, Copy)]
pub(super) struct Textures<'a> {
    pub path: &'a Path,
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
}

impl Textures<'_> {
    /// The texture; [`MaterialTextures::LOST`] where it cannot be had, which is told, or is not wanted.
    pub fn get(&self, named: &Named, is_srgb: bool, out: &mut Emitter) -> u32 {
        if out.options.bare {
            return MaterialTextures::LOST;
        }
        match self.find(named, out) {
            Ok((source, texture)) => out.texture(source, is_srgb, texture),
            Err(what) => {
                out.warn(self.path, format_args!("textures[{}] is left out: {what}", named.index));
                MaterialTextures::LOST
            }
        }
    }

    fn find(&self, named: &Named, out: &mut Emitter) -> Result<(ImageSource, Texture), String> {
        let entry = self.document.textures.get(named.index).ok_or("there is no such texture")?;
        let image = image_of(entry).ok_or("it names no image of a known format")?;
        let source = self.source(image, out)?;
        let sampler = match entry.sampler {
            None => Sampler::default(),
            Some(sampler) => self.document.samplers.get(sampler as usize).cloned().unwrap_or_default(),
        };
        let moved = named.transform.as_ref();
        let tex_coord = moved.and_then(|t| t.tex_coord).unwrap_or(named.tex_coord);
        if tex_coord > 1 {
            return Err(format!("it uses texture coordinates {tex_coord}; 0 and 1 are read"));
        }
        let texture = Texture {
            image: 0,
            tex_coord: tex_coord as u8,
            transform: moved.map_or(Texture::default().transform, matrix),
            wrap: [wrap(sampler.wrap_s), wrap(sampler.wrap_t)],
            is_nearest: sampler.mag_filter == Some(NEAREST),
        };
        Ok((source, texture))
    }

    fn source(&self, image: u32, out: &mut Emitter) -> Result<ImageSource, String> {
        let entry = self.document.images.get(image as usize).ok_or("it names an image that is not there")?;
        match (&entry.uri, entry.buffer_view) {
            (Some(uri), _) if uri.starts_with("data:") => {
                data_uri(uri).map(ImageSource::Inline).ok_or_else(|| "its data URI is not base64".into())
            }
            (Some(uri), _) => {
                let literal = resolve(self.path, uri).ok().filter(|path| path.is_file());
                let path = literal.map_or_else(|| resolve(self.path, &percent_decoded(uri)), Ok);
                let path = path.map_err(|reason| format!("'{uri}' is not read: {reason}"))?;
                out.note_file(&path);
                match path.is_file() {
                    true => Ok(ImageSource::File(path)),
                    false => Err(format!("there is no file '{uri}'; put it next to this one")),
                }
            }
            (None, Some(view)) => self.buffers.source(view as usize, self.path).map_err(|e| e.to_string()),
            (None, None) => Err("its image has no contents".into()),
        }
    }
}

/// Formats that extensions add, before the one that any reader knows.
fn image_of(entry: &TextureEntry) -> Option<u32> {
    let TextureExtensions { basisu, webp } = &entry.extensions;
    basisu.as_ref().or(webp.as_ref()).map(|other| other.source).or(entry.source)
}

/// Numbers of OpenGL.
const NEAREST: u32 = 9728;
const CLAMP_TO_EDGE: u32 = 33071;
const MIRRORED_REPEAT: u32 = 33648;

fn wrap(code: Option<u32>) -> Wrap {
    match code {
        Some(CLAMP_TO_EDGE) => Wrap::Clamp,
        Some(MIRRORED_REPEAT) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

/// Translation after rotation after scaling, as of KHR_texture_transform.
fn matrix(transform: &TextureTransform) -> [[f32; 3]; 2] {
    let ([x, y], [width, height]) = (transform.offset.0, transform.scale.0);
    let (sine, cosine) = transform.rotation.0.sin_cos();
    let finite = |row: [f32; 3]| row.map(|c| if c.is_finite() { c } else { 0.0 });
    [finite([cosine * width, sine * height, x]), finite([-sine * width, cosine * height, y])]
}
