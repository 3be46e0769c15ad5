//! What both renderers are told: parts with one material each, lights, a sky and a camera.

use super::mesh::Mesh;
use super::texture::Texture;
use glam::DVec3;

/// A scene that can be said in the words of both.
pub struct Scene {
    /// Name of its folder, and its row in the table.
    pub name: &'static str,
    pub position: DVec3,
    pub target: DVec3,
    pub vertical_fov_degrees: f32,
    /// Radiance, the same from everywhere.
    pub sky: [f32; 3],
    pub lights: Vec<Light>,
    pub parts: Vec<Part>,
}

/// A light without a surface.
#[derive(Clone, Copy)]
pub enum Light {
    /// W/sr.
    Point { position: DVec3, intensity: [f32; 3] },
    /// W/m², on what is turned towards it.
    Directional { direction: DVec3, irradiance: [f32; 3] },
}

/// A mesh and what it is made of.
pub struct Part {
    /// Name of its file and of its material.
    pub name: String,
    pub mesh: Mesh,
    pub surface: Surface,
}

/// Materials that both have.
#[derive(Clone, Copy)]
pub enum Surface {
    Matte(Color),
    /// Matte, with normals out of a texture.
    Bumpy(Color, Texture),
    /// Matte, where a texture is white.
    CutOut(Color, Texture),
    /// Emits radiance from its front and reflects like matte of the gray.
    Lamp {
        radiance: [f32; 3],
        gray: f32,
    },
    /// Reflects all light, after as many bounces as it takes.
    WhiteMetal {
        roughness: f32,
    },
    /// By the Fresnel reflection of Schlick.
    Metal {
        color: [f32; 3],
        roughness: f32,
    },
    /// Of index 1.5; smooth where the roughness is 0.
    Glass {
        roughness: f32,
    },
    /// Matte below a boundary of index 1.5.
    Plastic {
        color: Color,
        roughness: f32,
    },
}

/// A share of light for each channel.
#[derive(Clone, Copy)]
pub enum Color {
    Rgb([f32; 3]),
    Textured(Texture),
}

impl Surface {
    /// The color of a matte surface, or of one below a boundary.
    pub fn color(&self) -> Color {
        match *self {
            Surface::Matte(color) | Surface::Bumpy(color, _) | Surface::CutOut(color, _) => color,
            Surface::Plastic { color, .. } => color,
            Surface::Lamp { gray, .. } => Color::Rgb([gray; 3]),
            Surface::Metal { color, .. } => Color::Rgb(color),
            Surface::WhiteMetal { .. } | Surface::Glass { .. } => Color::Rgb([1.0; 3]),
        }
    }

    /// All images that the surface needs.
    pub fn textures(&self) -> impl Iterator<Item = Texture> {
        let color = match self.color() {
            Color::Textured(texture) => Some(texture),
            Color::Rgb(_) => None,
        };
        let other = match *self {
            Surface::Bumpy(_, texture) | Surface::CutOut(_, texture) => Some(texture),
            _ => None,
        };
        color.into_iter().chain(other)
    }
}

impl Scene {
    /// True where light passes surfaces without being scattered.
    pub fn is_cut_out(&self) -> bool {
        self.parts.iter().any(|part| matches!(part.surface, Surface::CutOut(..)))
    }
}
