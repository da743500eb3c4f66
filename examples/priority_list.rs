//! Measures the list of nodes by priority against a heap, on priorities as they change along a
//! walk: `cargo run --release --no-default-features --example priority_list`.
//!
//! Each frame gives all nodes their new priorities and asks for the most important one that is not
//! loaded, which then counts as loaded; the least important one is given up for it. The heap is
//! the standard library's, with entries that are out of date skipped when they come up. The two
//! take turns, and the shortest of their turns counts.

use std::collections::BinaryHeap;
use std::hint::black_box;
use std::time::Instant;

use hlod::runtime::residency::PriorityList;

const FRAMES: u32 = 2000;
const ROUNDS: usize = 3;

/// Priority of a node on a long street for a camera that walks 5 cm a frame, seen as from 1 m at
/// least.
fn priority(node: u32, frame: u32) -> f64 {
    let camera = f64::from(frame) * 0.05 + 100.0;
    let distance = (f64::from(node) - camera).abs().max(1.0);
    1.0 / (distance * distance)
}

fn priorities(nodes: u32, frame: u32) -> Vec<(u32, f64)> {
    (0..nodes).map(|node| (node, priority(node, frame))).collect()
}

/// The nodes that were loaded, in order, and nanoseconds for each update.
fn with_list(nodes: u32) -> (Vec<u32>, f64) {
    let mut list = PriorityList::new(nodes as usize);
    list.update(&priorities(nodes, 0));
    let mut loaded = Vec::new();
    let mut spent = 0.0;
    for frame in 1..=FRAMES {
        let changed = priorities(nodes, frame);
        let begin = Instant::now();
        list.update(&changed);
        if let Some(node) = list.first_unloaded() {
            list.set_loaded(node, true);
            loaded.push(node);
        }
        black_box(list.last());
        spent += begin.elapsed().as_secs_f64();
    }
    (loaded, spent * 1e9 / f64::from(FRAMES * nodes))
}

/// The same with a heap that is filled anew in every frame, since all priorities change.
fn with_heap(nodes: u32) -> (Vec<u32>, f64) {
    let mut is_loaded = vec![false; nodes as usize];
    let mut loaded = Vec::new();
    let mut spent = 0.0;
    let mut entries = Vec::new();
    for frame in 1..=FRAMES {
        let changed = priorities(nodes, frame);
        let begin = Instant::now();
        entries.clear();
        // Priorities are above 0, so that their bits are in their order.
        entries.extend(changed.iter().map(|&(node, p)| (p.to_bits(), std::cmp::Reverse(node))));
        let mut heap = BinaryHeap::from(std::mem::take(&mut entries));
        while let Some((_, std::cmp::Reverse(node))) = heap.pop() {
            if !std::mem::replace(&mut is_loaded[node as usize], true) {
                loaded.push(node);
                break;
            }
        }
        entries = heap.into_vec();
        spent += begin.elapsed().as_secs_f64();
    }
    (loaded, spent * 1e9 / f64::from(FRAMES * nodes))
}

fn main() {
    println!("{:>8} {:>10} {:>10}   ns for each update", "nodes", "list", "heap");
    for nodes in [300, 3_000, 30_000] {
        let (mut list_ns, mut heap_ns) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ROUNDS {
            let ((by_list, of_list), (by_heap, of_heap)) = (with_list(nodes), with_heap(nodes));
            assert_eq!(by_list, by_heap, "the two disagree");
            (list_ns, heap_ns) = (list_ns.min(of_list), heap_ns.min(of_heap));
        }
        println!("{nodes:>8} {list_ns:>10.1} {heap_ns:>10.1}");
    }
}
