//! The words everyone shares: boxes, rays, hits, the quantization grid of a node, the one rule that turns
//! position *i* of a strip into a triangle, segments of hair, attributes of vertices,
//! textures, what becomes of boxes, errors and normals where things are shown elsewhere (`affine`), and the plain-data scene
//! description.
//!
//! Nothing here knows of files, pages or threads.

pub mod aabb;
pub mod affine;
pub mod attributes;
pub mod chance;
pub mod curve;
pub mod frame;
pub mod grid;
pub mod morton;
pub mod ray;
pub mod scene;
pub mod strand;
pub mod strip;
pub mod texture;

pub use aabb::Aabb;
pub use attributes::{Attributes, Streams};
pub use chance::chance;
pub use frame::Frame;
pub use grid::{NodeGrid, PageGrid, Subgrid};
pub use ray::{Hit, Ray};
pub use strand::{RadiusCode, Segment, Shape};
