use glam::{DVec3, Vec3};
use rand_pcg::{Pcg64, rand_core::Rng};

use osp::{
    math::Aabb,
    view::{Projection, View},
};

/// Smallest distance of a flight's points from the border of the world, as a fraction of its extent. This margin keeps
/// most of the world in front of the eye.
const MARGIN: f64 = 0.1;
const FOV_DEGREES: f32 = 60.0;
const ASPECT: f32 = 16.0 / 9.0;
/// Near distance, metres; smaller in a very small world.
const NEAR_M: f32 = 0.02;
/// The generator's default stream, written out so that it cannot change with the library.
const STREAM: u128 = 0x0a02_bdbf_7bb3_c0a7_ac28_fa16_a64a_bf96;
/// Cosine of the largest angle by which the eye turns in one frame. A larger turn is divided over several frames.
const QUICK_TURN: f64 = 0.95;

/// A smooth flight through a world, the same for the same box and seed on every machine. It is a Catmull-Rom spline (E.
/// Catmull, R. Rom, "A Class of Local Interpolating Splines", 1974) through random points. The eye looks in the direction
/// of flight.
#[derive(Clone, Debug)]
pub struct Flight {
    bounds: Aabb,
    step_m: f64,
    far_m: f32,
    random: Pcg64,
    points: [DVec3; 4],
    /// Position between the second and the third point, from 0 to 1.
    along: f64,
    /// Direction of view of the last frame.
    forward: Option<DVec3>,
}

impl Flight {
    /// A flight through `bounds`. The eye moves by `step_m` a frame; by default 900 frames cross the longest side once. The
    /// eye sees up to `far_m`, by default the whole world.
    pub fn new(bounds: &Aabb, seed: u64, step_m: Option<f32>, far_m: Option<f32>) -> Self {
        let bounds = if bounds.is_valid() { *bounds } else { Aabb::cube(Vec3::ZERO, 1.0) };
        let longest_m = f64::from(bounds.extent().max_element()).max(1.0e-4);
        let whole_m = bounds.extent().length().max(1.0e-4);
        let mut this = Self {
            bounds,
            step_m: step_m.map_or(longest_m / 900.0, f64::from),
            far_m: far_m.unwrap_or(whole_m * 1.01),
            random: Pcg64::new(u128::from(seed), STREAM),
            points: [DVec3::ZERO; 4],
            along: 0.0,
            forward: None,
        };
        this.points = std::array::from_fn(|_| this.point());
        this
    }

    fn point(&mut self) -> DVec3 {
        let mut share = || {
            let random = (self.random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            MARGIN + random * (1.0 - 2.0 * MARGIN)
        };
        let at = DVec3::new(share(), share(), share());
        let (min, max) = (self.bounds.min.as_dvec3(), self.bounds.max.as_dvec3());
        min + (max - min) * at
    }

    /// Position and direction (not of unit length) on the spline.
    fn at(&self) -> (DVec3, DVec3) {
        let [a, b, c, d] = self.points;
        let t = self.along;
        let (k1, k2, k3) = ((c - a) * 0.5, a - b * 2.5 + c * 2.0 - d * 0.5, (d - a) * 0.5 + (b - c) * 1.5);
        (b + (k1 + (k2 + k3 * t) * t) * t, k1 + (k2 * 2.0 + k3 * (3.0 * t)) * t)
    }
}

impl Iterator for Flight {
    type Item = View;

    fn next(&mut self) -> Option<View> {
        let (eye, direction) = self.at();
        let eye_in_world = eye.as_vec3();
        let ahead = direction.normalize_or(DVec3::NEG_Z);
        // If the path turns back within a step, the eye turns over several frames.
        let forward = match self.forward {
            Some(last) if last.dot(ahead) < QUICK_TURN => (last * 3.0 + ahead).normalize_or(ahead),
            _ => ahead,
        };
        self.forward = Some(forward);
        let forward = forward.as_vec3();
        let near_m = NEAR_M.min(self.far_m * 1.0e-3);
        let projection = Projection::symmetric(FOV_DEGREES, ASPECT, near_m, self.far_m);
        // The target is a metre from the origin, because a target near a far-off eye would be rounded.
        let view = View { eye_in_world, ..View::look_at(Vec3::ZERO, forward, projection) };
        // Where the spline hardly moves, the eye moves by at most the distance to the next point.
        let speed_m = direction.length().max(self.step_m);
        self.along += (self.step_m / speed_m).min(1.0);
        if self.along >= 1.0 {
            self.along -= 1.0;
            let [_, b, c, d] = self.points;
            self.points = [b, c, d, self.point()];
        }
        Some(view)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flight_is_smooth_stays_near_the_world_and_is_the_same_again() {
        let bounds = Aabb::new(Vec3::new(-5.0, 0.0, 100.0), Vec3::new(45.0, 10.0, 140.0));
        let flight = || Flight::new(&bounds, 7, Some(0.05), None);
        let views: Vec<View> = flight().take(3000).collect();
        assert!(flight().take(3000).eq(views.iter().copied()));
        assert!(Flight::new(&bounds, 8, Some(0.05), None).take(10).ne(views[..10].iter().copied()));
        for pair in views.windows(2) {
            let step_m = pair[0].eye_in_world.distance(pair[1].eye_in_world);
            assert!(step_m < 0.1, "{step_m}");
            assert!(pair[0].forward_in_world().dot(pair[1].forward_in_world()) > 0.9);
        }
        let around = Aabb::new(bounds.min - 20.0, bounds.max + 20.0);
        assert!(views.iter().all(|view| around.contains(&Aabb::from_points(&[view.eye_in_world]))));
        let way_m: f32 =
            views.windows(2).map(|pair| pair[0].eye_in_world.distance(pair[1].eye_in_world)).sum();
        assert!((100.0..170.0).contains(&way_m), "{way_m}");
    }
}
