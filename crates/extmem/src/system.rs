//! What the system says of memory: how much may be taken without pushing others out, and how much this process has.

use std::fs::read_to_string;
use std::path::Path;

/// Half of the memory that the system and the control groups of this process leave; `None` where nothing tells.
pub fn spare_memory() -> Option<u64> {
    let system = read_to_string("/proc/meminfo").ok().and_then(|text| line_bytes(&text, "MemAvailable:"));
    let groups = read_to_string("/proc/self/cgroup").unwrap_or_default();
    let limits =
        limit_files(&groups).into_iter().filter_map(|file| read_to_string(file).ok()?.trim().parse().ok());
    limits.chain(system).min().map(|bytes: u64| bytes / 2)
}

/// Takes memory in small pages from here on, where the system would give huge ones unasked: of those more is taken than is
/// used, which counts.
pub fn refuse_huge_pages() {
    // A system that does not know of it gives none.
    #[cfg(target_os = "linux")]
    let _ = rustix::thread::disable_transparent_huge_pages(true);
}

/// Memory that the process holds, in bytes. 0 where the system does not tell.
pub fn process_memory() -> u64 {
    status_bytes("VmRSS:")
}

/// Most memory that the process ever held, in bytes. 0 where the system does not tell.
pub fn peak_process_memory() -> u64 {
    status_bytes("VmHWM:")
}

fn status_bytes(name: &str) -> u64 {
    read_to_string("/proc/self/status").ok().and_then(|text| line_bytes(&text, name)).unwrap_or(0)
}

/// The number in a line like `MemAvailable:  123 kB`, in bytes.
fn line_bytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// The files with limits of the groups in `groups`, a line `number:controllers:path` each, and of those around them.
/// In a container the path may be that of the host, but then the outermost group is its own.
fn limit_files(groups: &str) -> Vec<String> {
    let mut files = Vec::new();
    for line in groups.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (fields.next(), fields.next()) else { continue };
        let (root, name) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            _ if controllers.split(',').any(|c| c == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
            }
            _ => continue,
        };
        let around = Path::new(path).ancestors().filter_map(Path::to_str);
        files.extend(around.map(|group| format!("{root}{}/{name}", group.trim_end_matches('/'))));
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_found() {
        let meminfo = "MemTotal:       24689764 kB\nMemAvailable:   22000000 kB\n";
        assert_eq!(line_bytes(meminfo, "MemAvailable:"), Some(22_000_000 * 1024));
        assert_eq!(line_bytes("MemTotal: 1 kB\n", "MemAvailable:"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_that_is_used_is_seen() {
        let before = process_memory();
        let bytes = vec![1u8; 64 << 20];
        assert!(process_memory() > before + (32 << 20) && peak_process_memory() > before + (32 << 20));
        drop(bytes);
    }

    #[test]
    fn groups_of_both_versions_and_those_around_them() {
        let files = limit_files("12:cpu,cpuacct:/x\n9:memory:/a/b\n0::/c\n");
        let expected = [
            "/sys/fs/cgroup/memory/a/b/memory.limit_in_bytes",
            "/sys/fs/cgroup/memory/a/memory.limit_in_bytes",
            "/sys/fs/cgroup/memory/memory.limit_in_bytes",
            "/sys/fs/cgroup/c/memory.max",
            "/sys/fs/cgroup/memory.max",
        ];
        assert_eq!(files, expected);
    }
}
