//! Edges are collapsed by least cost until few enough triangles are left.

use crate::curve::CostCurve;
use crate::legal::{Effect, Inspector};
use crate::planes;
use crate::queue::{Entry, Queue};
use crate::repeated::remove_repeated;
use crate::work_mesh::WorkMesh;
use crate::{Piece, Quadric, Simplified, Target};
use glam::DVec3;
use std::hint::black_box;

/// Part of a vertex's area by which it draws the new place to itself: places are unique then where the surface is flat.
const PULL: f64 = 3e-5;
/// Part of a vertex's area by which its squared distance to the new place counts in the cost. It spreads collapses where
/// the surface is flat.
const SPREAD: f64 = 3e-4;

/// By how much more the squared size of a part counts when it vanishes than the squared distance of a surface that
/// moves: parts are few and cost few triangles, but the distance to what is left may be much larger than their size.
const VANISHING_PRICE: f64 = 30.0;

/// What collapses may do, by turns: when no collapse is left under a rule, the next one goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    /// No triangle turns over.
    Upright,
    /// Everything.
    Anything,
}

/// Collapses of about the same cost that wait for memory together.
const BATCH: usize = 32;

/// Most corners of both ends of an edge that is collapsed, until no other edges are left: where triangles are no surface,
/// or many meet in a point, one vertex could come to have all of them, and each collapse would look at them.
const MOST_CORNERS: usize = 512;

/// The queue may have so many times the entries that it would have without outdated ones.
const MOST_OUTDATED: usize = 2;

/// A rule ends when a round under it removed less than this part of what is to be removed.
const LEAST_GAIN: f64 = 0.02;

/// Simplifies a piece. The result depends on nothing but the arguments.
///
/// The target is always reached, to half of the triangles that one collapse removes, except as locked vertices or the
/// cost keep it from being reached, or nothing would be left. Meshes without edges of one triangle still have none afterwards. Memory: about 150 bytes a triangle. Time:
/// O(n).
///
/// # Panics
/// If an index is out of range, there are not as many geometries as triangles, or more than 2^28 triangles.
pub fn simplify(piece: Piece, target: Target) -> Simplified {
    let mut simplifier = Simplifier::of(&piece, target);
    simplifier.run(Rule::Upright);
    if target.max_cost == f64::INFINITY {
        simplifier.run(Rule::Anything);
        while simplifier.is_refused {
            simplifier.most_corners *= 4;
            simplifier.run(Rule::Anything);
        }
    }
    let Simplifier { mesh, largest, curve, .. } = simplifier;
    let (piece, sources) = mesh.finish(piece);
    Simplified { piece, sources, error: largest.sqrt(), curve }
}

struct Simplifier {
    mesh: WorkMesh,
    inspector: Inspector,
    queue: Queue,
    target: Target,
    /// Most corners of both ends of an edge that is collapsed.
    most_corners: usize,
    /// True if edges were left because of that.
    is_refused: bool,
    /// From so many entries on the queue gets rid of those that are outdated.
    most_waiting: usize,
    /// The largest error of a collapse, squared.
    largest: f64,
    curve: CostCurve,
}

/// Where the ends of an edge would go, and at what price.
struct Placed {
    position: DVec3,
    /// What the queue is ordered by.
    cost: f64,
    /// Mean squared distance to planes.
    error: f64,
}

impl Simplifier {
    fn of(piece: &Piece, target: Target) -> Simplifier {
        let mut mesh = WorkMesh::of(piece);
        remove_repeated(&mut mesh);
        if piece.quadrics.is_empty() {
            planes::add_triangles(&mut mesh);
        }
        planes::add_borders(&mut mesh);
        let inspector = Inspector::new(mesh.vertices.len());
        let curve = CostCurve::beginning_with(mesh.triangle_count);
        Simplifier {
            mesh,
            inspector,
            queue: Queue::new(),
            target,
            most_corners: MOST_CORNERS,
            is_refused: false,
            most_waiting: 0,
            largest: 0.0,
            curve,
        }
    }

    fn run(&mut self, rule: Rule) {
        loop {
            self.is_refused = false;
            let before = self.mesh.triangle_count;
            if before <= self.target.triangles {
                return;
            }
            self.round(rule);
            let gained = (before - self.mesh.triangle_count) as f64;
            if gained <= LEAST_GAIN * (before - self.target.triangles) as f64 {
                return;
            }
        }
    }

    /// Puts all edges into the queue and works until it is empty.
    fn round(&mut self, rule: Rule) {
        let Simplifier { mesh, queue, target, .. } = self;
        planes::for_each_edge(mesh, &mut |mesh, edge, _| push(mesh, queue, target, edge));
        self.most_waiting = MOST_OUTDATED * self.queue.len();
        let mut batch = Vec::with_capacity(BATCH);
        loop {
            let mesh = &self.mesh;
            self.queue.pop(BATCH, |entry| entry.stamp == mesh.stamp(entry.ends), &mut batch);
            black_box(mesh.touch(batch.iter().map(|entry| entry.ends)));
            for &entry in &batch {
                if self.mesh.triangle_count <= self.target.triangles {
                    self.queue = Queue::new();
                    return;
                }
                self.try_collapse(entry, rule);
            }
            if batch.is_empty() {
                return;
            }
        }
    }

