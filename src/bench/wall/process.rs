//! What the operating system knows of this process.

/// Bytes of memory that this process occupies; 0 where that is not known.
pub(super) fn resident_bytes() -> u64 {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return 0 };
    let kib = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).and_then(|rest| {
        rest.trim().strip_suffix("kB").and_then(|number| number.trim().parse::<u64>().ok())
    });
    kib.unwrap_or(0) * 1024
}

#[cfg(test)]
mod tests {
    #[test]
    #[cfg(target_os = "linux")]
    fn memory_that_is_touched_counts() {
        let before = super::resident_bytes();
        let touched = vec![1u8; 64 << 20];
        let after = super::resident_bytes();
        assert!(after > before + (48 << 20), "{before} {after} {}", touched[12_345]);
    }
}
