//! Proxies as packs, to be put into the pack of the scene.

use super::levels::Levels;
use crate::blocks::Blocks;
use crate::distribute::{self, Pieces};
use crate::forest::Forest;
use crate::gathered::Gathered;
use crate::import::Imported;
use crate::job::Job;
use crate::output::Output;
use crate::partition::{self, Census, Division};
use crate::piece::Kind;
use crate::positions::ToPack;
use crate::strands::StrandThinning;
use crate::{Conversion, ConvertError};
use raystrips_extmem::Spool;
use raystrips_geom::scene::{Geometry, Material, SceneDesc};
use raystrips_pack::{Manifest, ProxyKind};
use std::path::PathBuf;
use std::sync::Arc;

/// Triangles that fit the cache of a processor, and so those of the coarse proxy. A scene of no more is a proxy of its
/// own.
const COARSE_TRIANGLES: u64 = 20_000;
/// A coarse proxy is worth its bytes if the fine one has this many times its triangles.
const WORTH: f64 = 1.25;
/// Bytes of a triangle in a proxy: a first guess.
const TRIANGLE_BYTES: u64 = 12;
/// Segments of a window of a strand, at about.
const WINDOW_SEGMENTS: u64 = 4;
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

/// What a scene is to be simplified to, if it gets proxies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProxyGoal {
    /// Triangles.
    pub triangles: u64,
    /// Part of the strands.
    kept: f64,
    /// Part of what there is that is triangles.
    triangle_part: f64,
}

impl ProxyGoal {
    /// The goal for a scene; none where parts are shown by instances, of which there is no level in between.
    pub fn of(proxies: Option<&PackProxies>, gathered: &Gathered) -> Option<ProxyGoal> {
        let proxies = proxies.filter(|_| gathered.parts.is_empty());
        let triangles = gathered.triangles.as_ref().map_or(0, Pieces::triangles);
        ProxyGoal::of_counts(proxies?, triangles, gathered.primitives() - triangles)
    }

    fn of_counts(proxies: &PackProxies, triangles: u64, segments: u64) -> Option<ProxyGoal> {
        let all = triangles + segments;
        (all > COARSE_TRIANGLES).then(|| {
            let triangle_part = triangles as f64 / all as f64;
            ProxyGoal { triangles: 0, kept: 1.0, triangle_part }.with(proxies.fine_triangles(all), all)
        })
    }

    /// The same for another size: so many triangles and segments of what `all` are now.
    fn with(self, wanted: u64, all: u64) -> ProxyGoal {
        let triangles = ((wanted as f64 * self.triangle_part).round() as u64).max(1);
        ProxyGoal { triangles, kept: self.kept * (wanted as f64 / all.max(1) as f64).min(1.0), ..self }
    }

    /// How strands are thinned.
    pub fn thinning(&self) -> StrandThinning {
        StrandThinning::new(self.kept)
    }
}

/// What pieces were simplified to when they were built.
pub(crate) struct FirstLevel {
    pub triangles: Option<Blocks>,
    pub strands: Option<Blocks>,
}

