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
