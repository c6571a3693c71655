use glam::Vec3;

use crate::rig::{Eye, Rig, RoomPlace, Stereo};
use osp::math::Aabb;
use osp::view::View;

const NEAR_M: f32 = 0.02;

/// Smallest distance of an eye from a screen, metres. An eye that is nearer or behind the screen can be moved to this
/// distance, because its picture would be too distorted.
pub const NEAREST_EYE_M: f32 = 0.05;

/// Far distance with which an eye sees everything in `bounds`, metres.
pub fn far_m(eye: Vec3, bounds: &Aabb) -> f32 {
    let farthest_m = match bounds.is_empty() {
        true => 0.0,
        false => bounds.corners().iter().map(|p| p.distance(eye)).fold(0.0, f32::max),
    };
    (farthest_m * 1.05).max(100.0)
}

/// Motion of a rig's room while the recorded head moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RoomMotion {
    /// The room moves with the head: the rig's head position is at the eye, and the room's front is in the direction of
    /// view.
    #[default]
    Follows,
    /// The room keeps its position of the first frame. The head moves in the room, and may move behind a screen.
    Stands,
}

impl RoomMotion {
    pub const ALL: &'static [Self] = &[Self::Follows, Self::Stands];

    /// The motion's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Follows => "follows",
            Self::Stands => "stands",
        }
    }
}

/// The view of an eye on a screen in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigView {
    pub screen: usize,
    pub eye: Eye,
    /// The view; `None` if the eye is not in front of the screen.
    pub view: Option<View>,
}

/// The views on the screens of a rig, around the eye of a replay.
#[derive(Clone, Debug)]
pub struct RigPath {
    rig: Rig,
    stereo: Stereo,
    motion: RoomMotion,
    /// Position of a room that stands; `None` before the first frame.
    place: Option<RoomPlace>,
}

impl RigPath {
    pub fn new(rig: Rig, stereo: Stereo, motion: RoomMotion) -> Self {
        Self { rig, stereo, motion, place: None }
    }

    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    pub fn stereo(&self) -> Stereo {
        self.stereo
    }

    pub fn motion(&self) -> RoomMotion {
        self.motion
    }

    /// The screen index and eye of each view of a frame, in the order of the views.
    pub fn slots(&self) -> impl Iterator<Item = (usize, Eye)> + '_ {
        let eyes = self.stereo.eyes();
        (0..self.rig.screens.len()).flat_map(|screen| eyes.iter().map(move |eye| (screen, *eye)))
    }

    /// Replaces `out` by the views of a frame, one for each screen and eye. The head has the camera's position and
    /// orientation.
    pub fn views_into(&mut self, camera: &View, out: &mut Vec<RigView>) {
        let here = RoomPlace::around(&self.rig, camera.eye_in_world, camera.world_from_view);
        let place = match self.motion {
            RoomMotion::Follows => here,
            RoomMotion::Stands => *self.place.get_or_insert(here),
        };
        let head = place.to_room(camera.eye_in_world);
        let room_from_head = place.turn_to_room(camera.world_from_view);
        let near_m = camera.projection.near_m.min(NEAR_M);
        // The far distance of the camera is extended by the offset of the eyes.
        let far_m = camera.projection.far_m + self.rig.eye_separation_m;
        out.clear();
        out.extend(self.slots().map(|(screen, eye)| {
            let eye_in_room = self.rig.eye_in_room(eye, head, room_from_head);
            let in_room = self.rig.screens[screen].view(eye_in_room, near_m, far_m);
            RigView { screen, eye, view: in_room.map(|view| place.view_to_world(view)) }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use osp::view::Projection;

    fn camera(eye: Vec3, towards: Vec3) -> View {
        View::look_at(eye, eye + towards, Projection::symmetric(60.0, 1.5, 0.01, 50.0))
    }

    fn views(path: &mut RigPath, camera: &View) -> Vec<RigView> {
        let mut views = Vec::new();
        path.views_into(camera, &mut views);
        views
    }

    #[test]
    fn a_room_that_follows_shows_the_same_angles_everywhere() {
        let rig = Rig::open("dual-wall").expect("a shipped rig");
        let mut path = RigPath::new(rig.clone(), Stereo::SideBySide, RoomMotion::Follows);
        assert_eq!(path.slots().count(), 4);
        let (here, there) = (camera(Vec3::ZERO, Vec3::NEG_Z), camera(Vec3::new(9.0, 3.0, 4.0), Vec3::X));
        let (a, b) = (views(&mut path, &here), views(&mut path, &there));
        for (a, b) in a.iter().zip(&b) {
            let (a, b) = (a.view.expect("a view"), b.view.expect("a view"));
            assert!((a.projection.left - b.projection.left).abs() < 1.0e-5);
        }
        let eyes: Vec<Vec3> = b.iter().map(|seen| seen.view.expect("a view").eye_in_world).collect();
        // If the head looks along +x, the left eye is at smaller z.
        let half_m = Vec3::Z * (rig.eye_separation_m * 0.5);
        assert!(eyes[0].distance(there.eye_in_world - half_m) < 1.0e-5, "{eyes:?}");
        assert!(eyes[1].distance(there.eye_in_world + half_m) < 1.0e-5, "{eyes:?}");
        let forward = b[0].view.expect("a view").forward_in_world();
        assert!(forward.distance(Vec3::new(1.0, 0.0, -1.0).normalize()) < 1.0e-4, "left screen: {forward}");
    }

    #[test]
    fn a_room_that_stands_has_walls_to_walk_through() {
        let rig = Rig::open("dual-wall").expect("a shipped rig");
        let mut path = RigPath::new(rig, Stereo::Mono, RoomMotion::Stands);
        let start = camera(Vec3::new(2.0, 1.7, 2.0), Vec3::NEG_Z);
        assert!(views(&mut path, &start).iter().all(|seen| seen.view.is_some()));
        // Two metres to the right the head is behind the right wall, and farther away from the left wall.
        let beside = camera(Vec3::new(4.0, 1.7, 2.0), Vec3::NEG_Z);
        let seen = views(&mut path, &beside);
        assert!(seen[1].view.is_none(), "{seen:?}");
        let Projection { left, right, .. } = seen[0].view.expect("a view").projection;
        let first = views(&mut path, &start)[0].view.expect("a view").projection;
        assert!(right - left < first.right - first.left);
        assert_eq!(seen[0].view.map(|view| view.eye_in_world), Some(beside.eye_in_world));
    }
}
