//! What is far, drawn from the faces of cells.

mod balance;

use std::sync::Arc;

use balance::Balance;
use glam::DVec3;
use serde::Serialize;

use super::{FrameInput, HiddenNodes, Load, PredictedView, Residents};
use crate::camera::View;
use crate::format::cells::{Cell, Cells};

/// What is drawn of what is far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FarFieldMode {
    /// The hierarchy.
    #[default]
    Off,
    /// The faces of the cell in which the eye is.
    Cells,
    /// The same where they are expected to show a view better than the hierarchy, in the time that there is.
    Auto,
}

/// What a frame shows of the far field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FarShown {
    /// Faces that are drawn, by their numbers.
    pub faces: Vec<u32>,
    /// The cull box at which nodes are cut, outside of which faces are drawn; `None` where the hierarchy is
    /// drawn alone.
    pub cull_box: Option<[DVec3; 2]>,
}

/// Draws what is outside of the cull box of the cell in which the eye is as the cell's faces, once those in
/// view are in memory: a far field in front of any policy (Aliaga and others, 1999).
///
/// Faces are known by numbers from `first` on, after those of nodes, in the order of their cells.
#[derive(Clone, Debug)]
pub struct FarField {
    cells: Arc<Cells>,
    first: u32,
    shown: FarShown,
    /// What the frame before showed.
    before: FarShown,
    /// Where faces are drawn only if they pay.
    balance: Option<Balance>,
}

impl FarField {
    /// Over cells, whose faces have numbers from `first` on; none where the mode is off.
    pub fn new(cells: Arc<Cells>, first: u32, mode: FarFieldMode) -> Option<Self> {
        let balance = match mode {
            FarFieldMode::Off => return None,
            FarFieldMode::Cells => None,
            FarFieldMode::Auto => Some(Balance::new()),
        };
        let (shown, before) = (FarShown::default(), FarShown::default());
        Some(Self { cells, first, shown, before, balance })
    }

    /// Whether faces are wanted.
    fn is_wanted(&self) -> bool {
        self.balance.as_ref().is_none_or(Balance::uses_faces)
    }

    /// A frame is chosen, that began `dt_s` seconds after the one before; whether to [weigh](Self::weigh).
    pub fn is_due(&mut self, dt_s: f64, hidden: Option<&HiddenNodes>) -> bool {
        self.balance.as_mut().is_some_and(|balance| balance.is_due(dt_s, hidden))
    }

    /// Weighs whether faces show a view better than the hierarchy from now on. `frame` is of all of the view
    /// and has the budget for all of it, `front` is what was chosen; nodes covered so much of the picture of
    /// late, 0 to 1.
    pub fn weigh(&mut self, frame: &FrameInput<'_>, front: &[u32], covered: f64) {
        if let Some(mut balance) = self.balance.take() {
            balance.weigh(self, frame, front, covered);
            self.balance = Some(balance);
        }
    }

    /// Finds out what is drawn of a view. Where the eye is in no cell, or a face in view is not in memory, it
    /// is nothing, and the hierarchy is drawn alone.
    pub fn look(&mut self, view: &View, residents: &Residents) {
        self.before = std::mem::take(&mut self.shown);
        let Some(cell) = self.cell_wanted(view) else { return };
        let in_view = self.in_view(cell, view);
        if in_view.iter().all(|&face| residents.contains(face)) {
            self.shown = FarShown { faces: in_view, cull_box: Some(cull_box(cell)) };
        }
    }

    /// What is drawn.
    pub fn shown(&self) -> &FarShown {
        &self.shown
    }

    /// What the frame before drew, where that was of another cell, or was the hierarchy alone.
    pub fn shown_before(&self) -> Option<&FarShown> {
        (self.before.cull_box != self.shown.cull_box).then_some(&self.before)
    }

    /// Triangles of the faces that are drawn.
    pub fn triangles(&self) -> u64 {
        let face = |&number: &u32| &self.cells.faces[(number - self.first) as usize];
        self.shown.faces.iter().map(|number| u64::from(face(number).triangles)).sum()
    }

