//! `raystrips verify`.

use crate::args::VerifyArgs;
use crate::units::grouped;
use anyhow::Result;
use raystrips_tracer::{ProxyKind, Scene};
use std::io::Write;

/// Reads and checks all of a pack.
pub fn run(args: &VerifyArgs) -> Result<()> {
    let scene = Scene::open(&args.pack)?;
    let manifest = scene.manifest();
    let mut proxies = 0;
    for kind in ProxyKind::ALL {
        proxies += usize::from(Scene::open_proxy(&args.pack, kind)?.is_some());
    }
    writeln!(
        std::io::stdout(),
        "{}: good: {} pages, {} triangles and segments; proxies: {proxies}",
        args.pack.display(),
        grouped(manifest.pages),
        grouped(manifest.primitives)
    )?;
    Ok(())
}
