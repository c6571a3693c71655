use super::{Cell, Needed, ShadowVolume, Tested, TestedBoxes, verdict::one_by_one};
use crate::{
    math::{Aabb, Sphere},
    view::ViewWindow,
};

/// Counts of a built culler, and of the parts that it omitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildCounts {
    /// Number of occluders.
    pub occluders: u32,
    /// Number of splitting planes of a tree, or of tiles that are covered at least partly.
    pub nodes: u32,
    /// Depth of the tree.
    pub depth: u32,
    /// Number of pieces of occluders that the build clipped or tested.
    pub pieces: u32,
    /// Number of pieces skipped because a budget was used up. The shadow is then smaller, but never wrong.
    pub left_out: u32,
}

/// Reliability of [`Verdict::Hidden`](super::Verdict::Hidden).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Soundness {
    /// The method never reports a visible object as hidden.
    Conservative,
    /// The method may report visible objects as hidden, for the reason given. Such methods are kept for comparison and are
    /// never a default.
    Unsound(&'static str),
}

/// Makes a culler with room for `occluders` occluders. A build with more omits occluders beyond its budget, and counts
/// them.
pub type MakeCuller = fn(occluders: usize) -> Box<dyn OcclusionCuller>;

/// A method of occlusion culling, built for one eye and window, then queried.
///
/// Contract of a conservative method: let x be a point of a `Hidden` volume, inside the window and not nearer than the near
/// plane. Then a polygon of the occluders lies between the eye and x. A volume that is not finite is never hidden.
pub trait OcclusionCuller: Send + Sync {
    /// The name on the command line and in tables.
    fn name(&self) -> &'static str;

    /// Whether a visible object may be reported as hidden.
    fn soundness(&self) -> Soundness {
        Soundness::Conservative
    }

    /// Replaces the last build. The occluders are sorted, the best first, and belong to `window`. A build allocates only if
    /// it has more occluders than all builds before. A budget of the method bounds its work.
    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts;

    /// Tests a box, world space.
    fn test_box(&self, bounds: &Aabb) -> Tested;

    /// Tests a box that lies in a box already tested, beginning at the cell `from` of that box's test. Returns the verdict
    /// and the cell of this box. Each build invalidates all earlier cells.
    fn test_box_in(&self, bounds: &Aabb, from: Cell) -> (Tested, Cell) {
        (self.test_box(bounds), from)
    }

    /// Tests at most sixteen boxes. All of them lie in a box whose test ended with the cell `from`. The result has the same
    /// hidden boxes as [`OcclusionCuller::test_box`], and perhaps fewer unoccluded ones.
    fn test_boxes(&self, boxes: &[Aabb], _from: Cell, _needed: Needed) -> TestedBoxes {
        one_by_one(boxes, |bounds| self.test_box(bounds))
    }

    /// Tests a box by its eight corners. The box is hidden only if all corners lie in one cell of the method's shadow.
    /// A cell is convex, so it then contains the whole box. Hides no more than [`OcclusionCuller::test_box`]. If the
    /// method has no cells, the result is equal.
    fn test_corners(&self, bounds: &Aabb) -> Tested {
        self.test_box(bounds)
    }

    /// Tests a sphere, world space.
    fn test_sphere(&self, sphere: &Sphere) -> Tested;
}