impl FirstLevel {
    /// Triangles, and segments at about.
    fn primitives(&self) -> u64 {
        let count = |blocks: &Option<Blocks>| blocks.as_ref().map_or(0, |blocks| blocks.triangles);
        count(&self.triangles) + count(&self.strands) * WINDOW_SEGMENTS
    }
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
        first: FirstLevel,
        mut goal: ProxyGoal,
        imported: &Imported,
        levels: &Levels,
        job: &Job,
    ) -> Result<Vec<PackedProxy>, ConvertError> {
        let most = self.params.proxies.map_or(0, |proxies| proxies.memory);
        let before = goal.thinning();
        let mut level = self.reduce(first, goal, before, levels)?;
        let mut fine = self.pack_proxy(ProxyKind::Fine, &mut level, goal, imported, levels, job)?;
        while fine.as_ref().is_some_and(|fine| fine.bytes > most && level.primitives() > 1) {
            let bytes = fine.map_or(1, |fine| fine.bytes);
            let all = level.primitives();
            let wanted = (all as f64 * SAFETY * most as f64 / bytes as f64).max(1.0) as u64;
            let before = goal.thinning();
            goal = goal.with(wanted, all);
            level = self.reduce(level, goal, before, levels)?;
            fine = self.pack_proxy(ProxyKind::Fine, &mut level, goal, imported, levels, job)?;
        }
        let all = level.primitives();
        let coarse = if all as f64 > COARSE_TRIANGLES as f64 * WORTH {
            let before = goal.thinning();
            goal = goal.with(COARSE_TRIANGLES, all);
            level = self.reduce(level, goal, before, levels)?;
            self.pack_proxy(ProxyKind::Coarse, &mut level, goal, imported, levels, job)?
        } else {
            None
        };
        Ok(fine.into_iter().chain(coarse).collect())
    }

    /// Simplifies a level, whose strands were thinned by `before`, on to `goal`.
    fn reduce(
        &self,
        level: FirstLevel,
        goal: ProxyGoal,
        before: StrandThinning,
        levels: &Levels,
    ) -> Result<FirstLevel, ConvertError> {
        let triangles = level.triangles.map(|blocks| levels.reduce(blocks, goal.triangles)).transpose()?;
        let strands = match level.strands {
            Some(blocks) if goal.thinning() != before => {
                Some(levels.thin_strands(&blocks, goal.thinning(), before)?)
            }
            strands => strands,
        };
        Ok(FirstLevel { triangles, strands })
    }

    /// Packs a proxy; nothing if there is nothing of it that a ray could hit.
    fn pack_proxy(
        &self,
        kind: ProxyKind,
        level: &mut FirstLevel,
        goal: ProxyGoal,
        imported: &Imported,
        levels: &Levels,
        job: &Job,
    ) -> Result<Option<PackedProxy>, ConvertError> {
        let quiet = levels.quiet();
        let radii = imported.radii.scaled(goal.thinning().widening()).code();
        let to_pack = ToPack::identity(radii);
        let gather = |blocks: &Blocks| -> Result<Option<Pieces>, ConvertError> {
            let division = Division::SurfaceArea;
            let partition = partition::partition(blocks, levels.bounds, &to_pack, division, &quiet)?;
            let Some(partition) = partition else { return Ok(None) };
            let mut spool = Spool::unnamed(levels.folder, levels.budget);
            let distributed =
                distribute::distribute(blocks, &partition, &to_pack, false, &mut spool, &quiet)?;
            Ok(Some(distributed.in_spool(Arc::new(spool))))
        };
        let mut triangles = None;
        if let Some(blocks) = &mut level.triangles {
            blocks.keeps_flat = false;
            triangles = gather(blocks)?;
            blocks.keeps_flat = true;
        }
        let strands = match &level.strands {
            Some(blocks) if blocks.triangles > 0 => gather(blocks)?,
            _ => None,
        };
        let Some(gathered) = Gathered::new(triangles, strands, Vec::new()) else { return Ok(None) };
        let files = job.files(match kind {
            ProxyKind::Fine => "fine-",
            ProxyKind::Coarse => "coarse-",
        });
        let path = files.path("proxy");
        let mut output = Output::open(&path, files, self.proxy_manifest(imported), Vec::new())?;
        let triangles = Kind::Triangles { shines: &[], first_level: None };
        let strands = Kind::Strands { radii, thinning: None };
        let contexts = self.contexts(&gathered, [triangles, strands, triangles], 0);
        self.build(&gathered, &mut output, &contexts, &quiet, &mut |_| Ok(()))?;
        let forest = Forest::of(&gathered, Vec::new());
        let (manifest, bytes) = output.finish(forest, self.plan.sort_memory(), &[], &[], None)?;
        Ok(Some(PackedProxy { kind, path, triangles: manifest.primitives, bytes }))
    }

    /// Geometries keep their numbers, but what they are made of the scene knows.
    fn proxy_manifest(&self, imported: &Imported) -> Manifest {
        let geometries = vec![Geometry::default(); imported.scene.geometries.len()];
        let scene = SceneDesc { geometries, materials: vec![Material::default()], ..SceneDesc::default() };
        Manifest {
            id_bytes: 0,
            vertices: 0,
            dropped: Default::default(),
            scene,
            ..self.manifest(imported, &Census::default(), 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_scenes_are_their_own_proxies_and_memory_bounds_large_ones() {
        let proxies = PackProxies::default();
        let triangles = |all| ProxyGoal::of_counts(&proxies, all, 0).map(|goal| goal.triangles);
        assert_eq!(triangles(COARSE_TRIANGLES), None);
        assert_eq!(triangles(1_000_000), Some(20_000));
        assert!(triangles(10_000_000_000).is_some_and(|wanted| wanted < 6_000_000));
    }

    #[test]
    fn triangles_and_strands_are_simplified_alike() {
        let goal = ProxyGoal::of_counts(&PackProxies::default(), 1_000_000, 3_000_000).unwrap();
        assert_eq!((goal.triangles, goal.thinning()), (20_000, StrandThinning::new(0.02)));
        let coarse = goal.with(20_000, 80_000);
        assert_eq!((coarse.triangles, coarse.thinning()), (5_000, StrandThinning::new(0.005)));
    }
}
