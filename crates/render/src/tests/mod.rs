//! Tests of whole pictures against what is known of them.

mod determinism;
mod environment;
mod files;
mod integrators;
mod light;
mod photon_paths;
mod photons;
mod stops;