    /// The view of a camera that may be here soon: without what a cell would show of it.
    pub fn expected(&self, at: &PredictedView) -> PredictedView {
        let within = self.cell_wanted(&at.view).map(cull_box);
        PredictedView { view: at.view.within(within), ..*at }
    }

    /// Faces that should be in memory, with how useful that is: those in view before the `most` useful node,
    /// and after those the others of the cell and those of the cells to which the camera is expected to come.
    pub fn requests(
        &self,
        view: &View,
        predicted: &[PredictedView],
        most: f64,
        out: &mut Vec<(u32, f64)>,
    ) {
        let mut wanted: Vec<(u32, f64)> = Vec::new();
        if let Some(cell) = self.cell_wanted(view) {
            wanted.extend(self.in_view(cell, view).into_iter().map(|face| (face, 4.0)));
            wanted.extend(self.faces_of(cell).map(|face| (face, 2.0)));
        }
        for at in predicted {
            let Some(cell) = self.cell_wanted(&at.view) else { continue };
            let useful = 1.0 + 1.0 / (1.0 + at.after_s);
            wanted.extend(self.in_view(cell, &at.view).into_iter().map(|face| (face, useful)));
        }
        // Each once, where it is most useful.
        wanted.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        wanted.dedup_by_key(|(face, _)| *face);
        out.extend(wanted.into_iter().map(|(face, useful)| (face, useful * (1.0 + most))));
    }

    /// What the faces that are drawn ask of a machine, where nodes cover so much of the picture before them,
    /// 0 to 1.
    pub fn load(&self, view: &View, covered: f64) -> Load {
        self.load_of(&self.shown.faces, view, covered)
    }

    fn load_of(&self, faces: &[u32], view: &View, covered: f64) -> Load {
        let mut load = Load::default();
        let steradians_px = view.pixels_per_metre().powi(2);
        let [width, height] = view.size.map(f64::from);
        for &number in faces {
            let face = &self.cells.faces[(number - self.first) as usize];
            load.draws += face.views.len() as f64;
            load.vertices += f64::from(face.vertices);
            load.triangles += f64::from(face.triangles);
            let angle: f64 = face.views.iter().map(|at| f64::from(at.solid_angle)).sum();
            let bounds = face.bounds.map(DVec3::from_array);
            let under = (view.frustum.covered(bounds) * width * height).min(angle * steradians_px);
            load.textured_fragments += under * (1.0 - covered);
            load.hidden_fragments += under * covered;
        }
        load
    }

    fn cell_at(&self, point: DVec3) -> Option<&Cell> {
        self.cells.cell_at(point.to_array())
    }

    /// The cell from which a view is drawn.
    fn cell_wanted(&self, view: &View) -> Option<&Cell> {
        self.cell_at(view.pose.position).filter(|_| self.is_wanted())
    }

    /// Metres that a texel of a face covers at one metre's distance.
    fn texel(&self) -> f64 {
        self.cells.texel
    }

    /// The numbers of the faces of a cell.
    fn faces_of(&self, cell: &Cell) -> impl Iterator<Item = u32> {
        let first = self.first;
        cell.faces.clone().map(move |face| first + face)
    }

    /// Those of them in view.
    fn in_view(&self, cell: &Cell, view: &View) -> Vec<u32> {
        let frustum = view.frustum.within(None);
        let faces = self.faces_of(cell).zip(self.cells.faces_of(cell));
        faces
            .filter(|(_, face)| frustum.outside(face.bounds.map(DVec3::from_array)) <= 0.0)
            .map(|(number, _)| number)
            .collect()
    }
}

