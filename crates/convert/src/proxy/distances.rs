//! How far the proxy is from the model, of which a piece at a time is in memory.

use crate::distribute::Pieces;
use crate::{ConvertError, Observer, Stage};
use glam::DVec3;
use rayon::prelude::*;
use raystrips_simplify::measure::{Surface, Tally, distances};
use raystrips_simplify::{ClosestPoint, Distances};
use raystrips_strips::Mesh;

/// Bytes of memory that it takes, a triangle of the proxy and a point.
pub(super) const TRIANGLE_BYTES: u64 = 90;
pub(super) const POINT_BYTES: u64 = 32;

/// Points between one look at whether to stop and the next.
const RUN: usize = 1 << 15;

/// Distances between model and proxy, with so many points on each.
pub(super) fn between(
    pieces: &Pieces,
    proxy: &Mesh,
    points: usize,
    observer: &dyn Observer,
) -> Result<Distances, ConvertError> {
    let mut tally = to_proxy(pieces, proxy, points, observer)?;
    tally.add(&from_proxy(pieces, proxy, points, observer)?);
    Ok(tally.distances())
}

/// Distances of points of the model to the proxy.
fn to_proxy(
    pieces: &Pieces,
    proxy: &Mesh,
    points: usize,
    observer: &dyn Observer,
) -> Result<Tally, ConvertError> {
    let mut areas = Vec::with_capacity(pieces.sources.len());
    for number in 0..pieces.sources.len() {
        let mesh = pieces.read(number)?.mesh;
        areas.push(Surface::of(&mesh.positions, &mesh.triangles).area());
    }
    let closest = ClosestPoint::of(&proxy.positions, &proxy.triangles);
    let total: f64 = areas.iter().sum();
    // The number of the first point at or after so much area; one lies in the middle of each of equal shares.
    let first_point = |area: f64| ((area / total * points as f64 + 0.5) as usize).min(points);
    let mut tally = Tally::default();
    let mut before = 0.0;
    for (number, area) in areas.into_iter().enumerate() {
        let mesh = pieces.read(number)?.mesh;
        let surface = Surface::of(&mesh.positions, &mesh.triangles);
        let range = first_point(before)..first_point(before + area);
        let begin = before;
        let point = |i: usize| surface.point(i, (i as f64 + 0.5) / points as f64 * total - begin);
        for begin in range.clone().step_by(RUN) {
            tally.add(&distances(&closest, begin..range.end.min(begin + RUN), point));
            check(observer)?;
        }
        before += area;
        observer.progress(Stage::Measure, number as u64 + 1, 2 * pieces.sources.len() as u64);
    }
    Ok(tally)
}

/// Distances of points of the proxy to the model.
fn from_proxy(
    pieces: &Pieces,
    proxy: &Mesh,
    points: usize,
    observer: &dyn Observer,
) -> Result<Tally, ConvertError> {
    let surface = Surface::of(&proxy.positions, &proxy.triangles);
    let point = |i: usize| (surface.point(i, surface.stratum(i, points)), f64::INFINITY);
    let mut nearest: Vec<(DVec3, f64)> = (0..points).into_par_iter().map(point).collect();
    for number in 0..pieces.sources.len() {
        let mesh = pieces.read(number)?.mesh;
        let closest = ClosestPoint::of(&mesh.positions, &mesh.triangles);
        for run in nearest.chunks_mut(RUN) {
            run.par_iter_mut()
                .for_each(|(point, most)| *most = closest.distance_squared_within(*point, *most));
            check(observer)?;
        }
        let count = pieces.sources.len();
        observer.progress(Stage::Measure, (count + number) as u64 + 1, 2 * count as u64);
    }
    let mut tally = Tally::default();
    nearest.iter().for_each(|(_, distance_squared)| tally.push(*distance_squared));
    Ok(tally)
}

fn check(observer: &dyn Observer) -> Result<(), ConvertError> {
    if observer.is_cancelled() { Err(ConvertError::Cancelled) } else { Ok(()) }
}
