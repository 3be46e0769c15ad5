//! Proxies as packs, to be put into the pack of the scene.

use super::levels::Levels;
use crate::blocks::Blocks;
use crate::distribute;
use crate::import::Imported;
use crate::job::Job;
use crate::output::Output;
use crate::partition::{self, Division};
use crate::positions::ToPack;
use crate::{Conversion, ConvertError};
use raystrips_extmem::Spool;
use raystrips_geom::scene::{Geometry, Material, SceneDesc};
use raystrips_pack::{Manifest, ProxyKind};
use std::path::PathBuf;

/// Triangles that fit the cache of a processor, and so those of the coarse proxy. A scene of no more is a proxy of its
/// own.
const COARSE_TRIANGLES: u64 = 20_000;
/// A coarse proxy is worth its bytes if the fine one has this many times its triangles.
const WORTH: f64 = 1.25;
/// Bytes of a triangle in a proxy: a first guess.
const TRIANGLE_BYTES: u64 = 12;
/// Where a proxy came out too large, the next one is to have this part of what should fit.
const SAFETY: f64 = 0.95;

/// Proxies in a pack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackProxies {
    /// Triangles of the fine proxy as a share of those of the scene.
    pub ratio: f64,
    /// Most bytes of the fine proxy.
    pub memory: u64,
}

impl Default for PackProxies {
    /// 2 %, and 64 MiB.
    fn default() -> PackProxies {
        PackProxies { ratio: 0.02, memory: 64 << 20 }
    }
}

impl PackProxies {
    /// Triangles of the fine proxy of a scene of so many.
    fn fine_triangles(&self, triangles: u64) -> u64 {
        let by_ratio = (triangles as f64 * self.ratio).round() as u64;
        by_ratio.min(self.memory / TRIANGLE_BYTES).max(1)
    }
}

/// The triangles to simplify a scene of so many to, if it gets proxies.
pub(crate) fn wants_proxies(proxies: Option<&PackProxies>, triangles: u64) -> Option<u64> {
    let proxies = proxies.filter(|_| triangles > COARSE_TRIANGLES)?;
    Some(proxies.fine_triangles(triangles))
}

/// A proxy in a file of its own.
#[derive(Clone, Debug)]
pub(crate) struct PackedProxy {
    pub kind: ProxyKind,
    pub path: PathBuf,
    pub triangles: u64,
    pub bytes: u64,
}

impl Conversion<'_> {
    /// Simplifies `first`, the first level of the scene, on to proxies, and packs them: the largest one first.
    pub(crate) fn pack_proxies(
        &self,
        first: Blocks,
        mut wanted: u64,
        imported: &Imported,
        levels: &Levels,
        job: &Job,
    ) -> Result<Vec<PackedProxy>, ConvertError> {
        let most = self.params.proxies.map_or(0, |proxies| proxies.memory);
        let mut blocks = levels.reduce(first, wanted)?;
        let mut fine = self.pack_proxy(ProxyKind::Fine, &mut blocks, imported, levels, job)?;
        while fine.as_ref().is_some_and(|fine| fine.bytes > most && wanted > 1) {
            let bytes = fine.map_or(1, |fine| fine.bytes);
            wanted = (blocks.triangles as f64 * SAFETY * most as f64 / bytes as f64).max(1.0) as u64;
            blocks = levels.reduce(blocks, wanted)?;
            fine = self.pack_proxy(ProxyKind::Fine, &mut blocks, imported, levels, job)?;
        }
        let is_worth_it = blocks.triangles as f64 > COARSE_TRIANGLES as f64 * WORTH;
        let coarse = if is_worth_it {
            blocks = levels.reduce(blocks, COARSE_TRIANGLES)?;
            self.pack_proxy(ProxyKind::Coarse, &mut blocks, imported, levels, job)?
        } else {
            None
        };
        Ok(fine.into_iter().chain(coarse).collect())
    }

    /// Packs a proxy; nothing if none of its triangles has an area.
    fn pack_proxy(
        &self,
        kind: ProxyKind,
        blocks: &mut Blocks,
        imported: &Imported,
        levels: &Levels,
        job: &Job,
    ) -> Result<Option<PackedProxy>, ConvertError> {
        let quiet = levels.quiet();
        let to_pack = ToPack::identity();
        blocks.keeps_flat = false;
        let partition = partition::partition(blocks, levels.bounds, &to_pack, Division::SurfaceArea, &quiet)?;
        let Some(partition) = partition else { return Ok(None) };
        let spool = Spool::unnamed(levels.folder, levels.budget);
        let pieces = distribute::distribute(blocks, &partition, &to_pack, false, spool, &quiet)?;
        blocks.keeps_flat = true;
        let files = job.files(match kind {
            ProxyKind::Fine => "fine-",
            ProxyKind::Coarse => "coarse-",
        });
        let path = files.path("proxy");
        let mut output = Output::open(&path, files, self.proxy_manifest(imported), Vec::new())?;
        self.build(&pieces, &mut output, &self.piece_context(&pieces, &[]), &quiet, &mut |_| Ok(()))?;
        let (manifest, bytes) = output.finish(pieces.tree, self.plan.sort_memory(), &[], &[])?;
        Ok(Some(PackedProxy { kind, path, triangles: manifest.triangles, bytes }))
    }

    /// Geometries keep their numbers, but what they are made of the scene knows.
    fn proxy_manifest(&self, imported: &Imported) -> Manifest {
        let geometries = vec![Geometry::default(); imported.scene.geometries.len()];
        let scene = SceneDesc { geometries, materials: vec![Material::default()], ..SceneDesc::default() };
        Manifest { id_bytes: 0, dropped: Default::default(), scene, ..self.manifest(imported) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_scenes_are_their_own_proxies_and_memory_bounds_large_ones() {
        let proxies = PackProxies::default();
        assert_eq!(wants_proxies(Some(&proxies), COARSE_TRIANGLES), None);
        assert_eq!(wants_proxies(None, 1 << 40), None);
        assert_eq!(wants_proxies(Some(&proxies), 1_000_000), Some(20_000));
        assert!(wants_proxies(Some(&proxies), 10_000_000_000) < Some(6_000_000));
    }
}
