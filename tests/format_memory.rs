//! No count in a file is trusted: damaged files never make their readers ask for much memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;

use hlod::format::{
    BlockInfo, Node, NodeId, NodeImage, NodeImageData, NodeLabel, NodeMesh, Primitive, Scene,
    SharedTexture, Surface, read_glb, write_glb,
};
use hlod::mesh::{AlphaMode, UpAxis, Wrap};

/// The system's allocator, which notes the largest request of each thread.
struct Noting;

thread_local! {
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

fn note(size: usize) {
    // Fails only while a thread ends, when nobody measures.
    let _ = LARGEST.try_with(|largest| largest.set(largest.get().max(size)));
}

// SAFETY: everything is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Noting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the caller's promises are those that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        // SAFETY: as above.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Noting = Noting;

/// The largest single allocation of `act`.
fn largest(act: impl FnOnce()) -> usize {
    LARGEST.set(0);
    act();
    LARGEST.get()
}

fn node_file() -> Vec<u8> {
    let mesh = NodeMesh {
        origin: [1.0, 2.0, 3.0],
        images: vec![NodeImage {
            width: 1,
            height: 1,
            data: NodeImageData::Embedded {
                mime: "image/jpeg",
                bytes: vec![7; 40],
                file_name: None,
            },
        }],
        primitives: vec![Primitive {
            positions: vec![[0.0; 3]; 4],
            texcoords: vec![[0.0; 2]; 4],
            colors: vec![[1; 4]; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            normals: Vec::new(),
            skirt_triangles: 0,
            surface: Surface {
                base_color: [1.0; 4],
                image: Some(0),
                wrap: [Wrap::Clamp; 2],
                alpha: AlphaMode::Mask { cutoff: 0.5 },
                double_sided: true,
                is_unlit: false,
            },
        }],
    };
    write_glb(&mesh, UpAxis::Z, NodeLabel { id: NodeId(1), level: 0 }).unwrap()
}

fn scene_file() -> Vec<u8> {
    let scene = Scene {
        parameters: serde_json::json!({ "level_factor": 4 }),
        fingerprint: [3; 32],
        up: UpAxis::Y,
        blocks: vec![BlockInfo { name: "a".into(), input: "b".into(), origin: [0.0; 3] }],
        shared_textures: vec![SharedTexture {
            file_name: "t.png".into(),
            width: 4,
            height: 4,
            bytes: 9,
        }],
        nodes: vec![Node {
            id: NodeId(1),
            parent: None,
            first_child: None,
            next_sibling: None,
            level: 0,
            block: Some(0),
            triangles: 2,
            textured_triangles: 2,
            vertices: 4,
            bbox_min: [0.0; 3],
            bbox_max: [1.0; 3],
            cost: 1.0,
            static_benefit: 1.0,
            average_normal: [0.0, 1.0, 0.0],
            geometric_error: 0.0,
            mean_error: 0.0,
            p95_error: 0.0,
            texels: 16,
            pictures: vec![[8, 2]],
            shared_texels: 0,
            origin: [0.0; 3],
            file: "n.glb".into(),
            file_bytes: 10,
            file_crc: 0,
            shared_textures: vec![0],
        }],
    };
    scene.to_bytes().unwrap()
}

/// Sets every aligned and unaligned 32-bit field to values that counts go wrong with.
fn with_wild_counts(bytes: &[u8], mut try_it: impl FnMut(&[u8])) {
    for at in 0..bytes.len() - 4 {
        for wild in [u32::MAX, u32::MAX - 1, 0x7FFF_FFFF, 0x1000_0000, 0x0010_0000] {
            let mut damaged = bytes.to_vec();
            damaged[at..at + 4].copy_from_slice(&wild.to_le_bytes());
            try_it(&damaged);
        }
    }
}

#[test]
fn scenes_with_wild_counts_ask_for_little() {
    let whole = scene_file();
    with_wild_counts(&whole, |damaged| {
        // Past the checksum, so that the counts themselves are met.
        let body = damaged.len() - 4;
        let mut sealed = damaged[..body].to_vec();
        sealed[16..24].copy_from_slice(&(damaged.len() as u64).to_le_bytes());
        sealed.extend(hlod::format::file_crc(&sealed).to_le_bytes());
        for bytes in [damaged, &sealed] {
            let most = largest(|| drop(Scene::from_bytes(bytes, Path::new("s"))));
            assert!(most < 16 * whole.len(), "{most} bytes asked for");
        }
    });
}

#[test]
fn node_files_with_wild_counts_ask_for_little() {
    let whole = node_file();
    with_wild_counts(&whole, |damaged| {
        let most = largest(|| drop(read_glb(damaged, Path::new("n"))));
        assert!(most < 16 * whole.len(), "{most} bytes asked for");
    });
}

/// Digits in the JSON, too: each is made to stand for a number of ten digits.
#[test]
fn node_files_with_wild_numbers_ask_for_little() {
    let whole = node_file();
    let json_end = 20 + u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    for at in 20..json_end {
        if !whole[at].is_ascii_digit() {
            continue;
        }
        let mut damaged = whole.clone();
        damaged.splice(at..at, *b"4000000000");
        let length = (damaged.len() as u32).to_le_bytes();
        damaged[8..12].copy_from_slice(&length);
        let json = (json_end as u32 - 20 + 10).to_le_bytes();
        damaged[12..16].copy_from_slice(&json);
        let most = largest(|| drop(read_glb(&damaged, Path::new("n"))));
        assert!(most < 16 * whole.len(), "{most} bytes asked for");
    }
}
