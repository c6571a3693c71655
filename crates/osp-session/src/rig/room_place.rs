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

    /// Transforms a rotation from room space to world space.
    pub fn turn_to_world(&self, room_from_it: Quat) -> Quat {
        Self::turn(self.half_turn, room_from_it)
    }

    /// Transforms a point from world space to room space.
    pub fn to_room(&self, p: Vec3) -> Vec3 {
        self.head_in_room + rotate(Self::turn(self.back(), Quat::IDENTITY), p - self.head_in_world)
    }

    /// Transforms a rotation from world space to room space.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_of_the_room_is_where_the_eye_is_and_the_front_where_it_looks() {
        let rig = Rig::open("dual-wall").expect("a shipped rig");
        for (yaw, pitch) in
            [(0.0, 0.0), (0.7, -0.4), (-0.7, 0.4), (3.0, 0.2), (-3.1, -1.0), (std::f32::consts::PI, 0.0)]
        {
            let look = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch);
            let eye = Vec3::new(5.0, 2.0, -3.0);
            let place = RoomPlace::around(&rig, eye, look);
            assert_eq!(place.to_world(rig.head), eye);
            let front = place.to_world(rig.head + Vec3::NEG_Z) - eye;
            assert!(
                front.distance(rotate(Quat::from_rotation_y(yaw), Vec3::NEG_Z)) < 1.0e-5,
                "{yaw}: {front}"
            );
            let p = Vec3::new(0.3, 1.1, -0.8);
            assert!(place.to_room(place.to_world(p)).distance(p) < 1.0e-5);
            let back_and_forth = place.turn_to_world(place.turn_to_room(look));
            assert!(back_and_forth.dot(look).abs() > 1.0 - 1.0e-5);
            // Only the pitch of the viewing direction remains.
            let seen = rotate(place.turn_to_room(look), Vec3::NEG_Z);
            assert!(seen.distance(rotate(Quat::from_rotation_x(pitch), Vec3::NEG_Z)) < 1.0e-5);
        }
        let down = RoomPlace::around(&rig, Vec3::ZERO, Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2));
        assert!(down.to_world(rig.head + Vec3::Y).distance(Vec3::Y) < 1.0e-5);
    }
}
