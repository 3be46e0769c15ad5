//! The paper's Table 2, and the strips of its Table 5: what hierarchies are made of.

use super::contestants::{Contestants, OURS, RAY_STRIPS, TUNED_RAY_STRIPS, megabytes, our_bytes};
use super::models::{self, Model};
use crate::paper::published;
use crate::paper::ray_strip::RayStrips;
use crate::paper::structure::Structure;
use anyhow::Result;

/// A row; what a structure does not have is left blank.
#[derive(Default)]
struct Row {
    nodes: Option<usize>,
    tree_nodes: Option<usize>,
    strips: Option<u64>,
    /// Triangles in strips, swaps included.
    places: Option<u64>,
    bytes: u64,
}

/// Prints a row for each model and structure.
pub fn print(paths: &[String]) -> Result<()> {
    println!(
        "| model | triangles | structure | nodes | nodes along strips | strips | places a strip | triangles a strip \
         | swaps | hierarchy MB | bytes/triangle |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    models::each(paths, |model| {
        rows(model);
        model.published().into_iter().for_each(published_row);
        Ok(())
    })?;
    models::unmatched(paths).into_iter().for_each(published_row);
    let about = "Places are triangles of strips and swaps; the paper's strip length must be one in places, since times \
         strips it exceeds the triangles. Bytes of this program's hierarchy have headers, directory and padding of pages \
         in them; its nodes have eight children.";
    models::print_notes(paths, about);
    others();
    Ok(())
}

fn rows(model: &Model) {
    let Contestants { optimized, strips, tuned_strips, multi, .. } = &Contestants::build(&model.mesh);
    let of_nodes = |nodes: usize, structure: &dyn Structure| Row {
        nodes: Some(nodes),
        bytes: structure.bytes().hierarchy,
        ..Row::default()
    };
    // Over minimal triangles the hierarchy is the same.
    row(model, "BVH, 1 a leaf", &of_nodes(optimized[0].node_count(), &optimized[0]));
    row(model, "BVH, 4 a leaf", &of_nodes(optimized[1].node_count(), &optimized[1]));
    row(model, RAY_STRIPS, &of_strips(strips));
    row(model, TUNED_RAY_STRIPS, &of_strips(tuned_strips));
    row(model, "multi-BVH", &of_nodes(multi.node_count(), multi));
    let manifest = &model.report.manifest;
    let (strips, triangles) = (Some(manifest.strips), Some(manifest.triangles()));
    let bytes = our_bytes(model).hierarchy;
    row(model, OURS, &Row { strips, places: triangles, bytes, ..Row::default() });
}

fn of_strips(strips: &RayStrips) -> Row {
    let statistics = strips.statistics();
    Row {
        nodes: Some(statistics.nodes),
        tree_nodes: Some(statistics.tree_nodes),
        strips: Some(statistics.strips as u64),
        places: Some(statistics.places as u64),
        bytes: strips.bytes().hierarchy,
    }
}

fn row(model: &Model, name: &str, row: &Row) {
    let number = |x: Option<usize>| x.map_or(String::new(), |x| x.to_string());
    let a_strip = |x: Option<f64>| match (x, row.strips) {
        (Some(x), Some(strips)) => format!("{:.2}", x / strips as f64),
        _ => String::new(),
    };
    let places = row.places.map(|places| places as f64);
    println!(
        "| {} | {} | {name} | {} | {} | {} | {} | {} | {} | {:.2} | {:.2} |",
        model.name,
        model.triangles(),
        number(row.nodes),
        number(row.tree_nodes),
        row.strips.map_or(String::new(), |x| x.to_string()),
        a_strip(places),
        a_strip(Some(model.triangles())),
        places.map_or(String::new(), |places| format!("{:.1} %", 100.0 * (1.0 - model.triangles() / places))),
        megabytes(row.bytes),
        row.bytes as f64 / model.triangles(),
    );
}

fn published_row(model: &published::Model) {
    let places = model.strip_length * model.strips as f64;
    let hierarchy = model.memory[0].hierarchy;
    println!(
        "| paper: {} | {} | Ray-Strips | | | {} | {} | {:.2} | {:.1} % | {hierarchy} | {:.2} |",
        model.name,
        model.triangles,
        model.strips,
        model.strip_length,
        model.triangles / model.strips as f64,
        100.0 * (1.0 - model.triangles / places),
        hierarchy * f64::from(1 << 20) / model.triangles,
    );
}

/// The paper's Table 2.
fn others() {
    println!("\nThe paper's Table 2, MB of hierarchies alone:\n");
    println!("| model | Ray-Strips | kd-tree | spatial kd-tree | LBVH | LPBVH |\n|---|---|---|---|---|---|");
    for (name, megabytes) in published::HIERARCHIES {
        let cells = megabytes.map(|x| x.map_or("n/a".to_owned(), |x| x.to_string()));
        println!("| paper: {name} | {} |", cells.join(" | "));
    }
}
