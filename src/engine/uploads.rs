//! Uploads within the budget of a frame.

use std::collections::VecDeque;

/// Uploads may take this part of the target, however long drawing takes: what arrives may be what
/// takes less time to draw.
const LEAST_PART: f64 = 0.08;

/// Drawing leaves no more than this part of the target to uploads. Frames with a single node of
/// which the upload takes longer are over the target: all would be drawn much coarser otherwise.
const MOST_PART: f64 = 0.3;

/// Seconds of frames of which uploads are remembered, and the most frames.
const WINDOW_S: f64 = 2.0;
const MOST_FRAMES: usize = 600;

/// This part of the frames remembered may upload for longer than is kept free. Where uploads are
/// rare, they make few frames late, and keeping time for them free would cost detail in all.
const NOT_KEPT_FREE: f64 = 0.1;

/// Half-life of the bytes and times of which the price of a byte is the ratio, seconds.
const PRICE_HALF_LIFE_S: f64 = 10.0;

/// The price expected at first counts as an upload of so many bytes.
const PRIOR_BYTES: f64 = 1e6;

/// Learns what uploads take, bounds those of a frame, and keeps the time for them free of drawing.
#[derive(Clone, Debug)]
pub(super) struct Uploads {
    /// Decayed sums.
    bytes: f64,
    ms: f64,
    now_s: f64,
    /// When frames began, and the milliseconds that their uploads took.
    frames: VecDeque<(f64, f64)>,
    sorted: Vec<f64>,
}

impl Uploads {
    /// Expects a byte to take so many milliseconds at first.
    pub fn new(byte_ms: f64) -> Self {
        Self {
            bytes: PRIOR_BYTES,
            ms: PRIOR_BYTES * byte_ms,
            now_s: 0.0,
            frames: VecDeque::new(),
            sorted: Vec::new(),
        }
    }

    /// Bytes that a frame may upload of which drawing takes `drawing_ms`.
    pub fn limit_bytes(&self, target_ms: f64, drawing_ms: f64) -> u64 {
        let free_ms = (target_ms - drawing_ms).max(LEAST_PART * target_ms);
        (free_ms * self.bytes / self.ms) as u64
    }

    /// A frame uploaded so many bytes in `ms`, `dt_s` seconds after the frame before.
    pub fn observe(&mut self, bytes: u64, ms: f64, dt_s: f64) {
        let dt_s = if dt_s.is_finite() { dt_s.max(0.0) } else { 0.0 };
        let ms = if ms.is_finite() { ms.max(0.0) } else { 0.0 };
        self.now_s += dt_s;
        let oldest_s = self.now_s - WINDOW_S;
        let is_old = |at: &(f64, f64)| at.0 < oldest_s;
        while self.frames.len() >= MOST_FRAMES || self.frames.front().is_some_and(is_old) {
            self.frames.pop_front();
        }
        if bytes > 0 {
            let kept = libm::exp2(-dt_s / PRICE_HALF_LIFE_S);
            (self.bytes, self.ms) = (self.bytes * kept + bytes as f64, self.ms * kept + ms);
        }
        // Without uploads, it is the time to free what left: a part of every frame.
        self.frames.push_back((self.now_s, if bytes > 0 { ms } else { 0.0 }));
    }

    /// Forgets how long frames uploaded, and keeps the price of a byte.
    pub fn forget_frames(&mut self) {
        self.frames.clear();
    }

    /// Milliseconds of a frame that drawing leaves to uploads: what nine of ten frames of the last two
    /// seconds took for them at most.
    pub fn reserve_ms(&mut self, target_ms: f64) -> f64 {
        self.sorted.clear();
        self.sorted.extend(self.frames.iter().map(|&(_, ms)| ms));
        let exceeding = (NOT_KEPT_FREE * self.sorted.len() as f64).ceil() as usize;
        if exceeding >= self.sorted.len() {
            return 0.0;
        }
        let (_, ms, _) = self.sorted.select_nth_unstable_by(exceeding, |a, b| b.total_cmp(a));
        ms.min(MOST_PART * target_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uploads_get_what_drawing_leaves_and_always_a_part() {
        let uploads = Uploads::new(1e-6);
        assert_eq!(uploads.limit_bytes(30.0, 10.0), 20_000_000);
        for drawing_ms in [29.0, 30.0, 90.0] {
            assert_eq!(uploads.limit_bytes(30.0, drawing_ms), 2_400_000);
        }
    }

    #[test]
    fn the_price_of_a_byte_is_learned() {
        let mut uploads = Uploads::new(1e-6);
        (0..300).for_each(|_| uploads.observe(1_000_000, 5.0, 0.03));
        let bytes = uploads.limit_bytes(30.0, 20.0);
        assert!((1_990_000..2_050_000).contains(&bytes), "{bytes}");
    }

    #[test]
    fn time_is_kept_free_while_uploads_go_on() {
        let mut uploads = Uploads::new(1e-6);
        assert_eq!(uploads.reserve_ms(30.0), 0.0);
        let mut frames = |count: usize, bytes: u64, ms: f64| {
            (0..count).for_each(|_| uploads.observe(bytes, ms, 1.0 / 32.0));
            uploads.reserve_ms(30.0)
        };
        assert_eq!(frames(40, 0, 0.2), 0.0);
        assert_eq!(frames(1, 1, 500.0), 0.0, "a stall, or a node that is too large");
        assert_eq!(frames(20, 1, 2.0), 2.0, "a third of the frames");
        assert_eq!(frames(3, 1, 4.0), 2.0);
        assert_eq!(frames(12, 1, 70.0), 9.0, "as much as there may be");
        assert_eq!(frames(80, 0, 0.2), 0.0, "over for two seconds");
    }

    #[test]
    fn odd_times_are_passed_over() {
        let mut uploads = Uploads::new(0.0);
        for odd in [f64::NAN, f64::INFINITY, -1.0] {
            (0..5).for_each(|_| uploads.observe(1, odd, odd));
        }
        assert_eq!((uploads.reserve_ms(30.0), uploads.limit_bytes(30.0, 1.0)), (0.0, u64::MAX));
    }
}
