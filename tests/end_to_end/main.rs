//! Runs the real binary, each test in a folder of its own.

// All of this is tests, helpers too.
#![allow(clippy::unwrap_used)]

mod bad_input;
mod budget;
mod convert;
mod corpus;
mod damage;
mod direct_light;
mod environment;
mod far_away;
mod hair;
mod instances;
mod interrupt;
mod layouts;
mod models;
mod orderings;
mod out_of_core;
mod pictures;
mod proxy;
mod rays;
mod render;
mod resume;
mod support;
mod textures;
mod trace;
mod usage;
mod whole_or_nothing;
