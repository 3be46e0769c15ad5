//! Connected parts of a mesh.

/// Which triangle belongs to which part: triangles that share a vertex are of one part.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Part of each triangle. Parts are numbered in the order of their first triangles.
    pub of_triangle: Vec<u32>,
    /// Triangles of each part.
    pub sizes: Vec<u32>,
}

impl Parts {
    /// The parts of a mesh with so many vertices.
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn of(vertex_count: usize, triangles: &[[u32; 3]]) -> Parts {
        let mut sets = Sets((0..vertex_count as u32).collect());
        for &[a, b, c] in triangles {
            sets.join(a, b);
            sets.join(b, c);
        }
        const NONE: u32 = u32::MAX;
        let mut numbers = vec![NONE; vertex_count];
        let mut sizes = Vec::new();
        let part = |triangle: &[u32; 3]| {
            let number = &mut numbers[sets.root(triangle[0]) as usize];
            if *number == NONE {
                *number = sizes.len() as u32;
                sizes.push(0);
            }
            sizes[*number as usize] += 1;
            *number
        };
        let of_triangle = triangles.iter().map(part).collect();
        Parts { of_triangle, sizes }
    }
}

/// Disjoint sets of vertices: for each vertex another of the same set; a root names itself.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut v: u32) -> u32 {
        while self.0[v as usize] != v {
            // Halves the path for those who come later.
            let next = self.0[self.0[v as usize] as usize];
            self.0[v as usize] = next;
            v = next;
        }
        v
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_share_a_vertex_are_one_part() {
        let parts = Parts::of(12, &[[0, 1, 2], [5, 4, 3], [6, 7, 8], [2, 9, 10], [4, 3, 11], [10, 7, 6]]);
        assert_eq!(parts.of_triangle, [0, 1, 0, 0, 1, 0]);
        assert_eq!(parts.sizes, [4, 2]);
    }
}
