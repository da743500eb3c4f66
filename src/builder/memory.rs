//! What the system says of memory; Linux only, 0 elsewhere.

/// A line `Name:   N kB` of a file of the proc file system, in bytes.
fn proc_bytes(file: &str, name: &str) -> u64 {
    let Ok(text) = std::fs::read_to_string(file) else { return 0 };
    text.lines()
        .filter_map(|line| line.strip_prefix(name)?.strip_prefix(':'))
        .filter_map(|rest| rest.trim().strip_suffix("kB")?.trim().parse::<u64>().ok())
        .next()
        .map_or(0, |kilobytes| kilobytes * 1024)
}

/// The most memory that this process has held so far.
pub fn peak_bytes() -> u64 {
    proc_bytes("/proc/self/status", "VmHWM")
}

/// The memory of the machine.
pub fn total_bytes() -> u64 {
    proc_bytes("/proc/meminfo", "MemTotal")
}

/// Gives memory back to the system that was freed, but lies between what is still used. Blocks take much for
/// a short time, and their records stay: without this, 16 M triangles in 100 files took 312 MB instead of
/// 269 MB, of which 47 MB were in use at most. It takes 3 % of the time.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn give_back() {
    // SAFETY: `malloc_trim` may be called at any time by any thread, and moves nothing that is allocated.
    unsafe { libc::malloc_trim(0) };
}

/// Other allocators give it back themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back() {}
