use super::{Asked, Cell, ShadowVolume, Tested, TestedBoxes, verdict::one_by_one};
use crate::{
    math::{Aabb, Sphere},
    view::ViewWindow,
};

/// Counts of a built culler, and of the parts that it omitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildCounts {
    /// Number of occluders.
    pub occluders: u32,
    /// Splitting planes, or tiles that are covered at least partly.
    pub nodes: u32,
    /// Depth of the tree.
    pub depth: u32,
    /// Pieces of occluders that were cut off or tested again on the way.
    pub pieces: u32,
    /// Pieces left out because a budget was used up. They make the shadow smaller, but never wrong.
    pub left_out: u32,
}

/// Reliability of [`Verdict::Hidden`](super::Verdict::Hidden).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Soundness {
    /// Nothing visible is ever reported as hidden.
    Conservative,
    /// Visible objects may be reported as hidden, for this reason. Kept for comparison, never a default.
    Unsound(&'static str),
}

/// Makes a culler with room for this number of occluders. More may be given: occluders beyond its budget are omitted
/// and counted.
pub type MakeCuller = fn(occluders: usize) -> Box<dyn OcclusionCuller>;

/// A method of occlusion culling: built for one eye and window, then queried.
///
/// Contract of a conservative one: let x be a point of a `Hidden` volume, inside the window and not nearer than the near
/// plane. Then a polygon of the occluders lies between the eye and x. A volume that is not finite is never hidden.
pub trait OcclusionCuller: Send + Sync {
    /// Its name on the command line and in tables.
    fn name(&self) -> &'static str;

    /// Reliability of its answers.
    fn soundness(&self) -> Soundness {
        Soundness::Conservative
    }

    /// Replaces the last build. The occluders come best first and belong to `window`. It does not allocate after a
    /// build with as many occluders, and its work is bounded by a budget of its own.
    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts;

    /// Tests a box, world space.
    fn test_box(&self, bounds: &Aabb) -> Tested;

    /// Tests a box nested in one already tested, starting at that test's cell `from`. Returns also the cell of the box itself.
    /// The culler must not have been built again since.
    fn test_box_in(&self, bounds: &Aabb, from: Cell) -> (Tested, Cell) {
        (self.test_box(bounds), from)
    }

    /// [`OcclusionCuller::test_box`] for at most sixteen boxes. All of them lie in a box whose test has ended with
    /// cell `from`. It finds the same boxes hidden, and perhaps a little fewer unoccluded.
    fn test_boxes(&self, boxes: &[Aabb], _from: Cell, _asked: Asked) -> TestedBoxes {
        one_by_one(boxes, |bounds| self.test_box(bounds))
    }

    /// Tests a box by its exact outline, if the method can; otherwise like [`OcclusionCuller::test_box`]. Hides at
    /// least as much as that.
    fn test_outline(&self, bounds: &Aabb) -> Tested {
        self.test_box(bounds)
    }

    /// Tests a box by its eight corners: hidden only if they all lie in one cell of the method's shadow. A cell is convex,
    /// so the whole box then lies in it. Hides at most what [`OcclusionCuller::test_box`] hides, and the same for a
    /// method whose shadow has no cells.
    fn test_corners(&self, bounds: &Aabb) -> Tested {
        self.test_box(bounds)
    }

    /// Tests a sphere, world space.
    fn test_sphere(&self, sphere: &Sphere) -> Tested;
}
