//! Watches the scratch files of a conversion from the outside, but for those without a name: vertices of text files, and
//! runs of the last sort.

use raystrips_extmem::disk::bytes_on_disk;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two looks.
const INTERVAL: Duration = Duration::from_millis(20);
/// Files that go into the pack: not scratch.
const OF_THE_PACK: [&str; 4] = ["pack", "ids", "emitters", "job"];

/// Looks at the folder of an unfinished pack until it is asked.
pub struct ScratchWatch {
    ended: Arc<AtomicBool>,
    most: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl ScratchWatch {
    /// Watches the conversion to `pack`.
    pub fn start(pack: &Path) -> ScratchWatch {
        let mut folder = pack.as_os_str().to_owned();
        folder.push(".partial");
        let folder = PathBuf::from(folder);
        let (ended, most) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let (thread_ended, thread_most) = (ended.clone(), most.clone());
        let thread = std::thread::spawn(move || {
            while !thread_ended.load(Ordering::Relaxed) {
                thread_most.fetch_max(scratch_bytes(&folder), Ordering::Relaxed);
                std::thread::sleep(INTERVAL);
            }
        });
        ScratchWatch { ended, most, thread: Some(thread) }
    }

    /// Most bytes that were there at a time.
    pub fn most_bytes(mut self) -> u64 {
        self.ended.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
        self.most.load(Ordering::Relaxed)
    }
}

fn scratch_bytes(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let scratch = files.filter(|file| !OF_THE_PACK.iter().any(|name| file.file_name() == *name));
    scratch.filter_map(|file| file.metadata().ok()).map(|metadata| bytes_on_disk(&metadata)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_pack_do_not_count() {
        let folder = tempfile::tempdir().unwrap();
        let partial = folder.path().join("a.rsp.partial");
        std::fs::create_dir(&partial).unwrap();
        std::fs::write(partial.join("pack"), [0; 1 << 20]).unwrap();
        std::fs::write(partial.join("imported"), [1; 1 << 16]).unwrap();
        // Some file systems find room for what is written only later.
        std::fs::File::open(partial.join("imported")).unwrap().sync_all().unwrap();
        assert!((1 << 16..1 << 20).contains(&scratch_bytes(&partial)));
        let watch = ScratchWatch::start(&folder.path().join("a.rsp"));
        while watch.most.load(Ordering::Relaxed) == 0 {
            std::thread::yield_now();
        }
        assert_eq!(watch.most_bytes(), scratch_bytes(&partial));
    }
}
