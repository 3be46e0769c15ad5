//! What an order of rays gives to the paper's faster tracer (Moon et al. 2010, section 6): the four-wide hierarchy with and
//! without its packets of triangles, beside ours. All in memory: it cannot do with less.

use super::{Rendered, Setting};
use crate::paper::mesh::Mesh;
use crate::paper::multi_bvh::{MultiBvh, SingleTriangles};
use crate::paper::structure::{Stacks, Structure};
use anyhow::Result;
use raystrips_geom::{Aabb, Hit, Ray, Shape, scene::SceneDesc};
use raystrips_render::{
    Curve, Emitter, HitPoints, OrderParams, Ordering, RenderParams, RenderStats, Surface, TracedWorld,
    Unfinished, Watch, World, render, render_ordered,
};
use raystrips_tracer::{OpenError, ProxyKind, Scene};

/// Runs of which the median is taken.
const REPEAT: usize = 3;
/// Memory for rays that are sorted.
const BUFFER_BYTES: u64 = 88 << 20;

/// Rays answered by a structure that knows triangles by their number in the pack.
struct StructureWorld<'a> {
    structure: &'a (dyn Structure + Sync),
    mesh: &'a Mesh,
    geometries: &'a [u32],
    world: &'a TracedWorld,
}

impl StructureWorld<'_> {
    fn hits<'r>(&self, rays: &'r [Ray]) -> impl Iterator<Item = Hit> + use<'_, 'r> {
        let mut stacks = Stacks::default();
        rays.iter().map(move |ray| match ray.is_valid() {
            true => self.structure.intersect(&mut stacks, ray),
            false => Hit::MISS,
        })
    }
}

impl World for StructureWorld<'_> {
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Hit]) -> Result<(), OpenError> {
        self.hits(rays).zip(hits).for_each(|(found, hit)| *hit = found);
        Ok(())
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]) -> Result<(), OpenError> {
        self.hits(rays).zip(occluded).for_each(|(found, occluded)| *occluded = found.is_hit());
        Ok(())
    }

    fn surface_batch(&self, hits: &[Hit], surfaces: &mut [Surface]) -> Result<(), OpenError> {
        for (hit, surface) in hits.iter().zip(surfaces).filter(|(hit, _)| hit.is_hit()) {
            let triangle = hit.prim_id as usize;
            *surface = Surface {
                geometry: self.geometries[triangle],
                triangle: hit.prim_id,
                shape: Shape::Triangle(self.mesh.corners(triangle)),
                u: hit.u,
                v: hit.v,
                error: 0.0,
                corners: None,
            };
        }
        Ok(())
    }

    fn bounds(&self) -> Aabb {
        self.world.bounds()
    }

    fn description(&self) -> &SceneDesc {
        self.world.description()
    }

    fn emitters(&self) -> &[Emitter] {
        self.world.emitters()
    }
}

impl Setting {
    /// Prints the speed of each tracer with rays as they come and in the paper's order.
    pub(super) fn multi_bvh(&self, pack: &Rendered) -> Result<()> {
        let world = TracedWorld::new(Scene::open(&pack.path)?);
        let mesh = Mesh::of_scene(world.scene());
        let geometries: Vec<u32> = world.scene().triangles().map(|(geometry, _)| geometry).collect();
        let multi = MultiBvh::build(&mesh);
        let single = SingleTriangles(&multi);
        let proxy = Scene::open_proxy(&pack.path, ProxyKind::Coarse)?;
        let hit_points = HitPoints::new(proxy, world.scene().geometry_bounds(), &world.bounds());
        let of =
            |structure| StructureWorld { structure, mesh: &mesh, geometries: &geometries, world: &world };
        println!(
            "| tracer | none, Mrays/s | hph, Mrays/s | gain | gain in tracing alone | paper, 39 % cached |"
        );
        println!("|---|---:|---:|---:|---:|---:|");
        let rows: [(&str, &dyn World, &str); 3] = [
            ("4-wide BVH, triangles one by one", &of(&single), "4.99"),
            ("4-wide BVH, packets of triangles", &of(&multi), "5.26"),
            ("this program", &world, ""),
        ];
        for (name, world, paper) in rows {
            let mut gains: Vec<[f64; 4]> =
                (0..REPEAT).map(|_| self.gain(world, &hit_points)).collect::<Result<_>>()?;
            gains.sort_by(|a, b| a[2].total_cmp(&b[2]));
            let [none, sorted, gain, tracing] = gains[REPEAT / 2];
            println!("| {name} | {none:.3} | {sorted:.3} | {gain:.2} | {tracing:.2} | {paper} |");
        }
        Ok(())
    }

    /// Speed without and with an order, and the gain in all and in tracing.
    fn gain(&self, world: &dyn World, hit_points: &HitPoints) -> Result<[f64; 4]> {
        let (width, height) = (self.limited.size.0 as u32, self.limited.size.1 as u32);
        let threads = self.limited.threads as usize;
        let params =
            RenderParams { width, height, spp: self.limited.spp as u32, threads, ..Default::default() };
        let plain = render(world, &params, &|_| ())?.stats;
        let order = OrderParams {
            ordering: Ordering::Hph,
            curve: Curve::Z,
            buffer_bytes: BUFFER_BYTES,
            scratch: None,
            hit_points: Some(hit_points),
        };
        let watch = Watch { is_due: &|| false, progress: &|_| () };
        let sorted = render_ordered(world, &params, &order, Unfinished::new(&params), &watch)?;
        let sorted = sorted.into_output().stats;
        let rate = |s: &RenderStats| (s.primary + s.shadow + s.secondary) as f64 / s.seconds.total / 1e6;
        let [none, hph] = [&plain, &sorted].map(rate);
        Ok([none, hph, hph / none, plain.seconds.trace / sorted.seconds.trace])
    }
}