fn cull_box(cell: &Cell) -> [DVec3; 2] {
    cell.cull_box.map(DVec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::cells::{Face, FaceView};
    use crate::runtime::test_tree::view;

    /// Nodes before the faces.
    const FIRST: u32 = 10;

    fn face(bounds: [[f64; 3]; 2]) -> Face {
        Face {
            file: "face.glb".into(),
            file_bytes: 100,
            file_crc: 0,
            vertices: 40,
            triangles: 20,
            bounds,
            error: 0.0,
            views: vec![FaceView { size: [8; 2], solid_angle: 0.1, projection: [0.0; 4] }],
        }
    }

    /// Two cells side by side along x, each with a face ahead of and one behind [`view`].
    fn far_field() -> FarField {
        let cell = |x: i64, first: u32| Cell {
            place: [x, 0, 0],
            cull_box: [[-50.0 + x as f64, -50.0, -50.0], [60.0 + x as f64, 60.0, 60.0]],
            faces: first..first + 2,
        };
        let ahead = face([[60.0, -80.0, -80.0], [80.0, 80.0, 80.0]]);
        let behind = face([[-80.0, -80.0, -80.0], [-60.0, 80.0, 80.0]]);
        let cells = Cells {
            scene: [0; 32],
            parameters: serde_json::Value::Null,
            size: 10.0,
            texel: 0.01,
            cells: vec![cell(0, 0), cell(1, 2)],
            faces: vec![ahead.clone(), behind.clone(), ahead, behind],
        };
        FarField::new(Arc::new(cells), FIRST, FarFieldMode::Cells).unwrap()
    }

    fn at(x: f64) -> View {
        let view = view();
        let pose = crate::camera::Pose { position: DVec3::new(x, 1.0, 1.0), ..view.pose };
        View::new(pose, DVec3::ZERO, view.size)
    }

    #[test]
    fn faces_are_drawn_once_those_in_view_are_in_memory() {
        let mut far_field = far_field();
        let mut residents = Residents::none(14);
        let mut look = |x: f64, residents: &Residents| {
            far_field.look(&at(x), residents);
            (far_field.shown().faces.clone(), far_field.shown().cull_box.map(|[min, _]| min.x))
        };
        assert_eq!(look(5.0, &residents), (vec![], None), "not there");
        residents.set(11, true);
        assert_eq!(look(5.0, &residents), (vec![], None), "the wrong one");
        residents.set(10, true);
        assert_eq!(look(5.0, &residents), (vec![10], Some(-50.0)));
        assert_eq!(look(15.0, &residents), (vec![], None), "of another cell");
        assert_eq!(look(-5.0, &residents), (vec![], None), "no cell");
    }

    #[test]
    fn what_is_in_view_is_wanted_before_all_and_cells_ahead_after_it() {
        let far_field = far_field();
        let ahead = PredictedView { after_s: 0.5, view: at(15.0) };
        let mut wanted = Vec::new();
        far_field.requests(&at(5.0), &[ahead], 7.0, &mut wanted);
        let useful = |face: u32| wanted.iter().find(|(number, _)| *number == face).map(|at| at.1);
        assert!(useful(10) > useful(11) && useful(11) > useful(12), "{wanted:?}");
        assert!(useful(12) > Some(7.0), "more useful than any node");
        assert_eq!((useful(13), wanted.len()), (None, 3));
        wanted.clear();
        far_field.requests(&at(-5.0), &[], 7.0, &mut wanted);
        assert_eq!(wanted, []);
    }

    #[test]
    fn nothing_is_expected_to_be_seen_outside_of_the_cull_box_of_a_cell() {
        let far_field = far_field();
        let within = |x: f64| {
            let at = PredictedView { after_s: 1.0, view: at(x) };
            far_field.expected(&at).view.frustum.box_within().map(|[_, max]| max.x)
        };
        assert_eq!([-5.0, 5.0, 15.0].map(within), [None, Some(60.0), Some(61.0)]);
    }

    #[test]
    fn faces_take_time_for_as_much_as_they_show() {
        let mut far_field = far_field();
        let view = at(5.0);
        assert_eq!(far_field.load(&view, 0.0), Load::default());
        let mut residents = Residents::none(14);
        residents.set(10, true);
        far_field.look(&view, &residents);
        let load = far_field.load(&view, 0.25);
        assert_eq!((load.draws, load.vertices, load.triangles), (1.0, 40.0, 20.0));
        let fragments = 0.1 * view.pixels_per_metre().powi(2);
        assert!((load.textured_fragments - 0.75 * fragments).abs() < 1e-6 * fragments);
        assert!((load.hidden_fragments - 0.25 * fragments).abs() < 1e-6 * fragments);
    }
}
