use glam::{Quat, Vec3};

use super::Rig;
use osp::math::{rotate, unit};
use osp::view::View;

/// The transform between a rig's room and the world. Its rotation is always about +y, so that the floor is horizontal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoomPlace {
    head_in_room: Vec3,
    head_in_world: Vec3,
    /// Sine and cosine of half the rotation angle about +y.
    half_turn: (f32, f32),
}

impl RoomPlace {
    /// Creates the transform that puts the rig's head position at `eye_in_world`, and the room's front in the direction
    /// of view.
    pub fn around(rig: &Rig, eye_in_world: Vec3, world_from_view: Quat) -> Self {
        let back = rotate(world_from_view, Vec3::Z);
        let level_m = (back.x * back.x + back.z * back.z).sqrt();
        // The rotation about +y maps +z to `back`. Half-angle formulas give the same bits on every machine. An eye that
        // looks straight up or down has no horizontal direction, so its rotation is 0.
        let (sine, cosine) = if level_m > 0.0 { (back.x / level_m, back.z / level_m) } else { (0.0, 1.0) };
        let half_cosine = ((1.0 + cosine) * 0.5).max(0.0).sqrt();
        let half_sine = ((1.0 - cosine) * 0.5).max(0.0).sqrt().copysign(sine);
        let half_turn = (half_sine, half_cosine);
        Self { head_in_room: rig.head, head_in_world: eye_in_world, half_turn }
    }

    /// The rotation `q`, followed by a rotation about +y with this half angle.
    fn turn((sine, cosine): (f32, f32), q: Quat) -> Quat {
        unit(Quat::from_xyzw(
            cosine * q.x + sine * q.z,
            cosine * q.y + sine * q.w,
            cosine * q.z - sine * q.x,
            cosine * q.w - sine * q.y,
        ))
    }

    fn back(&self) -> (f32, f32) {
        (-self.half_turn.0, self.half_turn.1)
    }

    /// Transforms a point from room space to world space.
    pub fn to_world(&self, p: Vec3) -> Vec3 {
        self.head_in_world + rotate(Self::turn(self.half_turn, Quat::IDENTITY), p - self.head_in_room)
    }

    pub fn turn_to_world(&self, room_from_it: Quat) -> Quat {
        Self::turn(self.half_turn, room_from_it)
    }

    /// Transforms a point from world space to room space.
    pub fn to_room(&self, p: Vec3) -> Vec3 {
        self.head_in_room + rotate(Self::turn(self.back(), Quat::IDENTITY), p - self.head_in_world)
    }

    pub fn turn_to_room(&self, world_from_it: Quat) -> Quat {
        Self::turn(self.back(), world_from_it)
    }

    pub fn view_to_world(&self, view: View) -> View {
        View {
            eye_in_world: self.to_world(view.eye_in_world),
            world_from_view: self.turn_to_world(view.world_from_view),
            ..view
        }
    }
}
