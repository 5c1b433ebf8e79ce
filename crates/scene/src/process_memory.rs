//! Memory that this process uses and can still allocate.

use std::fs;
use std::path::Path;

/// Memory that this process can still allocate, by the tightest limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Available {
    /// Number of bytes.
    pub bytes: u64,
    /// Name of the tightest limit, as a noun phrase for messages.
    pub limit: &'static str,
}

/// Returns the memory that this process can still allocate. Returns `None` if no limit is known.
pub fn available_memory() -> Option<Available> {
    tightest([free_address_space(), free_in_own_control_groups(), free_in_machine()])
}

/// Returns the smallest known limit. `free` are the numbers of bytes that the address space, the
/// control groups and the machine permit, `None` where a limit is unknown.
fn tightest(free: [Option<u64>; 3]) -> Option<Available> {
    let limits = [
        "the limit on address space, `ulimit -v`",
        "the limit of the control group",
        "the free memory of this machine",
    ];
    let known = free.into_iter().zip(limits);
    known
        .filter_map(|(bytes, limit)| Some(Available { bytes: bytes?, limit }))
        .min_by_key(|a| a.bytes)
}

/// Memory \[bytes\] that stays free for everything that the callers of [`missing_memory`] do not
/// count: stacks of threads, buffers, fragmentation.
const RESERVE: u64 = 32 << 20;

/// Compares `needed` bytes plus a reserve of 32 MiB with the available memory. Returns `None` if
/// they are available, or if no limit is known. Otherwise returns a phrase such as `needs 210 MB of
/// memory, and 88 MB are available (the free memory of this machine)`.
pub fn missing_memory(needed: u64) -> Option<String> {
    let Available { bytes, limit } = available_memory()?;
    let needed = needed.saturating_add(RESERVE);
    let [sum, available] = [needed, bytes].map(megabytes);
    (bytes < needed)
        .then(|| format!("needs {sum} of memory, and {available} are available ({limit})"))
}

/// Physical memory (resident set) of this process \[bytes\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResidentMemory {
    /// Present size.
    pub now: u64,
    /// Largest size so far.
    pub peak: u64,
}

/// Returns the physical memory of this process; `None` on systems other than Linux.
pub fn resident_memory() -> Option<ResidentMemory> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let bytes = |name| Some(1024 * number_after(&status, name)?);
    Some(ResidentMemory { now: bytes("VmRSS:")?, peak: bytes("VmHWM:")? })
}

/// Formats a number of bytes with its unit, such as `17 MB` or `3.2 GB`.
pub fn megabytes(bytes: u64) -> String {
    match bytes as f64 * 1e-6 {
        mb if mb < 1e3 => format!("{mb:.0} MB"),
        mb => format!("{:.1} GB", mb * 1e-3),
    }
}

/// Address space \[bytes\] that the allocator of glibc reserves for each thread: its memory arena.
const ARENA: u64 = 64 << 20;

/// Returns the largest expected number of threads, each of which reserves an arena: a tracing
/// thread for each processor, up to eight, and six others.
fn expected_threads() -> u64 {
    let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    processors.min(8) as u64 + 6
}

/// Returns the number of bytes of address space that this process may still allocate, without the
/// arenas of threads that have not started; `None` without a limit, and on systems other than Linux.
fn free_address_space() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let limit = number_after(&limits, "Max address space")?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let starting = expected_threads().saturating_sub(number_after(&status, "Threads:")?);
    let in_use = 1024 * number_after(&status, "VmSize:")?;
    Some(limit.saturating_sub(in_use + starting * ARENA))
}

fn free_in_own_control_groups() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    free_in_control_groups(&groups, |path| fs::read_to_string(path).ok())
}

/// Returns the number of bytes that the control groups of a process still permit it to allocate:
/// the minimum over its own group and all groups above it. `groups` is the text of
/// `/proc/PID/cgroup`; `read` returns the text of a file. File pages that the kernel can reclaim
/// count as free. Returns `None` if no group has a limit.
fn free_in_control_groups(groups: &str, read: impl Fn(&Path) -> Option<String>) -> Option<u64> {
    let free = |line: &str| {
        let mut fields = line.splitn(3, ':');
        let (hierarchy, controllers, path) = (fields.next()?, fields.next()?, fields.next()?);
        // The mount point of the memory controller, two files, and an entry of `memory.stat`.
        let (root, limit, in_use, reclaimable) = match hierarchy {
            // Version 2 has one hierarchy, with this number.
            "0" => ("/sys/fs/cgroup", "memory.max", "memory.current", "inactive_file"),
            _ if controllers.split(',').any(|name| name == "memory") => (
                "/sys/fs/cgroup/memory",
                "memory.limit_in_bytes",
                "memory.usage_in_bytes",
                "total_inactive_file",
            ),
            _ => return None,
        };
        let free_in = |folder: &Path| -> Option<u64> {
            let number = |file: &str| first_number(&read(&folder.join(file))?);
            let statistics = read(&folder.join("memory.stat")).unwrap_or_default();
            let reclaimable = number_after(&statistics, reclaimable).unwrap_or(0);
            Some(number(limit)?.saturating_sub(number(in_use)?.saturating_sub(reclaimable)))
        };
        let folder = Path::new(root).join(path.trim_start_matches('/'));
        folder.ancestors().take_while(|folder| folder.starts_with(root)).filter_map(free_in).min()
    };
    groups.lines().filter_map(free).min()
}

