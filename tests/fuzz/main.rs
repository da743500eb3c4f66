//! Whatever reads files, over thousands of seeded changes of sound ones: no panic, no refusal that
//! blames anything but the input, and no more memory than the input's size allows. The fuzz targets
//! in `fuzz/` run the same for as long as somebody likes.

#[path = "../../fuzz/readers.rs"]
mod readers;

mod changes;
mod memory;
mod seeds;

use changes::Changes;
use readers::Reader;

/// Changed files of each kind.
const EACH: u64 = 1_000;

/// What a reader may hold at once: some buffers that do not depend on the input, and so many bytes
/// for each of it. A face of 8 characters, `f 1 1 1`, becomes a triangle, and a triangle with three
/// vertices of its own takes 150 bytes, twice while arrays grow.
const BASE_BYTES: usize = 256 << 10;
const BYTES_PER_BYTE: usize = 100;

/// A compressed picture may be of any size, up to what its header says: of that, not of its file.
fn texels_of(reader: Reader) -> usize {
    match reader {
        // No seed has more; a change of the header is refused or costs what it says.
        Reader::Png | Reader::Jpeg => seeds::MOST_TEXELS,
        _ => 0,
    }
}

#[test]
fn changed_files_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut failures = Vec::new();
    let start = std::time::Instant::now();
    for reader in Reader::ALL {
        let seeds = seeds::of(reader, folder.path());
        let (mut accepted, mut most) = (0u64, 0.0f64);
        for seed in 0..EACH {
            let whole = &seeds[seed as usize % seeds.len()];
            let bytes = if seed < seeds.len() as u64 {
                whole.clone()
            } else {
                Changes::new(seed).apply(whole, &seeds)
            };
            let place = tempfile::tempdir().unwrap();
            let read = || readers::Reader::read(reader, &bytes, place.path());
            let (found, peak) =
                memory::peak(|| std::panic::catch_unwind(std::panic::AssertUnwindSafe(read)));
            let bound = BASE_BYTES + BYTES_PER_BYTE * bytes.len() + 16 * texels_of(reader);
            most = most.max(peak as f64 / bound as f64);
            if peak > bound {
                failures.push(format!("{reader:?} {seed}: {peak} bytes held for {}", bytes.len()));
            }
            match found {
                Ok(true) => accepted += 1,
                Ok(false) if seed < seeds.len() as u64 => {
                    failures.push(format!("{reader:?}: seed {seed} is refused"));
                }
                Ok(false) => {}
                Err(_) => failures.push(format!("{reader:?} {seed}: panics")),
            }
        }
        println!(
            "{:?} {reader:?}: {accepted} of {EACH} accepted, {:.0} % of the memory allowed",
            start.elapsed(),
            most * 100.0
        );
        // Changes that are all refused, or all harmless, would test nothing. A material that
        // cannot be understood is a warning.
        assert!(accepted > seeds.len() as u64, "{reader:?}");
        assert!(accepted < EACH || reader == Reader::Mtl, "{reader:?}");
    }
    // Of large files, so that what grows with them counts more than what does not.
    for (reader, bytes) in seeds::large() {
        let place = tempfile::tempdir().unwrap();
        let (accepted, peak) = memory::peak(|| reader.read(&bytes, place.path()));
        println!("{reader:?}: {peak} bytes held for {}", bytes.len());
        assert!(accepted && peak > bytes.len() / 10, "{reader:?}: nothing was measured");
        assert!(peak <= BASE_BYTES + BYTES_PER_BYTE * bytes.len(), "{reader:?}: {peak}");
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
