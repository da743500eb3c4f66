//! `scans.hlod`: the histograms of inputs. The next build partitions all inputs without reading those that
//! have not changed.

use std::path::Path;

use crate::builder::partition::{CellBox, Cluster, Scan};
use crate::builder::plan::KnownInput;
use crate::format::SCANS_FILE;
use crate::report::build_report::InputReport;

/// First bytes of the file. The last one is the version.
const MAGIC: &[u8; 8] = b"hlodscn\x02";

/// Numbers of a cluster.
const NUMBERS: usize = 15;

/// Serialises histograms, little-endian, in the order of the report's inputs.
pub fn scans_to_bytes(inputs: &[KnownInput]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend((inputs.len() as u32).to_le_bytes());
    for KnownInput { scan: Scan { bounds, clusters }, .. } in inputs {
        bytes.extend(bounds.corners().as_flattened().iter().flat_map(|at| at.to_le_bytes()));
        bytes.extend((clusters.len() as u32).to_le_bytes());
        for Cluster { triangles, texels, middles, largest, around } in clusters {
            let boxes = [middles.corners(), around.corners()].into_iter().flatten().flatten();
            let numbers = [f64::from(*triangles), *texels, *largest].into_iter().chain(boxes);
            bytes.extend(numbers.flat_map(f64::to_le_bytes));
        }
    }
    bytes
}

/// The inputs of a result; `None` where the file is missing, damaged, or of another result.
pub fn known_inputs(dir: &Path, inputs: &[InputReport]) -> Option<Vec<KnownInput>> {
    let bytes = crate::format::read_regular(&dir.join(SCANS_FILE)).ok()?;
    let scans = scans_of(&bytes).filter(|scans| scans.len() == inputs.len())?;
    let known = |(report, scan): (&InputReport, Scan)| KnownInput { report: report.clone(), scan };
    Some(inputs.iter().zip(scans).map(known).collect())
}

fn scans_of(bytes: &[u8]) -> Option<Vec<Scan>> {
    let mut rest = bytes.strip_prefix(MAGIC)?;
    let rest = &mut rest;
    let count = u32::from_le_bytes(take(rest)?);
    let mut scans = Vec::new();
    for _ in 0..count {
        let [mut low, mut high] = [[0.0; 3]; 2];
        for at in low.iter_mut().chain(&mut high) {
            *at = f64::from_le_bytes(take(rest)?);
        }
        let count = u32::from_le_bytes(take(rest)?) as usize;
        if count > rest.len() / (8 * (NUMBERS)) {
            return None;
        }
        let mut clusters = Vec::with_capacity(count);
        for _ in 0..count {
            let mut numbers = [0.0; NUMBERS];
            for number in &mut numbers {
                *number = f64::from_le_bytes(take(rest)?);
                if !number.is_finite() {
                    return None;
                }
            }
            let corner = |number: usize| std::array::from_fn(|axis| numbers[3 + 3 * number + axis]);
            clusters.push(Cluster {
                triangles: numbers[0] as u32,
                texels: numbers[1],
                middles: CellBox { low: corner(0), high: corner(1) },
                largest: numbers[2],
                around: CellBox { low: corner(2), high: corner(3) },
            });
        }
        scans.push(Scan { bounds: CellBox { low, high }, clusters });
    }
    rest.is_empty().then_some(scans)
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (first, others) = rest.split_first_chunk::<N>()?;
    *rest = others;
    Some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::UpAxis;

    #[test]
    fn is_read_as_it_is_written_and_no_other_file_is() {
        let report = InputReport {
            path: "a.obj".into(),
            files: Vec::new(),
            triangles: 7,
            up: UpAxis::Z,
            up_from: None,
            warnings: Vec::new(),
        };
        let middles = CellBox { low: [1.0, 2.0, 3.0], high: [4.0, 5.0, 6.0] };
        let around = CellBox { low: [0.5; 3], high: [7.0; 3] };
        let cluster = Cluster { triangles: 7, texels: 9.5, middles, largest: 0.5, around };
        let bounds = CellBox { low: [0.0; 3], high: [7.0, 8.0, f64::INFINITY] };
        let input = |count| KnownInput {
            report: report.clone(),
            scan: Scan { bounds, clusters: vec![cluster; count] },
        };
        let inputs = [input(2), input(0)];
        let bytes = scans_to_bytes(&inputs);
        let scans: Vec<Scan> = inputs.iter().map(|input| input.scan.clone()).collect();
        assert_eq!(scans_of(&bytes), Some(scans));
        for cut in 0..bytes.len() {
            assert_eq!(scans_of(&bytes[..cut]), None, "{cut}");
        }
    }
}
