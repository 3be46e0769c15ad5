//! What tests of several generators ask of a mesh.

use super::sink::Kept;
use std::collections::HashMap;

/// Edges that are not used once in each direction, vertices at the same position being one.
pub fn open_edges(mesh: &Kept) -> usize {
    let mut numbers: HashMap<[u32; 3], usize> = HashMap::new();
    let number = |p: &[f32; 3]| {
        let next = numbers.len();
        *numbers.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(next)
    };
    let vertices: Vec<usize> = mesh.positions.iter().map(number).collect();
    let mut uses: HashMap<[usize; 2], u32> = HashMap::new();
    for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|v| vertices[v as usize])) {
        [[a, b], [b, c], [c, a]].into_iter().for_each(|edge| *uses.entry(edge).or_default() += 1);
    }
    uses.iter().filter(|&(&[a, b], &count)| count != 1 || uses.get(&[b, a]) != Some(&1)).count()
}
