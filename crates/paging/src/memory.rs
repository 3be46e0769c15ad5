//! How much memory may be taken without pushing others out.

use std::fs::read_to_string;

/// Half of what the system and the control group of this process have left; 0 where nothing tells.
pub(crate) fn spare_bytes() -> u64 {
    let system = read_to_string("/proc/meminfo").ok().and_then(|text| available(&text));
    let limit = read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| text.trim().parse().ok());
    system.unwrap_or(0).min(limit.unwrap_or(u64::MAX)) / 2
}

/// The line `MemAvailable:  123 kB`, in bytes.
fn available(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_is_found() {
        let meminfo = "MemTotal:       24689764 kB\nMemAvailable:   22000000 kB\n";
        assert_eq!(available(meminfo), Some(22_000_000 * 1024));
        assert_eq!(available("MemTotal: 1 kB\n"), None);
    }
}
