//! The OSP paper's rules of occlusion culling that cull visible polygons, implemented literally. For comparisons only:
//! they cannot be selected as a culling method.

use osp::{
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, OcclusionCuller, ShadowVolume, Soundness, Tested, Verdict, kernels::node_budget,
    },
    view::ViewWindow,
};
use osp_rivals::occlusion::{MsvbspPaper, PaperCaps};

/// The paper's tree without caps: volumes between the eye and an occluder also count as hidden.
pub fn msvbsp_without_caps(occluders: usize) -> Box<dyn OcclusionCuller> {
    Box::new(MsvbspPaper::new(PaperCaps::None, node_budget(occluders)))
}

/// A culler that tests a box by its eight corners separately (Fig. 14, on the left). The box counts as hidden if each
/// corner is hidden, even by different occluders. Between two corners the box may be visible.
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
