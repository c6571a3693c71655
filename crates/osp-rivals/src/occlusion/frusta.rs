use glam::DVec3;

use osp::{
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, OcclusionCuller, ShadowVolume, Tested, Verdict,
        kernels::{EyeBox, EyeSphere, Volume},
    },
    view::ViewWindow,
};

/// Tests a volume against the shadow volume of each occluder, one after the other.
///
/// T. Hudson, D. Manocha, J. Cohen, M. Lin, K. Hoff, H. Zhang, "Accelerated Occlusion Culling using Shadow Frusta", 1997.
///
/// # Differences from the paper
/// Occluders are single convex polygons, not objects, and the tested volumes are boxes or spheres without a hierarchy of
/// their own. The method does not find volumes that only two occluders together hide.
#[derive(Clone, Debug)]
pub struct ShadowFrusta {
    eye_in_world: DVec3,
    occluders: Vec<ShadowVolume>,
}

impl ShadowFrusta {
    /// A culler without occluders, with memory for `occluders` occluders.
    pub fn new(occluders: usize) -> Self {
        Self { eye_in_world: DVec3::ZERO, occluders: Vec::with_capacity(occluders) }
    }

    fn test<V: Volume>(&self, volume: &V) -> Tested {
        let slack = volume.slack();
        let (mut steps, mut all_unoccluded) = (0, true);
        for occluder in &self.occluders {
            let (mut inside, mut outside) = (true, false);
            let mut meet = |beyond: bool, before: bool| {
                steps += 1;
                inside &= beyond;
                outside |= before;
                before
            };
            let missed = occluder.sides().iter().any(|side| {
                let (low, high) = volume.reach(*side);
                meet(low >= slack, high <= -slack)
            });
            if !missed {
                let (low, high) = volume.reach(occluder.cap_normal());
                let cap = occluder.cap_distance_m();
                meet(low - cap >= slack, high - cap <= 0.0);
            }
            if inside && !outside {
                return Tested { verdict: Verdict::Hidden, steps };
            }
            all_unoccluded &= outside;
        }
        Tested { verdict: if all_unoccluded { Verdict::Unoccluded } else { Verdict::PartlyHidden }, steps }
    }
}

impl OcclusionCuller for ShadowFrusta {
    fn name(&self) -> &'static str {
        "frusta"
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        self.eye_in_world = window.eye_in_world();
        self.occluders.clear();
        self.occluders.extend_from_slice(occluders);
        let len = occluders.len() as u32;
        BuildCounts { occluders: len, nodes: len, depth: len.min(1), pieces: len, left_out: 0 }
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        self.test(&EyeBox::new(bounds, self.eye_in_world))
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        self.test(&EyeSphere::new(sphere, self.eye_in_world))
    }
}