    fn try_collapse(&mut self, entry: Entry, rule: Rule) {
        if entry.stamp != self.mesh.stamp(entry.ends) {
            return;
        }
        if self.mesh.corner_count(entry.ends) > self.most_corners {
            self.is_refused = true;
            return;
        }
        let Some(effect) = self.inspector.inspect(&mut self.mesh, entry.ends) else { return };
        if self.goes_too_far() {
            return;
        }
        let Some(mut placed) = place(&self.mesh, entry.ends) else { return };
        if effect == Effect::Vanishes {
            placed = self.price_of_vanishing(placed, entry.ends);
            if !entry.is_priced {
                if placed.cost < self.target.max_cost {
                    self.queue.push(placed.cost, Entry { is_priced: true, ..entry });
                }
                return;
            }
        } else if rule != Rule::Anything && self.inspector.flips(&self.mesh, entry.ends, placed.position) {
            return;
        }
        self.collapse(entry.ends, &placed);
    }

    /// True if the target is missed by less without the collapse that was looked at last, or nothing is left after it.
    fn goes_too_far(&self) -> bool {
        let (before, wanted) = (self.mesh.triangle_count, self.target.triangles);
        let after = before.saturating_sub(self.inspector.removed);
        wanted > 0 && (after == 0 || wanted.saturating_sub(after) > before - wanted)
    }

    /// What vanishes is off by its size.
    fn price_of_vanishing(&self, placed: Placed, ends: [u32; 2]) -> Placed {
        let error = self.inspector.extent_squared(&self.mesh) * VANISHING_PRICE;
        let weight: f64 = ends.into_iter().map(|v| self.mesh.vertex(v).quadric.weight()).sum();
        Placed { error, cost: ordering(VANISHING_PRICE * error * weight, weight), ..placed }
    }

    fn collapse(&mut self, [u, v]: [u32; 2], placed: &Placed) {
        let [kept, gone] = if self.mesh.is_locked(v) { [v, u] } else { [u, v] };
        if kept != u {
            self.inspector.stars.swap(0, 1);
        }
        self.inspector.collapse(&mut self.mesh, [kept, gone], placed.position);
        self.largest = self.largest.max(placed.error);
        self.curve.record(placed.cost, self.mesh.triangle_count);
        let Simplifier { queue, target, .. } = self;
        let mut push = |mesh: &WorkMesh, w: u32| push(mesh, queue, target, [kept, w]);
        self.inspector.for_each_neighbor(&mut self.mesh, kept, &mut push);
        if self.queue.len() > self.most_waiting {
            let mesh = &self.mesh;
            self.queue.retain(|entry| entry.stamp == mesh.stamp(entry.ends));
            self.most_waiting = MOST_OUTDATED * self.queue.len();
        }
    }
}

fn push(mesh: &WorkMesh, queue: &mut Queue, target: &Target, ends: [u32; 2]) {
    if let Some(placed) = place(mesh, ends).filter(|placed| placed.cost < target.max_cost) {
        queue.push(placed.cost, Entry { ends, stamp: mesh.stamp(ends), is_priced: false });
    }
}

/// Finds the best place for both ends of an edge: where the locked one is if one is. `None` if both are locked.
fn place(mesh: &WorkMesh, [u, v]: [u32; 2]) -> Option<Placed> {
    let [p, q] = [u, v].map(|v| mesh.vertex(v));
    let sum = p.quadric + q.quadric;
    let [wp, wq] = [p, q].map(|v| v.quadric.weight() * PULL);
    let position = match [u, v].map(|v| mesh.is_locked(v)) {
        [true, true] => return None,
        [true, false] => p.position,
        [false, true] => q.position,
        [false, false] => best(&sum, [(p.position, wp), (q.position, wq)]),
    };
    let spread = SPREAD / PULL
        * (wp * position.distance_squared(p.position) + wq * position.distance_squared(q.position));
    let area_error = sum.error(position);
    let error = if sum.weight() > 0.0 { area_error / sum.weight() } else { 0.0 };
    Some(Placed { position, cost: ordering(area_error + spread, sum.weight()), error })
}

/// The place of least error, drawn to both ends by their pulls.
fn best(sum: &Quadric, [(p, wp), (q, wq)]: [(DVec3, f64); 2]) -> DVec3 {
    let pull = wp + wq;
    let middle = if pull > 0.0 { (p * wp + q * wq) / pull } else { (p + q) * 0.5 };
    sum.optimal(middle, pull).unwrap_or(middle)
}

/// What the queue is ordered by: between the volume between the surfaces, which is best for the mean, and their squared
/// distance, which is best for the maximum. Square roots are the same on all machines, other powers are not.
fn ordering(area_error: f64, weight: f64) -> f64 {
    if weight > 0.0 { area_error / (weight.sqrt() * weight.sqrt().sqrt()) } else { area_error }
}
