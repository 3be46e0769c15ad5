//! The structures that the papers compare, as published, for comparison only: nothing of the program uses them.
//!
//! - [`bvh`]: the binary hierarchy of boxes that "Ray-Strips" (Lauterbach, Yoon, Manocha 2007) measures itself
//!   against, over "minimal" and "optimized" triangles.
//! - [`ray_strip`]: the Ray-Strips of that paper.
//! - [`multi_bvh`]: the four-wide hierarchy of section 6 of "Cache-Oblivious Ray Reordering" (Moon et al. 2010).
//!
//! All use four lanes of SSE, as the papers did, through [`glam::Vec4`]; the hierarchy of boxes above triangles and
//! strips is the same code ([`hierarchy`]), so that what is compared is what lies below it.

pub mod bvh;
pub mod hierarchy;
pub mod mesh;
pub mod moeller_trumbore;
pub mod multi_bvh;
pub mod packet;
pub mod published;
pub mod ray;
pub mod ray_strip;
pub mod structure;
#[cfg(test)]
mod tests;
