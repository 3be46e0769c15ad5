//! Figures of the paper's tables (Lauterbach, Yoon, Manocha 2007, section 6), to be printed beside ours.
//!
//! MB are 2^20 bytes: that is what 48 bytes a triangle come to in its Table 1.

/// Bytes of a structure in MB, as in Table 1.
#[derive(Clone, Copy, Debug)]
pub struct Memory {
    /// Triangles and vertices.
    pub geometry: f64,
    /// Nodes.
    pub hierarchy: f64,
    /// Both, as printed.
    pub total: f64,
}

/// A row of the paper's tables.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// Name in the paper.
    pub name: &'static str,
    /// Words in the names of its files.
    pub aliases: &'static [&'static str],
    /// Triangles: those of the file where there is one to be had, else as the paper rounds them.
    pub triangles: f64,
    /// Table 1: Ray-Strips, BVH over minimal triangles, BVH over optimized triangles.
    pub memory: [Memory; 3],
    /// Table 3, pictures of 512 x 512 a second with single rays: Ray-Strips, BVH.
    pub single_fps: [f64; 2],
    /// Table 4, the same with 2x2 packets.
    pub packet_fps: [f64; 2],
    /// Table 5, seconds of construction: Ray-Strips, BVH.
    pub seconds: [f64; 2],
    /// Table 5, average triangles of a strip, swaps included.
    pub strip_length: f64,
    /// Table 5, strips.
    pub strips: u64,
}

/// Pixels of the paper's pictures.
pub const PICTURE_SIDE: usize = 512;

const fn memory(geometry: f64, hierarchy: f64, total: f64) -> Memory {
    Memory { geometry, hierarchy, total }
}

/// All models of the paper.
pub const MODELS: [Model; 6] = [
    Model {
        name: "Bunny",
        aliases: &["bunny"],
        triangles: 69_451.0,
        memory: [memory(1.2, 0.3, 1.5), memory(1.4, 4.2, 5.5), memory(3.2, 4.2, 7.4)],
        single_fps: [2.39, 4.52],
        packet_fps: [7.04, 10.42],
        seconds: [0.4, 0.03],
        strip_length: 19.29,
        strips: 4260,
    },
    Model {
        name: "Buddha",
        aliases: &["buddha", "happy"],
        triangles: 1_087_716.0,
        memory: [memory(11.0, 11.0, 23.0), memory(20.0, 66.0, 87.0), memory(49.0, 66.0, 116.0)],
        single_fps: [2.26, 3.72],
        packet_fps: [5.21, 5.10],
        seconds: [5.5, 0.7],
        strip_length: 29.58,
        strips: 46_591,
    },
    Model {
        name: "Thai",
        aliases: &["thai", "statuette"],
        triangles: 10e6,
        // Printed as 163; only 109 gives the printed total.
        memory: [memory(109.0, 106.0, 215.0), memory(190.0, 610.0, 801.0), memory(457.0, 610.0, 1068.0)],
        single_fps: [2.29, 3.04],
        packet_fps: [3.89, 3.10],
        seconds: [48.1, 7.1],
        strip_length: 24.95,
        strips: 502_577,
    },
    Model {
        name: "Power plant",
        aliases: &["power"],
        triangles: 12.7e6,
        memory: [memory(196.0, 198.0, 395.0), memory(296.0, 778.0, 1075.0), memory(583.0, 778.0, 1361.0)],
        single_fps: [0.70, 0.39],
        packet_fps: [1.76, 0.71],
        seconds: [68.9, 29.6],
        strip_length: 7.75,
        strips: 1_890_760,
    },
    Model {
        name: "Lucy",
        aliases: &["lucy"],
        triangles: 28_055_742.0,
        memory: [memory(301.0, 279.0, 581.0), memory(535.0, 1712.0, 2247.0), memory(1284.0, 1712.0, 2996.0)],
        single_fps: [1.85, 0.04],
        packet_fps: [2.95, 0.05],
        seconds: [1764.0, 149.6],
        strip_length: 31.01,
        strips: 1_122_074,
    },
    Model {
        name: "Iso-surface",
        aliases: &["isosurface", "iso-surface", "iso_surface"],
        triangles: 10e6,
        memory: [memory(110.0, 108.0, 220.0), memory(195.0, 626.0, 822.0), memory(469.0, 626.0, 1095.0)],
        single_fps: [1.73, 2.62],
        packet_fps: [4.20, 5.52],
        seconds: [49.3, 6.3],
        strip_length: 24.69,
        strips: 519_468,
    },
];

/// Table 2, MB of hierarchies: Ray-Strips, kd-tree, spatial kd-tree, LBVH, LPBVH.
pub const HIERARCHIES: [(&str, [Option<f64>; 5]); 3] = [
    ("Bunny", [Some(0.3), Some(4.1), Some(0.9), Some(0.5), Some(0.3)]),
    ("Buddha", [Some(11.0), Some(29.0), Some(17.0), Some(8.3), None]),
    ("Lucy", [Some(279.0), None, None, Some(214.0), Some(103.0)]),
];

impl Model {
    /// The model of the paper that a file of this name, without extension, must be.
    pub fn of_file(stem: &str) -> Option<&'static Model> {
        let stem = stem.to_lowercase();
        MODELS.iter().find(|model| model.aliases.iter().any(|alias| stem.contains(alias)))
    }

    /// The models of the paper that none of the given files is.
    pub fn others<'a>(stems: impl IntoIterator<Item = &'a str>) -> Vec<&'static Model> {
        let given: Vec<&str> = stems.into_iter().filter_map(Model::of_file).map(|model| model.name).collect();
        MODELS.iter().filter(|model| !given.contains(&model.name)).collect()
    }
}

/// Pictures a second as million rays a second.
pub fn million_rays(fps: f64) -> f64 {
    fps * (PICTURE_SIDE * PICTURE_SIDE) as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_find_their_model() {
        assert_eq!(Model::of_file("Bunny").unwrap().name, "Bunny");
        assert_eq!(Model::of_file("happy_stand").unwrap().name, "Buddha");
        assert!(Model::of_file("iso_carp").is_none());
        assert_eq!(Model::others(["bunny", "lucy", "x"]).len(), 4);
    }

    #[test]
    fn totals_are_the_sums_that_the_paper_prints() {
        for memory in MODELS.iter().flat_map(|model| model.memory) {
            assert!((memory.geometry + memory.hierarchy - memory.total).abs() <= 2.0, "{memory:?}");
        }
    }
}