/// Returns the number of bytes of memory and swap that the machine can provide without ending other
/// programs; `None` if the system does not report it.
fn free_in_machine() -> Option<u64> {
    let statistics = fs::read_to_string("/proc/meminfo").ok()?;
    let kilobytes = |name| number_after(&statistics, name);
    Some(1024 * (kilobytes("MemAvailable:")? + kilobytes("SwapFree:").unwrap_or(0)))
}

/// Returns the number at the beginning of `text`; `None` if there is none.
fn first_number(text: &str) -> Option<u64> {
    text.split_whitespace().next()?.parse().ok()
}

/// Returns the number after `name` in the line that begins with `name`; `None` if there is none.
fn number_after<'a>(text: &'a str, name: &str) -> Option<u64> {
    let rest = |line: &'a str| line.strip_prefix(name).filter(|rest| rest.starts_with([' ', '\t']));
    first_number(text.lines().find_map(rest)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smallest_known_limit_is_available() {
        let limit = |free| tightest(free).map(|available| (available.bytes, available.limit));
        assert_eq!(limit([None; 3]), None);
        assert_eq!(
            limit([Some(7), Some(9), Some(8)]),
            Some((7, "the limit on address space, `ulimit -v`"))
        );
        assert_eq!(limit([None, Some(8), Some(9)]), Some((8, "the limit of the control group")));
        assert_eq!(limit([None, Some(9), Some(8)]), Some((8, "the free memory of this machine")));
    }

    // Free memory changes from one reading to the next. It is therefore compared only with bounds
    // that do not change, such as the memory of the machine.
    #[test]
    #[cfg(target_os = "linux")]
    fn available_memory_is_within_memory_of_machine() {
        let statistics = fs::read_to_string("/proc/meminfo").unwrap();
        let total = |name| 1024 * number_after(&statistics, name).unwrap();
        let available = available_memory().unwrap();
        assert!(available.bytes > 1 << 20, "{available:?}");
        assert!(available.bytes <= total("MemTotal:") + total("SwapTotal:"), "{available:?}");
        let machine = free_in_machine().unwrap();
        assert!(machine > 1 << 20 && machine <= total("MemTotal:") + total("SwapTotal:"));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn missing_memory_states_both_sums() {
        let missing = missing_memory(1 << 60).unwrap();
        assert!(missing.starts_with("needs 1152921504.6 GB of memory, and "), "{missing}");
        assert!(missing_memory(u64::MAX).is_some());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn resident_memory_includes_a_large_block() {
        let block = std::hint::black_box(vec![1u8; 64 << 20]);
        let with_block = resident_memory().unwrap();
        assert!(with_block.now > block.len() as u64 && with_block.peak >= with_block.now);
        drop(block);
        assert!(resident_memory().unwrap().peak > 64 << 20);
    }

    #[test]
    fn statistics_of_the_kernel_are_parsed() {
        let text = "MemTotal:   100 kB\nMemAvailable:  42 kB\nSwapFree: x\n";
        assert_eq!(number_after(text, "MemAvailable:"), Some(42));
        assert_eq!((number_after(text, "SwapFree:"), number_after(text, "Mem")), (None, None));
        assert_eq!((first_number("max\n"), first_number("77 12\n")), (None, Some(77)));
    }

    #[test]
    fn limits_of_both_versions_of_control_groups_are_read() {
        let file = |path: &Path| {
            let text = match path.to_str()? {
                "/sys/fs/cgroup/memory/jobs/7/memory.limit_in_bytes" => "9223372036854771712\n",
                "/sys/fs/cgroup/memory/jobs/7/memory.usage_in_bytes" => "3000\n",
                "/sys/fs/cgroup/memory/jobs/memory.limit_in_bytes" => "10000\n",
                "/sys/fs/cgroup/memory/jobs/memory.usage_in_bytes" => "4000\n",
                "/sys/fs/cgroup/memory/jobs/memory.stat" => {
                    "inactive_file 7\ntotal_inactive_file 500\n"
                }
                "/sys/fs/cgroup/slice/memory.max" => "8000\n",
                "/sys/fs/cgroup/slice/memory.current" => "1000\n",
                "/sys/fs/cgroup/slice/memory.stat" => "inactive_file 30\n",
                "/sys/fs/cgroup/slice/run/memory.max" => "max\n",
                "/sys/fs/cgroup/slice/run/memory.current" => "900\n",
                _ => return None,
            };
            Some(text.to_string())
        };
        let version_1 = "6:cpu:/jobs/7\n5:hugetlb,memory:/jobs/7\n1:name=systemd:/\n";
        let version_2 = "0::/slice/run\n";
        let free = |groups: &str| free_in_control_groups(groups, file);
        assert_eq!(free(version_1), Some(6500));
        assert_eq!(free(version_2), Some(7030));
        assert_eq!(free(&(version_1.to_string() + version_2)), Some(6500));
        // In a container, the files of the control groups above its own may be invisible.
        assert_eq!(free("5:memory:/docker/0/deep\n0::/../outside\n"), None);
        assert_eq!(free(""), None);
    }

    #[test]
    fn bytes_have_units() {
        assert_eq!([17_400_000, 3_210_000_000].map(megabytes), ["17 MB", "3.2 GB"]);
    }
}
