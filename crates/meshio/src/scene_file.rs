//! Scene files: models, where they stand, and what the model files do not say, in TOML.
//!
//! ```toml
//! [camera]                      # replaces the cameras of the models
//! position = [0.0, 1.0, 5.0]
//! target = [0.0, 1.0, 0.0]
//! up = [0.0, 1.0, 0.0]          # this if not given
//! vertical_fov_degrees = 40.0   # this if not given
//!
//! [sky]                         # one color, or three: straight up, from the side, straight down
//! zenith = [0.3, 0.5, 1.0]      # color = [1.0, 1.0, 1.0]
//! horizon = [1.0, 1.0, 1.0]
//! ground = [0.2, 0.2, 0.2]
//!
//! [[light]]
//! type = "spot"                 # or "point" (no direction, no angles), "directional" (no position, no angles)
//! position = [0.0, 4.0, 0.0]
//! direction = [0.0, -1.0, 0.0]  # along which it shines
//! intensity = [10.0, 10.0, 10.0]# W/sr, for a directional light W/m²
//! inner_angle_degrees = 20.0    # half angles of the cone; 0 and 45 if not given
//! outer_angle_degrees = 30.0
//!
//! [[material]]                  # changes all materials of this name, but only what is given
//! name = "wall"
//! base_color = [0.8, 0.8, 0.8]
//! emission = [0.0, 0.0, 0.0]
//! alpha = 1.0
//! metallic = 0.0
//! roughness = 1.0
//! transmission = 0.0
//! ior = 1.5
//! specular = 0.0                # how much of what its boundary reflects a dielectric reflects; 1 where roughness,
//!                               # transmission or ior are given
//! absorption = [0.0, 0.0, 0.0]  # of what transmits, for each unit of length
//! thin = false                  # transmits as a thin sheet, without refraction
//! double_sided = false
//!
//! [[model]]
//! file = "box.obj"              # seen from the folder of the scene file
//! material = "wall"             # a [[material]] of this file for all of the model
//! scale = 2.0                   # or [x, y, z]
//! rotate_degrees = [0, 90, 0]   # about x, then y, then z
//! translate = [1.0, 0.0, 0.0]   # scaled first, then rotated, then moved
//! strand_width = 0.002          # of hair and lines, in units of the file; by default what the file says
//! # matrix = [1, 0, 0, 1,  0, 1, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]   # instead of the three, row by row
//! ```
//!
//! A large model that stands in many places with the same material is read once and shown by instances, if these are wanted and
//! it brings no cameras or lights. All sections may be left out but one `[[model]]`. Unknown keys are errors. Scene files do not nest. Whoever
//! writes a scene file may name any model file, unlike model files, which only name files next to them.

