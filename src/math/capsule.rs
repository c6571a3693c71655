use glam::{DVec3, Vec3};

use super::{Obb, Ray, Sphere, Volume};

/// All points within a distance of a segment: a cylinder with a half sphere at each end. World space, metres.
///
/// It fits long and thin shapes, such as a short piece of a stroke, closer than a sphere does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end of the segment.
    pub from: Vec3,
    /// The other end of the segment.
    pub to: Vec3,
    /// Largest distance from the segment, metres.
    pub radius_m: f32,
}

impl Capsule {
    /// A capsule around some points, along the longest of their principal axes. It is not the smallest capsule. If a sphere
    /// around the points is narrower, the capsule is that sphere. Returns `None` if [`Obb::from_points`] does. O(n).
    pub fn from_points(points: &[Vec3]) -> Option<Self> {
        let obb = Obb::from_points(points)?;
        let axis = obb.axes()[obb.half_sides_m().max_position()].as_dvec3();
        let center = obb.center().as_dvec3();
        let parts = points.iter().map(|p| {
            let by = p.as_dvec3() - center;
            let along = by.dot(axis);
            (along, (by - axis * along).length_squared())
        });
        let radius_squared = parts.clone().map(|(_, off)| off).fold(0.0, f64::max);
        // Each point lies in the half sphere at an end, or between the ends.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (along, off) in parts {
            let reach = (radius_squared - off).max(0.0).sqrt();
            (low, high) = (low.min(along + reach), high.max(along - reach));
        }
        if low > high {
            (low, high) = ((low + high) * 0.5, (low + high) * 0.5);
        }
        let end = |along: f64| (center + axis * along).as_vec3();
        let along_axis = Self::around(end(low), end(high), points);
        // The centre of a box around few points may be far from their axis, so a sphere around the centre of their
        // axis-aligned box is tried, too.
        let middle = Sphere::from_points(points).center;
        let ball = Self::around(middle, middle, points);
        Some(if ball.radius_m < along_axis.radius_m { ball } else { along_axis })
    }

    /// The narrowest capsule around the segment that contains all points.
    fn around(from: Vec3, to: Vec3, points: &[Vec3]) -> Self {
        let line = Self { from, to, radius_m: 0.0 };
        let far = points.iter().map(|p| line.distance(*p)).fold(0.0, f64::max);
        Self { radius_m: far as f32 * (1.0 + 4.0 * f32::EPSILON), ..line }
    }

    /// Distance from a point to the segment, metres.
    fn distance(&self, p: Vec3) -> f64 {
        let (from, by) = (self.from.as_dvec3(), self.to.as_dvec3() - self.from.as_dvec3());
        let over = by.length_squared();
        let part = if over > 0.0 { ((p.as_dvec3() - from).dot(by) / over).clamp(0.0, 1.0) } else { 0.0 };
        p.as_dvec3().distance(from + by * part)
    }

    /// Whether a point lies in the capsule.
    pub fn contains(&self, p: Vec3) -> bool {
        self.distance(p) <= f64::from(self.radius_m)
    }
}

#[doc(hidden)]
impl Volume for Capsule {
    fn center(&self) -> Vec3 {
        self.from * 0.5 + self.to * 0.5
    }

    fn reach_along(&self, direction: Vec3) -> f32 {
        (self.to * 0.5 - self.from * 0.5).dot(direction).abs() + self.radius_m * direction.length()
    }

    fn size_m(&self) -> f32 {
        (self.to * 0.5 - self.from * 0.5).length() + self.radius_m
    }
}

/// The part of a ray inside a convex volume: the `t` of entry and of exit.
type Span = Option<(f64, f64)>;

impl Ray {
    /// The `t` at which the ray enters the sphere (0 if the ray starts inside), if it is at most `t_max`.
    ///
    /// Eric Haines, Johannes Günther and Tomas Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray
    /// Tracing Gems, 2019. It is computed in `f64`, because `f32` fails for small spheres far away.
    pub fn enter_sphere(&self, sphere: &Sphere, t_max: f32) -> Option<f32> {
        self.entry(self.in_ball(sphere.center, sphere.radius_m), t_max)
    }

    /// The `t` at which the ray enters the capsule (0 if the ray starts inside), if it is at most `t_max`. It is the first
    /// entry into the cylinder and the spheres at its ends.
    #[doc(hidden)]
    pub fn enter_capsule(&self, capsule: &Capsule, t_max: f32) -> Option<f32> {
        let Capsule { from, to, radius_m } = *capsule;
        let parts = [self.in_cylinder(capsule), self.in_ball(from, radius_m), self.in_ball(to, radius_m)];
        parts.into_iter().filter_map(|span| self.entry(span, t_max)).reduce(f32::min)
    }

    fn in_ball(&self, center: Vec3, radius_m: f32) -> Span {
        let (origin, direction) = (self.origin.as_dvec3() - center.as_dvec3(), self.direction.as_dvec3());
        let radius_squared = f64::from(radius_m) * f64::from(radius_m);
        let a = direction.length_squared();
        let nearest = -origin.dot(direction) / a;
        let below = radius_squared - (origin + direction * nearest).length_squared();
        if below < 0.0 {
            return None;
        }
        let half = (below / a).sqrt();
        Some((nearest - half, nearest + half))
    }

    /// The part of the ray inside the cylinder around the segment, without the half spheres.
    fn in_cylinder(&self, capsule: &Capsule) -> Span {
        let (origin, direction) =
            (self.origin.as_dvec3() - capsule.from.as_dvec3(), self.direction.as_dvec3());
        let by = capsule.to.as_dvec3() - capsule.from.as_dvec3();
        let length = by.length();
        if length == 0.0 {
            return None;
        }
        let axis = by / length;
        let across = |v: DVec3| v - axis * v.dot(axis);
        let (off, way) = (across(origin), across(direction));
        let radius_squared = f64::from(capsule.radius_m) * f64::from(capsule.radius_m);
        let a = way.length_squared();
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        if a > 0.0 {
            let nearest = -off.dot(way) / a;
            let below = radius_squared - (off + way * nearest).length_squared();
            if below < 0.0 {
                return None;
            }
            let half = (below / a).sqrt();
            (enter, leave) = (nearest - half, nearest + half);
        } else if off.length_squared() > radius_squared {
            return None;
        }
        // The cylinder lies between the planes through its ends.
        let (height, climb) = (origin.dot(axis), direction.dot(axis));
        if climb != 0.0 {
            let (a, b) = (-height / climb, (length - height) / climb);
            (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
        } else if !(0.0..=length).contains(&height) {
            return None;
        }
        (enter <= leave).then_some((enter, leave))
    }

    /// The `t` of entry into a span, at least 0, if it is at most `t_max`.
    fn entry(&self, span: Span, t_max: f32) -> Option<f32> {
        let (enter, leave) = span.filter(|_| self.is_valid())?;
        let enter = enter.max(0.0);
        (enter <= leave && enter <= f64::from(t_max)).then_some(enter as f32)
    }
}
