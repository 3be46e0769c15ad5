//! Helpers of the tests.

use crate::{Import, ImportError, ImportOptions, StrandBatch, TriangleBatch, TriangleSink, import};
use std::io;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Keeps all batches.
#[derive(Debug, Default)]
pub(crate) struct Collect(pub Vec<TriangleBatch>, pub Vec<StrandBatch>);

impl TriangleSink for Collect {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        assert!(!batch.triangles.is_empty());
        assert!(batch.triangles.iter().flatten().all(|&i| (i as usize) < batch.positions.len()));
        assert!(batch.positions.iter().flatten().all(|x| x.abs() <= 1e18));
        self.0.push(batch);
        Ok(())
    }

    fn strands(&mut self, batch: StrandBatch) -> io::Result<()> {
        assert_eq!(batch.lengths.iter().sum::<u32>() as usize, batch.positions.len());
        assert!(
            batch.radii.len() == batch.positions.len() && batch.lengths.iter().all(|&length| length >= 2)
        );
        assert!(batch.radii.iter().all(|radius| *radius >= 0.0 && radius.is_finite()));
        self.1.push(batch);
        Ok(())
    }
}

impl Collect {
    /// All triangles with their ids, in order of ids.
    pub fn triangles(&self) -> Vec<(u64, [[f64; 3]; 3])> {
        let mut all: Vec<_> = self
            .0
            .iter()
            .flat_map(|batch| {
                let ids = batch.first_triangle_id..;
                ids.zip(batch.triangles.iter().map(|t| t.map(|i| batch.positions[i as usize])))
            })
            .collect();
        all.sort_by_key(|(id, _)| *id);
        all
    }
}

pub(crate) fn write_file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// Imports a file and checks that an error is one line with the name of the file.
pub(crate) fn import_path(path: &Path, options: &ImportOptions) -> Result<(Import, Collect), ImportError> {
    let mut sink = Collect::default();
    match import(&[path.to_owned()], options, &mut sink) {
        Ok(done) => {
            assert_eq!(done.report.triangles, sink.0.iter().map(|b| b.triangles.len() as u64).sum::<u64>());
            assert!(sink.0.iter().all(|b| (b.geometry as usize) < done.scene.geometries.len()));
            assert!(done.scene.geometries.iter().all(|g| (g.material as usize) < done.scene.materials.len()));
            Ok((done, sink))
        }
        Err(error) => {
            let message = error.to_string();
            let name = path.file_stem().and_then(|name| name.to_str()).unwrap();
            assert!(!message.contains('\n') && message.contains(name), "{message}");
            Err(error)
        }
    }
}

pub(crate) fn import_bytes(name: &str, bytes: &[u8]) -> Result<(Import, Collect), ImportError> {
    let (_dir, path) = write_file(name, bytes);
    import_path(&path, &ImportOptions::default())
}

/// Checks that a file of more than a million vertices gives the same whatever may be kept in memory, and that a
/// scratch folder that is not there is named when it is needed. Gives the triangles.
pub(crate) fn import_with_any_memory(name: &str, bytes: &[u8]) -> Vec<(u64, [[f64; 3]; 3])> {
    let (_dir, path) = write_file(name, bytes);
    let import = |kept_bytes, scratch| {
        let options = ImportOptions { kept_bytes, scratch, ..ImportOptions::default() };
        let mut sink = Collect::default();
        import(std::slice::from_ref(&path), &options, &mut sink).map(|done| (done.report, sink))
    };
    let (report, sink) = import(1 << 30, Some("/not/there".into())).unwrap();
    for kept_bytes in [0, 1 << 20, 30 << 20] {
        let (other_report, other) = import(kept_bytes, None).unwrap();
        assert!(other.0 == sink.0 && other_report == report, "{kept_bytes}");
    }
    let error = import(0, Some("/not/there".into())).unwrap_err();
    assert!(matches!(&error, ImportError::Scratch { folder, .. } if folder == Path::new("/not/there")));
    sink.triangles()
}

/// Imports every beginning of a file: each must end well or in a clean error.
pub(crate) fn import_all_prefixes(name: &str, bytes: &[u8]) {
    let (_dir, path) = write_file(name, bytes);
    for length in 0..=bytes.len() {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let result = import_path(&path, &ImportOptions::default());
        assert!(length < bytes.len() || result.is_ok(), "the whole file: {:?}", result.err());
    }
}