use crate::emit::Emitter;
use crate::import::{Model, ending};
use crate::{ImportError, Place, Result};
use glam::{DAffine3, DMat3, DMat4, DVec3, EulerRot, Vec3};
use raystrips_geom::scene::{Camera, Light, LightKind, Material, Projection, Sky};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A scene file that has been read and checked.
#[derive(Debug)]
pub(crate) struct SceneFile {
    path: PathBuf,
    document: Document,
    camera: Option<Camera>,
    sky: Option<Sky>,
    lights: Vec<Light>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    camera: Option<CameraEntry>,
    sky: Option<SkyEntry>,
    #[serde(default)]
    light: Vec<LightEntry>,
    #[serde(default)]
    material: Vec<MaterialEntry>,
    #[serde(default)]
    model: Vec<ModelEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraEntry {
    position: [f64; 3],
    target: [f64; 3],
    up: Option<[f64; 3]>,
    vertical_fov_degrees: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SkyEntry {
    color: Option<[f32; 3]>,
    zenith: Option<[f32; 3]>,
    horizon: Option<[f32; 3]>,
    ground: Option<[f32; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
enum LightEntry {
    Point {
        position: [f64; 3],
        intensity: [f32; 3],
    },
    Spot {
        position: [f64; 3],
        direction: [f64; 3],
        intensity: [f32; 3],
        #[serde(default)]
        inner_angle_degrees: f32,
        outer_angle_degrees: Option<f32>,
    },
    Directional {
        direction: [f64; 3],
        intensity: [f32; 3],
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialEntry {
    name: String,
    base_color: Option<[f32; 3]>,
    emission: Option<[f32; 3]>,
    alpha: Option<f32>,
    metallic: Option<f32>,
    roughness: Option<f32>,
    transmission: Option<f32>,
    ior: Option<f32>,
    specular: Option<f32>,
    absorption: Option<[f32; 3]>,
    thin: Option<bool>,
    double_sided: Option<bool>,
    /// Set where a model got this material as a whole.
    #[serde(skip)]
    material: Option<u32>,
    #[serde(skip)]
    used: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelEntry {
    file: PathBuf,
    material: Option<String>,
    strand_width: Option<f64>,
    translate: Option<[f64; 3]>,
    rotate_degrees: Option<[f64; 3]>,
    scale: Option<Scale>,
    matrix: Option<[f64; 16]>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "scale must be a number or [x, y, z]")]
enum Scale {
    Uniform(f64),
    Axes([f64; 3]),
}

/// Why an entry cannot be taken, beginning with its name.
type Check<T> = std::result::Result<T, String>;

impl SceneFile {
    pub fn read(path: &Path) -> Result<SceneFile> {
        let text = std::fs::read_to_string(path).map_err(|e| ImportError::io(path, e))?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let document: Document = toml::from_str(text).map_err(|error| {
            let place = error.span().map_or(Place::Whole, |span| {
                Place::Line(1 + text.as_bytes()[..span.start].iter().filter(|&&c| c == b'\n').count() as u64)
            });
            ImportError::syntax(path, place, format_args!("{}; correct it", error.message()))
        })?;
        SceneFile::checked(path, document).map_err(|what| ImportError::syntax(path, Place::Whole, what))
    }

    fn checked(path: &Path, document: Document) -> Check<SceneFile> {
        if document.model.is_empty() {
            return Err("there is no [[model]]; name at least one model file".into());
        }
        for (i, material) in document.material.iter().enumerate() {
            material.check().map_err(|what| format!("material[{i}].{what}"))?;
        }
        let camera = document.camera.as_ref().map(CameraEntry::camera).transpose()?;
        let sky = document.sky.as_ref().map(SkyEntry::sky).transpose()?;
        let lights = document.light.iter().enumerate();
        let lights = lights.map(|(i, light)| light.light().map_err(|what| format!("light[{i}].{what}")));
        let lights = lights.collect::<Check<_>>()?;
        Ok(SceneFile { path: path.into(), document, camera, sky, lights })
    }

    /// The models in the order of the file.
    pub fn models(&self) -> Result<Vec<Model>> {
        let models = self.document.model.iter().enumerate();
        let models = models.map(|(i, entry)| {
            self.model(entry).map_err(|what| {
                ImportError::syntax(&self.path, Place::Whole, format_args!("model[{i}].{what}"))
            })
        });
        models.collect()
    }

    fn model(&self, entry: &ModelEntry) -> Check<Model> {
        if ending(&entry.file) == "toml" {
            return Err("file is a scene file; name its models here instead".into());
        }
        if let Some(name) = &entry.material
            && !self.document.material.iter().any(|material| material.name == *name)
        {
            return Err(format!("material '{name}' is not in this file; add a [[material]] of that name"));
        }
        if entry.strand_width.is_some_and(|width| !(width > 0.0 && width.is_finite())) {
            return Err("strand_width must be a number above 0".into());
        }
        let folder = self.path.parent().unwrap_or(Path::new(""));
        Ok(Model {
            path: folder.join(&entry.file),
            world_from_file: entry.transform()?,
            material: entry.material.clone(),
            strand_width: entry.strand_width,
        })
    }

    /// The material that models get by this name, which `model` has checked.
    pub fn material(&mut self, name: &str, out: &mut Emitter) -> Option<u32> {
        let entry = self.document.material.iter_mut().find(|entry| entry.name == name)?;
        // `apply_to` sets the values, here and in the models' own materials of this name.
        let new = || out.material(Material { name: name.to_owned(), ..Material::default() });
        Some(*entry.material.get_or_insert_with(new))
    }

    /// Changes the materials that a model of this file has brought.
    pub fn apply_to(&mut self, materials: &mut [Material]) {
        for material in materials {
            let name = material.name.clone();
            for entry in self.document.material.iter_mut().filter(|entry| entry.name == name) {
                entry.used = true;
                entry.set_in(material);
            }
        }
    }

    /// Adds what belongs to no model.
    pub fn finish(self, out: &mut Emitter) {
        for entry in self.document.material.iter().filter(|entry| !entry.used) {
            out.warn(&self.path, format_args!("no model has a material '{}'", entry.name));
        }
        if let Some(camera) = self.camera {
            out.scene.cameras = vec![camera];
        }
        out.scene.sky = self.sky.or(out.scene.sky);
        out.scene.lights.extend(self.lights);
    }
}

impl CameraEntry {
    fn camera(&self) -> Check<Camera> {
        let (position, target) = (DVec3::from(self.position), DVec3::from(self.target));
        if !(position.is_finite() && target.is_finite()) {
            return Err("camera.position and camera.target must be finite numbers".into());
        }
        let forward = (target - position).try_normalize();
        let forward = forward.ok_or("camera.target is where the camera is; move one of them")?;
        let up = DVec3::from(self.up.unwrap_or([0.0, 1.0, 0.0]));
        let up = up.reject_from_normalized(forward).try_normalize().filter(|up| up.dot(forward).abs() < 1e-3);
        let up = up.ok_or("camera.up is along the view; choose another direction")?;
        let fov = self.vertical_fov_degrees.unwrap_or(40.0);
        if !(fov > 0.0 && fov < 180.0) {
            return Err("camera.vertical_fov_degrees must be between 0 and 180".into());
        }
        Ok(Camera {
            name: String::new(),
            position: self.position,
            forward: forward.as_vec3().to_array(),
            up: up.as_vec3().to_array(),
            projection: Projection::Perspective { vertical_fov: fov.to_radians() },
            aspect: None,
        })
    }
}

impl SkyEntry {
    fn sky(&self) -> Check<Sky> {
        let sky = match (self.color, self.zenith, self.horizon, self.ground) {
            (Some(color), None, None, None) => Sky::Constant(color),
            (None, Some(zenith), Some(horizon), Some(ground)) => Sky::Gradient { zenith, horizon, ground },
            _ => return Err("sky needs either color or all of zenith, horizon, ground".into()),
        };
        let colors = [self.color, self.zenith, self.horizon, self.ground];
        colors.into_iter().flatten().try_for_each(|color| check_light("sky color", color))?;
        Ok(sky)
    }
}

impl LightEntry {
    fn light(&self) -> Check<Light> {
        let (kind, intensity) = match *self {
            LightEntry::Point { position, intensity } => (LightKind::Point { position }, intensity),
            LightEntry::Directional { direction, intensity } => {
                (LightKind::Directional { direction: unit(direction)? }, intensity)
            }
            LightEntry::Spot { position, direction, intensity, inner_angle_degrees, outer_angle_degrees } => {
                let outer = outer_angle_degrees.unwrap_or(45.0f32.max(inner_angle_degrees));
                if !(0.0 <= inner_angle_degrees
                    && inner_angle_degrees <= outer
                    && 0.0 < outer
                    && outer <= 90.0)
                {
                    return Err("outer_angle_degrees must be between inner_angle_degrees and 90".into());
                }
                let (inner_angle, outer_angle) = (inner_angle_degrees.to_radians(), outer.to_radians());
                (
                    LightKind::Spot { position, direction: unit(direction)?, inner_angle, outer_angle },
                    intensity,
                )
            }
        };
        check_light("intensity", intensity)?;
        if let LightKind::Point { position } | LightKind::Spot { position, .. } = kind
            && !DVec3::from(position).is_finite()
        {
            return Err("position must be finite".into());
        }
        Ok(Light { name: String::new(), intensity, kind })
    }
}

impl MaterialEntry {
    fn check(&self) -> Check<()> {
        for (name, share) in [
            ("alpha", self.alpha),
            ("metallic", self.metallic),
            ("roughness", self.roughness),
            ("transmission", self.transmission),
            ("specular", self.specular),
        ] {
            if share.is_some_and(|x| !(0.0..=1.0).contains(&x)) {
                return Err(format!("{name} must be between 0 and 1"));
            }
        }
        if self.base_color.is_some_and(|color| color.iter().any(|x| !(0.0..=1.0).contains(x))) {
            return Err("base_color must be between 0 and 1".into());
        }
        if self.ior.is_some_and(|ior| !(ior >= 1.0 && ior.is_finite())) {
            return Err("ior must be at least 1".into());
        }
        self.absorption.map_or(Ok(()), |absorption| check_light("absorption", absorption))?;
        self.emission.map_or(Ok(()), |emission| check_light("emission", emission))
    }

    fn set_in(&self, material: &mut Material) {
        fn set<T: Copy>(slot: &mut T, value: Option<T>) {
            *slot = value.unwrap_or(*slot);
        }
        set(&mut material.base_color, self.base_color);
        set(&mut material.emission, self.emission);
        set(&mut material.alpha, self.alpha);
        set(&mut material.metallic, self.metallic);
        set(&mut material.roughness, self.roughness);
        set(&mut material.transmission, self.transmission);
        set(&mut material.ior, self.ior);
        let is_glossy = self.roughness.is_some() || self.transmission.is_some() || self.ior.is_some();
        set(&mut material.specular, self.specular.or(is_glossy.then_some(1.0)));
        set(&mut material.absorption, self.absorption);
        set(&mut material.thin, self.thin);
        set(&mut material.double_sided, self.double_sided);
    }
}

impl ModelEntry {
    fn transform(&self) -> Check<DAffine3> {
        let parts = self.translate.is_some() || self.rotate_degrees.is_some() || self.scale.is_some();
        let transform = match self.matrix {
            Some(_) if parts => return Err("matrix excludes translate, rotate_degrees and scale".into()),
            Some(rows) if rows[12..] != [0.0, 0.0, 0.0, 1.0] => {
                return Err("matrix is given row by row, the last row must be 0, 0, 0, 1".into());
            }
            Some(rows) => DAffine3::from_mat4(DMat4::from_cols_array(&rows).transpose()),
            None => self.scale_rotate_translate(),
        };
        let determinant = transform.matrix3.determinant();
        if !transform.is_finite() || !determinant.is_finite() || determinant == 0.0 {
            return Err("scale or matrix makes the model flat or infinite".into());
        }
        Ok(transform)
    }

    fn scale_rotate_translate(&self) -> DAffine3 {
        let scale = match self.scale {
            None => DVec3::ONE,
            Some(Scale::Uniform(scale)) => DVec3::splat(scale),
            Some(Scale::Axes(scale)) => DVec3::from(scale),
        };
        let [x, y, z] = self.rotate_degrees.unwrap_or_default().map(f64::to_radians);
        let rotation = DMat3::from_euler(EulerRot::ZYX, z, y, x);
        DAffine3::from_mat3_translation(
            rotation * DMat3::from_diagonal(scale),
            DVec3::from(self.translate.unwrap_or_default()),
        )
    }
}

fn unit(direction: [f64; 3]) -> Check<[f32; 3]> {
    let unit = DVec3::from(direction).try_normalize();
    Ok(unit.ok_or("direction must not be zero")?.as_vec3().to_array())
}

fn check_light(name: &str, color: [f32; 3]) -> Check<()> {
    let color = Vec3::from(color);
    if color.is_finite() && color.min_element() >= 0.0 {
        Ok(())
    } else {
        Err(format!("{name} must be finite and not negative"))
    }
}

#[cfg(test)]
mod tests;
