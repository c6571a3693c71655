use osp::{
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, DepthBuffer, DepthConfig, OcclusionCuller, ShadowVolume, Soundness, Tested,
        kernels::Coverage,
    },
    view::ViewWindow,
};

/// The software depth buffer sampled at pixel centres, as in J. Hasselgren, M. Andersson, T. Akenine-Möller, "Masked
/// Software Occlusion Culling" (2016). It is wrong by up to half a pixel, so it is not conservative.
#[derive(Clone, Debug)]
pub struct DepthCenters(DepthBuffer);

impl DepthCenters {
    /// Creates an empty buffer and allocates all its memory.
    pub fn new(config: DepthConfig) -> Self {
        Self(DepthBuffer::with_coverage(config, Coverage::PixelCenters))
    }
}

impl OcclusionCuller for DepthCenters {
    fn name(&self) -> &'static str {
        "depth-centers"
    }

    fn soundness(&self) -> Soundness {
        Soundness::Unsound("what shows by less than half a pixel")
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.0.build(window, occluders)
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        self.0.test_box(bounds)
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.0.test_sphere(sphere)
    }
}
