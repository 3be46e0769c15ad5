//! Cameras, samplers, integrators, film and image files.
