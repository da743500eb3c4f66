//! What is compared between a case and its benign twin.

use hlod::bench::Run;
use hlod::verify::VerifyReport;

use crate::support::result::Built;

/// One figure: its name, its value, and what counts as nothing beside it.
#[derive(Clone, Debug)]
pub struct Figure {
    pub name: String,
    pub value: f64,
    /// Differences are in parts of the twin's value, or of this where that is less: a figure that
    /// is all but 0 may be another that is all but 0.
    pub least: f64,
}

/// The figures of one case.
#[derive(Clone, Debug, Default)]
pub struct Figures(pub Vec<Figure>);

/// The diagonal is divided into this many parts, each of which counts as nothing in a distance:
/// a tenth of what the coarsest level of any case here is off.
const NO_DISTANCE: f64 = 1e-6;

/// Differences of colour RMS are in parts of this at least, of 255: 1 % are 0.05.
const NO_COLOR: f64 = 5.0;

impl Figures {
    pub fn add(&mut self, name: impl Into<String>, value: f64, least: f64) {
        self.0.push(Figure { name: name.into(), value, least });
    }

    pub fn get(&self, name: &str) -> f64 {
        let found = self.0.iter().find(|figure| figure.name == name);
        found.unwrap_or_else(|| panic!("no figure {name} in {self:?}")).value
    }

    /// Of a build and its verification. `scale` is by how much the case is larger than its twin.
    pub fn add_build(&mut self, built: &Built, report: &VerifyReport, scale: f64) {
        let scene = report.scene.as_ref().unwrap();
        let diagonal = scene.diagonal / scale;
        self.add("levels", scene.levels as f64, 1.0);
        self.add("leaf triangles", scene.leaf_triangles as f64, 1.0);
        self.add("leaf area", built.leaf_area() / (scale * scale), 1e-12);
        if let Some(leaves) = &report.leaves {
            self.add("leaf colour RMS", leaves.color_rms, NO_COLOR);
        }
        for level in &report.levels {
            let number = level.level;
            self.add(format!("triangles, level {number}"), level.triangles as f64, 10.0);
            let rms = level.two_sided.rms / scale;
            self.add(format!("RMS, level {number}"), rms, diagonal * NO_DISTANCE);
            if let Some(color) = level.color_rms {
                self.add(format!("colour RMS, level {number}"), color, NO_COLOR);
            }
            let nodes = &built.scene.nodes;
            let coarse = nodes.iter().filter(|n| n.level == number && n.first_child.is_some());
            let errors: Vec<f64> = coarse.map(|node| node.geometric_error / scale).collect();
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            self.add(format!("stored error, level {number}"), mean, diagonal * NO_DISTANCE);
        }
        if let Some(front) = &report.front {
            let rms = front.two_sided.rms / scale;
            self.add("RMS, front of 10 %", rms, diagonal * NO_DISTANCE);
        }
        let gap = report.gaps.iter().map(|gap| gap.open).fold(0.0, f64::max) / scale;
        self.add("widest gap", gap, 4.0 * scene.step / scale + diagonal * NO_DISTANCE);
    }

    /// Of a replay.
    pub fn add_run(&mut self, run: &Run) {
        let sum = |of: fn(&hlod::bench::FrameRecord) -> f64| run.frames.iter().map(of).sum::<f64>();
        let frames = run.frames.len() as f64;
        self.add("toggles", sum(|frame| f64::from(frame.report.toggles())), 100.0);
        self.add("triangles drawn", sum(|frame| frame.report.triangles as f64) / frames, 1.0);
        self.add("nodes drawn", sum(|frame| f64::from(frame.report.nodes)) / frames, 1.0);
        self.add("nodes visited", sum(|frame| f64::from(frame.report.visited)) / frames, 1.0);
        self.add("frame, ms", sum(|frame| frame.report.frame_ms) / frames, 1e-3);
        self.add("expected, ms", sum(|frame| frame.report.estimated_ms) / frames, 1e-3);
    }
}

/// Where a case and its twin are farthest apart for what is allowed there.
#[derive(Clone, Debug)]
pub struct Difference {
    pub name: String,
    pub case: f64,
    pub twin: f64,
    pub part: f64,
    pub allowed: f64,
}

impl Difference {
    pub fn is_allowed(&self) -> bool {
        self.part <= self.allowed
    }
}

/// All differences of two sets of figures, of those that both should have.
pub fn differences(
    case: &Figures,
    twin: &Figures,
    allowed: impl Fn(&str) -> f64,
) -> Vec<Difference> {
    let names = case.0.iter().chain(&twin.0).map(|figure| &figure.name);
    let names: std::collections::BTreeSet<_> = names.collect();
    let find = |of: &Figures, name: &str| of.0.iter().find(|figure| figure.name == name).cloned();
    let difference = |name: &String| {
        let allowed = allowed(name);
        let (case, twin) = (find(case, name), find(twin, name));
        let value = |figure: &Option<Figure>| figure.as_ref().map_or(f64::NAN, |f| f.value);
        let least = twin.as_ref().or(case.as_ref()).map_or(0.0, |figure| figure.least);
        let (case, twin) = (value(&case), value(&twin));
        // Fewer toggles are no fault: where less is drawn for the same budget, what is left of it lets
        // more fit at once, and less is tried again. Other figures tell whether less is drawn.
        let apart = if name == "toggles" && case < twin { 0.0 } else { (case - twin).abs() };
        let part = apart / twin.abs().max(least);
        // A figure that one of them lacks, or that is no number, is no small difference.
        let part = if part.is_nan() { f64::INFINITY } else { part };
        Difference { name: name.clone(), case, twin, part, allowed }
    };
    names.into_iter().map(difference).collect()
}
