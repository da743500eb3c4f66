//! Every byte that is held or being loaded.

use super::Sizes;

/// Every byte that is held or being loaded, against a cap.
#[derive(Clone, Debug)]
pub(super) struct MemoryBudget {
    cap: u64,
    used: u64,
    peak: u64,
    /// By shared picture: the nodes that need it and are held or being loaded.
    users: Vec<u32>,
}

impl MemoryBudget {
    pub fn new(cap: u64, textures: usize) -> Self {
        Self { cap, used: 0, peak: 0, users: vec![0; textures] }
    }

    pub fn used(&self) -> u64 {
        self.used
    }

    pub fn peak(&self) -> u64 {
        self.peak
    }

    /// None while a cap that was lowered is exceeded.
    pub fn free(&self) -> u64 {
        self.cap.saturating_sub(self.used)
    }

    /// Bytes beyond the cap, were so many more in use.
    pub fn beyond(&self, more_bytes: u64) -> u64 {
        (self.used + more_bytes).saturating_sub(self.cap)
    }

    /// Whether more is in use than may be, since the cap was lowered.
    pub fn is_over(&self) -> bool {
        self.used > self.cap
    }

    pub fn set_cap(&mut self, cap: u64) {
        self.cap = cap;
    }

    /// Bytes that holding a node takes beyond what is held already.
    pub fn held(&self, sizes: &Sizes, node: u32) -> u64 {
        let size = &sizes.nodes[node as usize];
        let unused = size.textures.iter().filter(|&&texture| self.users[texture as usize] == 0);
        size.bytes() + unused.map(|&t| sizes.textures[t as usize].held_bytes).sum::<u64>()
    }

    /// Reserves bytes for a node and for what is read of its files; the caller has seen that they are free.
    pub fn reserve(&mut self, sizes: &Sizes, node: u32, read_bytes: u64) {
        self.used += self.held(sizes, node) + read_bytes;
        debug_assert!(self.used <= self.cap, "{} of {} bytes", self.used, self.cap);
        self.peak = self.peak.max(self.used);
        for &texture in &sizes.nodes[node as usize].textures {
            self.users[texture as usize] += 1;
        }
    }

    /// Gives back the bytes read, once they are decoded.
    pub fn release_read(&mut self, read_bytes: u64) {
        self.used -= read_bytes;
    }

    /// Gives back what a load that is given up would have held. Shared pictures that are in memory
    /// and that nobody else needs stay counted, and are put into `orphans`.
    pub fn release_load(
        &mut self,
        sizes: &Sizes,
        node: u32,
        in_memory: &[bool],
        orphans: &mut Vec<u32>,
    ) {
        let size = &sizes.nodes[node as usize];
        self.used -= size.bytes();
        for &texture in &size.textures {
            match self.users[texture as usize] == 1 && in_memory[texture as usize] {
                true => orphans.push(texture),
                false => self.release_texture(sizes, texture, |_| {}),
            }
        }
    }

    /// One node less needs a shared picture; calls `gone` where it was the last.
    pub fn release_texture(&mut self, sizes: &Sizes, texture: u32, gone: impl FnOnce(u32)) {
        let users = &mut self.users[texture as usize];
        *users -= 1;
        if *users == 0 {
            self.used -= sizes.textures[texture as usize].held_bytes;
            gone(texture);
        }
    }

    /// Gives back what a node held; calls `gone` with shared pictures that nobody needs any more.
    pub fn release(&mut self, sizes: &Sizes, node: u32, mut gone: impl FnMut(u32)) {
        let size = &sizes.nodes[node as usize];
        self.used -= size.bytes();
        for &texture in &size.textures {
            self.release_texture(sizes, texture, &mut gone);
        }
    }
}
