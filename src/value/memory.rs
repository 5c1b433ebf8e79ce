//! Memory that this process can still allocate.

use std::fs;
use std::path::Path;

/// Memory that this process can still allocate, under the tightest limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Available {
    /// Number of bytes.
    pub bytes: u64,
    /// The limit, as a noun.
    pub limit: &'static str,
}

/// Returns the memory that this process can still allocate. Returns `None` if no limit is known.
pub fn available_memory() -> Option<Available> {
    let limits = [
        (free_address_space(), "the limit on address space, `ulimit -v`"),
        (free_in_control_group(Path::new("/sys/fs/cgroup")), "the limit of the control group"),
        (free_in_machine(), "the free memory of this machine"),
    ];
    let known =
        limits.into_iter().filter_map(|(bytes, limit)| Some(Available { bytes: bytes?, limit }));
    known.min_by_key(|available| available.bytes)
}

/// Formats a number of bytes: `17 MB`, `3.2 GB`.
pub fn megabytes(bytes: u64) -> String {
    match bytes as f64 * 1e-6 {
        mb if mb < 1e3 => format!("{mb:.0} MB"),
        mb => format!("{:.1} GB", mb * 1e-3),
    }
}

/// Address space that the resource limit leaves; `None` without a limit.
#[cfg(target_os = "linux")]
fn free_address_space() -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    let limit = getrlimit(Resource::As).current?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    Some(limit.saturating_sub(1024 * value_of(&status, "VmSize:")?))
}

/// Address space that the resource limit leaves: unknown on this system.
#[cfg(not(target_os = "linux"))]
fn free_address_space() -> Option<u64> {
    None
}

/// Memory that the control groups (version 2) of this process leave, from its own group up to
/// `root`. Pages of files that are not in use count as free.
fn free_in_control_group(root: &Path) -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let own = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let free = |folder: &Path| -> Option<u64> {
        let number = |file: &str| first_number(&fs::read_to_string(folder.join(file)).ok()?);
        let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let reclaimable = value_of(&statistics, "inactive_file").unwrap_or(0);
        let in_use = number("memory.current")?.saturating_sub(reclaimable);
        Some(number("memory.max")?.saturating_sub(in_use))
    };
    root.join(own).ancestors().take_while(|folder| folder.starts_with(root)).filter_map(free).min()
}

/// Memory and swap of the machine that programs can get without others being stopped.
fn free_in_machine() -> Option<u64> {
    let statistics = fs::read_to_string("/proc/meminfo").ok()?;
    let kilobytes = |name| value_of(&statistics, name);
    Some(1024 * (kilobytes("MemAvailable:")? + kilobytes("SwapFree:").unwrap_or(0)))
}

/// Returns the number that `text` begins with.
fn first_number(text: &str) -> Option<u64> {
    text.split_whitespace().next()?.parse().ok()
}

/// Returns the number after the word `name` at the beginning of a line.
fn value_of(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find(|line| line.split_whitespace().next() == Some(name))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn this_machine_has_memory() {
        let available = available_memory().unwrap();
        assert!(available.bytes > 1 << 20, "{available:?}");
        assert!(free_in_machine().unwrap() >= available.bytes);
    }

    #[test]
    fn statistics_of_the_kernel_are_parsed() {
        let text = "MemTotal:   100 kB\nMemAvailable:  42 kB\nSwapFree: x\n";
        assert_eq!(value_of(text, "MemAvailable:"), Some(42));
        assert_eq!((value_of(text, "SwapFree:"), value_of(text, "Mem")), (None, None));
        assert_eq!((first_number("max\n"), first_number("77 12\n")), (None, Some(77)));
    }

    #[test]
    fn bytes_have_units() {
        assert_eq!([17_400_000, 3_210_000_000].map(megabytes), ["17 MB", "3.2 GB"]);
    }
}
