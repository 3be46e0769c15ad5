//! `raystrips verify`.

use crate::args::VerifyArgs;
use crate::units::grouped;
use anyhow::Result;
use raystrips_tracer::Scene;
use std::io::Write;

/// Reads and checks all of a pack.
pub fn run(args: &VerifyArgs) -> Result<()> {
    let scene = Scene::open(&args.pack)?;
    let manifest = scene.manifest();
    writeln!(
        std::io::stdout(),
        "{}: good: {} pages, {} triangles",
        args.pack.display(),
        grouped(manifest.pages),
        grouped(manifest.triangles)
    )?;
    Ok(())
}
