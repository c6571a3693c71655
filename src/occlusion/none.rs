use super::{BuildCounts, OcclusionCuller, ShadowVolume, Tested, Verdict};
use crate::{
    math::{Aabb, Sphere},
    view::ViewWindow,
};

/// A culler that hides nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoOcclusion;

impl OcclusionCuller for NoOcclusion {
    fn name(&self) -> &'static str {
        "none"
    }

    fn build(&mut self, _: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        BuildCounts { occluders: occluders.len() as u32, ..BuildCounts::default() }
    }

    fn test_box(&self, _: &Aabb) -> Tested {
        Tested { verdict: Verdict::Unoccluded, steps: 0 }
    }

    fn test_sphere(&self, _: &Sphere) -> Tested {
        Tested { verdict: Verdict::Unoccluded, steps: 0 }
    }
}
