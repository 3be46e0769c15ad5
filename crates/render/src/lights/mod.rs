//! Sampling of lights for direct light: emissive triangles in `area`, lights without a surface in `punctual`.

mod area;
mod punctual;

pub(crate) use area::AreaLights;
pub(crate) use punctual::{PunctualLights, spot_falloff};
