//! Frames drawn twice: with what `--visibility on` leaves out, and without.

use hlod::bench::{Accuracy, FrameInspector, FrameSample, ReferenceRenderer};

/// Draws every so many-th frame of a run in which nodes are hidden twice, and counts what differs.
pub struct Twice<'a> {
    pub renderer: &'a mut ReferenceRenderer,
    pub every: usize,
    /// Frames drawn twice, nodes hidden in them, and pixels that differ.
    pub counts: [usize; 3],
    /// Frames in which any does, with the nodes left out.
    pub faults: Vec<String>,
}

impl<'a> Twice<'a> {
    pub fn new(renderer: &'a mut ReferenceRenderer, every: usize) -> Self {
        Self { renderer, every, counts: [0; 3], faults: Vec::new() }
    }
}

impl FrameInspector for Twice<'_> {
    fn wants(&self, index: usize, _: bool) -> bool {
        index.is_multiple_of(self.every)
    }

    fn inspect(&mut self, frame: FrameSample<'_>) -> hlod::Result<Accuracy> {
        let FrameSample { frame, view, front, hidden, .. } = frame;
        if !hidden.is_empty() {
            let drawn = self.renderer.render(front, &view.pose)?;
            let whole = self.renderer.render(&[front, hidden].concat(), &view.pose)?;
            let differ = drawn.pixels().zip(whole.pixels()).filter(|(a, b)| a != b).count();
            let [frames, nodes, pixels] = &mut self.counts;
            (*frames, *nodes, *pixels) = (*frames + 1, *nodes + hidden.len(), *pixels + differ);
            if differ > 0 {
                self.faults.push(format!("frame {frame}: {differ} pixels without {hidden:?}"));
            }
        }
        Ok(Accuracy::default())
    }
}
