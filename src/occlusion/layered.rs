use super::{
    BuildCounts, Cell, MeshBuffer, Meshes, Needed, OcclusionCuller, ShadowVolume, Tested, TestedBoxes,
    Verdict,
};
use crate::{
    math::{Aabb, Frustum, Sphere},
    view::ViewWindow,
};

/// A tree of shadow volumes of a few large occluders, and a depth buffer for what the tree does not hide.
pub(crate) struct Layered {
    tree: Box<dyn OcclusionCuller>,
    has_tree: bool,
    buffer: MeshBuffer,
}

impl std::fmt::Debug for Layered {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Layered").field("has_tree", &self.has_tree).finish_non_exhaustive()
    }
}

impl Layered {
    pub(crate) fn new(tree: Box<dyn OcclusionCuller>, buffer: MeshBuffer) -> Self {
        Self { tree, has_tree: false, buffer }
    }

    /// Draws the meshes that the tree does not hide into the buffer.
    pub(crate) fn draw(&mut self, meshes: &Meshes, window: &ViewWindow, frustum: &Frustum, budget: u64) {
        let Self { tree, has_tree, buffer } = self;
        let is_in_shadow = |bounds: &Aabb| *has_tree && tree.test_box(bounds).verdict == Verdict::Hidden;
        buffer.build(meshes, window, frustum, budget, &is_in_shadow);
    }

    /// Whether no occluder is in view.
    pub(crate) fn is_empty(&self) -> bool {
        !self.has_tree && self.buffer.is_empty()
    }

    pub(crate) fn buffer(&self) -> &MeshBuffer {
        &self.buffer
    }

    /// What the buffer adds to a verdict of the tree, or to none.
    fn also(&self, bounds: &Aabb, tree: Option<Tested>) -> Tested {
        if self.buffer.is_empty() || tree.is_some_and(|tree| tree.verdict == Verdict::Hidden) {
            return tree.unwrap_or(Tested { verdict: Verdict::Unoccluded, steps: 0 });
        }
        let TestedBoxes { hidden, unoccluded, steps, .. } = self.buffer.test(&[*bounds], Needed::Verdict);
        let is_free = unoccluded != 0 && tree.is_none_or(|tree| tree.verdict == Verdict::Unoccluded);
        let verdict = match (hidden != 0, is_free) {
            (true, _) => Verdict::Hidden,
            (false, true) => Verdict::Unoccluded,
            (false, false) => Verdict::PartlyHidden,
        };
        Tested { verdict, steps: steps + tree.map_or(0, |tree| tree.steps) }
    }
}

impl OcclusionCuller for Layered {
    fn name(&self) -> &'static str {
        "layered"
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.has_tree = !occluders.is_empty();
        self.tree.build(window, occluders)
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        self.also(bounds, self.has_tree.then(|| self.tree.test_box(bounds)))
    }

    fn test_box_in(&self, bounds: &Aabb, from: Cell) -> (Tested, Cell) {
        if !self.has_tree {
            return (self.also(bounds, None), from);
        }
        let (tested, cell) = self.tree.test_box_in(bounds, from);
        (self.also(bounds, Some(tested)), cell)
    }

    fn test_boxes(&self, boxes: &[Aabb], from: Cell, needed: Needed) -> TestedBoxes {
        let all = u16::MAX >> (16 - boxes.len().clamp(1, 16));
        let mut tested = TestedBoxes { unoccluded: all, ..TestedBoxes::default() };
        if self.has_tree {
            tested = self.tree.test_boxes(boxes, from, needed);
        }
        if !self.buffer.is_empty() && tested.hidden & all != all {
            let found = self.buffer.test(boxes, needed);
            tested.hidden |= found.hidden;
            tested.unoccluded &= found.unoccluded & !found.hidden;
            tested.steps += found.steps;
            tested.planes += found.planes;
        }
        tested
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        let tree = self.has_tree.then(|| self.tree.test_sphere(sphere));
        self.also(&super::cube_around(sphere), tree)
    }
}
