//! The paper's Table 1: bytes of geometry and hierarchy.

use super::contestants::{Contestants, OURS, megabytes, our_bytes};
use super::models::{self, Model};
use crate::paper::published;
use crate::paper::structure::Bytes;
use anyhow::Result;

/// Structures of the paper's Table 1.
const PUBLISHED: [&str; 3] = ["Ray-Strips", "BVH, minimal", "BVH, optimized"];

/// Prints a row for each model and structure.
pub fn print(paths: &[String]) -> Result<()> {
    println!(
        "| model | triangles | structure | geometry MB | hierarchy MB | total MB | bytes/triangle | of this program |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    models::each(paths, |model| {
        let ours = our_bytes(model);
        let contestants = Contestants::build(&model.mesh);
        contestants.for_each(|name, structure| row(model, name, structure.bytes(), ours));
        row(model, OURS, ours, ours);
        model.published().into_iter().for_each(published_rows);
        Ok(())
    })?;
    models::unmatched(paths).into_iter().for_each(published_rows);
    let about = "MB are 2^20 bytes. Vertices are in the geometry of all structures that share them; materials (2 bytes a \
         triangle in the paper) are in none of ours.";
    models::print_notes(paths, about);
    Ok(())
}

fn row(model: &Model, name: &str, bytes: Bytes, ours: Bytes) {
    println!(
        "| {} | {} | {name} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
        model.name,
        model.triangles(),
        megabytes(bytes.geometry),
        megabytes(bytes.hierarchy),
        megabytes(bytes.total()),
        bytes.total() as f64 / model.triangles(),
        bytes.total() as f64 / ours.total() as f64,
    );
}

fn published_rows(model: &published::Model) {
    for (name, memory) in PUBLISHED.iter().zip(model.memory) {
        println!(
            "| paper: {} | {} | {name} | {} | {} | {} | {:.1} | |",
            model.name,
            model.triangles,
            memory.geometry,
            memory.hierarchy,
            memory.total,
            memory.total * f64::from(1 << 20) / model.triangles,
        );
    }
}
