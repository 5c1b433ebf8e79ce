//! Restart of the program with one memory arena of glibc's allocator if `ulimit -v` limits its
//! address space.
//!
//! The allocator of glibc reserves an arena of 64 MB of address space for each thread. If the
//! address space is limited by `ulimit -v`, the arenas of a few threads take all of it. Small
//! allocations then fail while most of the memory is free. A single arena for all threads avoids
//! this failure. The number of arenas is read from the environment at the start of a process.

#[cfg(all(target_os = "linux", target_env = "gnu"))]
const VARIABLE: &str = "MALLOC_ARENA_MAX";

/// Limits the allocator of glibc to one memory arena if the address space of the process is limited
/// (`ulimit -v`) and the environment does not set the number of arenas. For this purpose the
/// program restarts in the same process. Returns if no restart is needed or the restart fails.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn limit() {
    use std::os::unix::process::CommandExt;
    use std::process::Command;
    if !zerkalo_scene::process_memory::address_space_is_limited() || std::env::var_os(VARIABLE).is_some() {
        return;
    }
    let mut arguments = std::env::args_os();
    let (Ok(program), Some(name)) = (std::env::current_exe(), arguments.next()) else { return };
    // `exec` returns only if it fails. The program then runs with the arenas that it has.
    let _ = Command::new(program).arg0(name).args(arguments).env(VARIABLE, "1").exec();
}

/// Does nothing on systems other than Linux with glibc: the variable `MALLOC_ARENA_MAX` is one of
/// glibc.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn limit() {}
