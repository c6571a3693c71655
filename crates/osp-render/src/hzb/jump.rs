use glam::Vec3;

use crate::run::Handle;
use osp_session::scene::Scene;

const SAMPLES: usize = 15;
/// A view jumps if the eye moves farther than this fraction of its median distance from the polygons. It then sees
/// other sides of the polygons.
const FAR_PART: f32 = 0.5;

/// The record of a view's last frame. It decides whether the next frame first draws the polygons that were visible in
/// the recorded frame.
#[derive(Debug, Default)]
pub(super) struct LastLook {
    eye_in_world: Vec3,
    /// The opaque polygons in view, as cluster masks in ascending order.
    pub(super) handles: Vec<Handle>,
    has_jumped: bool,
}

impl LastLook {
    /// Records the next frame, and returns whether its view has jumped. A view jumps if most polygons in view were not
    /// in view in the last frame. It also jumps if the eye has moved so far that the old occluders may hide nothing. An
    /// eye that moves this far in each frame causes a jump in every second frame. Each frame between two jumps recalls
    /// the polygons that were visible in the previous frame.
    pub(super) fn jumps_to(
        &mut self,
        eye_in_world: Vec3,
        (handles, polygons): (&[Handle], u32),
        scene: &Scene,
    ) -> bool {
        let has_jumped = polygons > 0
            && (!have_common(&self.handles, handles, polygons.div_ceil(2))
                || !self.has_jumped
                    && eye_in_world.distance(self.eye_in_world)
                        > FAR_PART * usual_distance_m(handles, eye_in_world, scene));
        self.eye_in_world = eye_in_world;
        self.handles.clear();
        self.handles.extend_from_slice(handles);
        self.has_jumped = has_jumped;
        has_jumped
    }
}

fn have_common(a: &[Handle], b: &[Handle], least: u32) -> bool {
    let mut a = a.iter().peekable();
    let mut common = 0;
    for handle in b {
        while a.next_if(|before| before.cluster < handle.cluster).is_some() {}
        if let Some(same) = a.peek().filter(|same| same.cluster == handle.cluster) {
            common += (same.bits() & handle.bits()).count_ones();
        }
        if common >= least {
            return true;
        }
    }
    common >= least
}

/// Median distance of sampled polygons from the eye, metres.
fn usual_distance_m(handles: &[Handle], eye_in_world: Vec3, scene: &Scene) -> f32 {
    let step = handles.len().div_ceil(SAMPLES).max(1);
    let first_of = |handle: &Handle| handle.ids().next();
    let distance_m = |id| scene.bounds(id).center().distance(eye_in_world);
    let mut distances_m: Vec<f32> =
        handles.iter().step_by(step).filter_map(first_of).map(distance_m).collect();
    distances_m.sort_unstable_by(f32::total_cmp);
    distances_m.get(distances_m.len() / 2).copied().unwrap_or(f32::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{run::CLUSTER, test_scene};

    fn row(count: u8) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        let at = |i: u8| corners.map(|p| Vec3::X * f32::from(i) * 0.25 + p * 0.1).to_vec();
        test_scene::of((0..count).map(|i| (at(i), (1.0, 1.0, 1.0, 1.0))))
    }

    fn handles(bits: [u64; 3]) -> (Vec<Handle>, u32) {
        let all = bits.into_iter().zip(0..).map(|(bits, cluster)| Handle::new(cluster * CLUSTER, bits));
        let count = bits.iter().map(|bits| bits.count_ones()).sum();
        (all.filter(|handle| handle.bits() != 0).collect(), count)
    }

    fn jumps(last: &mut LastLook, eye: Vec3, (handles, count): (Vec<Handle>, u32), scene: &Scene) -> bool {
        last.jumps_to(eye, (&handles, count), scene)
    }

    #[test]
    fn it_jumps_where_most_in_view_is_new_or_the_eye_has_moved_far() {
        let scene = row(192);
        let mut last = LastLook::default();
        let eye = Vec3::new(24.0, 0.0, 10.0);
        let all = handles([u64::MAX; 3]);
        assert!(jumps(&mut last, eye, all.clone(), &scene), "the first frame");
        assert!(!jumps(&mut last, eye, all.clone(), &scene));
        // First all of these polygons were in view before, then half, then less than half.
        assert!(!jumps(&mut last, eye, handles([0, 0xFFFF_FFFF, 0]), &scene));
        assert!(!jumps(&mut last, eye, handles([0xFFFF, 0xFFFF, 0]), &scene));
        assert!(jumps(&mut last, eye, handles([0xFFFF_FFFF, 0xF, 0xFF]), &scene));
        // The polygons are about 10 to 26 m away.
        jumps(&mut last, eye, all.clone(), &scene);
        assert!(!jumps(&mut last, eye + Vec3::Y * 4.0, all.clone(), &scene));
        assert!(jumps(&mut last, eye - Vec3::Y * 16.0, all.clone(), &scene));
        assert!(!jumps(&mut last, eye - Vec3::Y * 32.0, all.clone(), &scene), "the next one recalls");
        assert!(jumps(&mut last, eye - Vec3::Y * 200.0, all.clone(), &scene));
        // Without polygons in view, there is nothing to recall.
        assert!(!jumps(&mut last, eye, handles([0; 3]), &scene));
        assert!(jumps(&mut last, eye, all.clone(), &scene));
    }
}
