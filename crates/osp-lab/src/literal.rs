//! The rules of the OSP paper for occlusion culling, to the letter, where they cull visible polygons. For comparisons
//! only: nothing here can be chosen as a method of culling.

use osp::{
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, OcclusionCuller, ShadowVolume, Soundness, Tested, Verdict, kernels::node_budget,
    },
    view::ViewWindow,
};
use osp_rivals::occlusion::{MsvbspPaper, PaperCaps};

/// The paper's tree without caps: volumes between the eye and an occluder count as hidden, too.
pub fn msvbsp_without_caps(occluders: usize) -> Box<dyn OcclusionCuller> {
    Box::new(MsvbspPaper::new(PaperCaps::None, node_budget(occluders)))
}

/// A method of occlusion culling that tests a box by its eight corners one by one (Fig. 14, on the left): hidden if each of
/// them is, whichever occluder hides it. Between two of them the box may be in plain sight.
pub struct CornersApart(Box<dyn OcclusionCuller>);

impl CornersApart {
    /// The method `culler`, with boxes tested by their corners.
    pub fn new(culler: Box<dyn OcclusionCuller>) -> Self {
        Self(culler)
    }
}

impl std::fmt::Debug for CornersApart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("CornersApart").field(&self.0.name()).finish()
    }
}

impl OcclusionCuller for CornersApart {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn soundness(&self) -> Soundness {
        Soundness::Unsound("eight corners that are hidden do not make a hidden box")
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.0.build(window, occluders)
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        self.0.test_box(bounds)
    }

    fn test_corners(&self, bounds: &Aabb) -> Tested {
        let tests = bounds.corners().map(|corner| self.0.test_box(&Aabb::new(corner, corner)));
        let all = |verdict| tests.iter().all(|test| test.verdict == verdict);
        let verdict = if all(Verdict::Hidden) {
            Verdict::Hidden
        } else if all(Verdict::Unoccluded) {
            Verdict::Unoccluded
        } else {
            Verdict::PartlyHidden
        };
        Tested { verdict, steps: tests.iter().map(|test| test.steps).sum() }
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.0.test_sphere(sphere)
    }
}
