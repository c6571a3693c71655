//! An oracle for draw lists: rays find visible objects that a culler, of this crate or another, has culled.

use glam::{DMat4, DVec3, DVec4};
use thiserror::Error;

use super::camera::Camera;
use crate::{
    index::{IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Ray},
    polygon::PolygonId,
};

/// Tolerance at a tested point, the end of a ray, as a fraction of the ray's length. Another object up to this distance
/// behind the point hides the point, because surfaces may touch. A surface of the same object up to this distance in
/// front of the point does not hide it.
const TOUCHES: f64 = 1.0e-5;

/// A ray that misses a triangle by at most this fraction of the triangle's size counts as a hit.
const MISS_TOLERANCE: f64 = 1.0e-6;

/// Boxes are enlarged by this fraction of the largest coordinate.
const ROUNDING: f32 = 4.0e-6;

/// Points closer than this to the edge of the screen are not tested, in normalised device coordinates (half the screen
/// is 1).
const EDGE: f64 = 1.0e-4;

/// The reason why a triangle was refused.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum OracleError {
    /// A coordinate is infinite or NaN.
    #[error("triangle {triangle}: expected finite coordinates, found {found:?}")]
    NotFinite {
        /// Position of the triangle in the call.
        triangle: usize,
        /// The triangle's corners.
        found: [[f32; 3]; 3],
    },
    /// The oracle has too many triangles.
    #[error("triangle {triangle}: expected at most {limit} triangles", limit = PolygonId::LIMIT)]
    Full {
        /// Position of the triangle in the call.
        triangle: usize,
    },
}

/// A visible point of an object that is not drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Missing {
    /// The object.
    pub object: u32,
    /// The point, world space, metres.
    pub point_m: [f32; 3],
}

/// Tests the draw list of any culler, of this crate or another, by rays: no ray from the camera may reach a point of an
/// object that was culled. Every error that it reports is real. It may miss errors, because it tests only sample
/// points.
#[derive(Clone, Debug, Default)]
pub struct Oracle {
    triangles: Vec<[DVec3; 3]>,
    /// For each triangle, its object.
    objects: Vec<u32>,
}

impl Oracle {
    /// An oracle of an empty world.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds opaque triangles of an object, seen from both sides, with corners in world space, metres. Omit transparent
    /// objects. Triangles without area are skipped.
    ///
    /// # Errors
    /// [`OracleError`]: a coordinate is not finite, or there are too many triangles. The triangles before the error were
    /// added.
    pub fn add(
        &mut self,
        object: u32,
        triangles: impl IntoIterator<Item = [[f32; 3]; 3]>,
    ) -> Result<(), OracleError> {
        for (triangle, corners) in triangles.into_iter().enumerate() {
            if !corners.iter().flatten().all(|number| number.is_finite()) {
                return Err(OracleError::NotFinite { triangle, found: corners });
            }
            if self.triangles.len() >= PolygonId::LIMIT as usize {
                return Err(OracleError::Full { triangle });
            }
            let [a, b, c] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
            if (b - a).cross(c - a) != DVec3::ZERO {
                self.triangles.push([a, b, c]);
                self.objects.push(object);
            }
        }
        Ok(())
    }

    /// Finds a visible point of each object that the camera shows although the object is not drawn. Tests `points` points
    /// of each triangle: its middle, and others. The oracle ignores the camera's layers: `is_drawn` must also return true
    /// for an object that is on none of them. Takes O(triangles log triangles), and O(triangles of undrawn objects x
    /// `points` x log triangles).
    pub fn missing(&self, camera: &Camera, is_drawn: impl Fn(u32) -> bool, points: u32) -> Vec<Missing> {
        let clip_from_world = camera.world_from_clip().inverse();
        let world = World::new(&self.triangles);
        let mut missing: Vec<Missing> = Vec::new();
        for (triangle, &object) in self.objects.iter().enumerate() {
            if missing.last().is_some_and(|last| last.object == object) || is_drawn(object) {
                continue;
            }
            let shown = (0..points.max(1))
                .map(|number| point_of(&self.triangles[triangle], number))
                .find(|&point| self.shows(&world, camera, &clip_from_world, triangle, point));
            if let Some(point) = shown {
                missing.push(Missing { object, point_m: point.as_vec3().into() });
            }
        }
        missing.sort_by_key(|found| found.object);
        missing.dedup_by_key(|found| found.object);
        missing
    }

    /// Whether the camera shows a point of a triangle.
    fn shows(
        &self,
        world: &World,
        camera: &Camera,
        clip_from_world: &DMat4,
        triangle: usize,
        point: DVec3,
    ) -> bool {
        let clip = *clip_from_world * point.extend(1.0);
        let [x, y, depth] = [clip.x, clip.y, clip.z].map(|coordinate| coordinate / clip.w);
        let (near, far) = camera.depths();
        let (low, high) = (near.min(far), near.max(far));
        let is_on_screen = clip.w > 0.0 && x.abs() < 1.0 - EDGE && y.abs() < 1.0 - EDGE;
        let is_between = depth > low + EDGE * EDGE && depth < high - EDGE * EDGE;
        if !(is_on_screen && is_between) {
            return false;
        }
        let start = *camera.world_from_clip() * DVec4::new(x, y, near, 1.0);
        let start = start.truncate() / start.w;
        !self.is_hidden(world, triangle, start, point - start)
    }

    /// Whether a surface lies between the start of a ray and its end on a triangle.
    fn is_hidden(&self, world: &World, triangle: usize, start: DVec3, direction: DVec3) -> bool {
        let object = self.objects[triangle];
        world.any_along(start, direction, |other| {
            let is_own = self.objects[other] == object;
            let end = if is_own { 1.0 - TOUCHES } else { 1.0 + TOUCHES };
            let t = if other == triangle { None } else { meet(start, direction, &self.triangles[other]) };
            t.is_some_and(|t| (0.0..end).contains(&t))
        })
    }
}

/// An index of all triangles. Their boxes are enlarged by the rounding to `f32`.
struct World {
    index: Osp,
    bounds: Aabb,
}

impl World {
    fn new(triangles: &[[DVec3; 3]]) -> Self {
        let box_of = |corners: &[DVec3; 3]| Aabb::from_points(&corners.map(|corner| corner.as_vec3()));
        let around = triangles.iter().fold(Aabb::EMPTY, |around, corners| around.union(&box_of(corners)));
        let margin_m = ROUNDING * around.min.abs().max(around.max.abs()).max_element();
        let mut index = Osp::new(&IndexConfig { root: around, capacity: triangles.len() });
        for (number, corners) in triangles.iter().enumerate() {
            let Aabb { min, max } = box_of(corners);
            let bounds = Aabb::new(min - margin_m, max + margin_m);
            // A triangle whose box overflows is left out, so it hides nothing.
            _ = index.insert(PolygonId(number as u32), &bounds);
        }
        index.commit();
        Self { index, bounds: Aabb::new(around.min - margin_m, around.max + margin_m) }
    }

    /// Whether `is_met` holds for a triangle near a ray. The search reaches a little beyond the ray's end.
    fn any_along(&self, start: DVec3, direction: DVec3, mut is_met: impl FnMut(usize) -> bool) -> bool {
        // The ray is shortened to begin at its entry into the world, so that its coordinates are no larger than those of
        // the boxes.
        let (min, max) = (self.bounds.min.as_dvec3(), self.bounds.max.as_dvec3());
        let (to_min, to_max) = ((min - start) / direction, (max - start) / direction);
        let enters = to_min.min(to_max).max_element();
        let skipped = if enters.is_finite() { enters.clamp(0.0, 0.999) } else { 0.0 };
        let left = direction * (1.0 - skipped);
        let ray = Ray::new((start + direction * skipped).as_vec3(), left.as_vec3());
        if !ray.is_valid() {
            // A ray that `f32` cannot express tests nothing, so the point counts as hidden.
            return true;
        }
        let mut hit = |id: PolygonId| is_met(id.index()).then_some(0.0);
        self.index.ray_any(&ray, 1.0 + 1.0e-3, &mut hit).is_some()
    }
}

/// A point of a triangle: number 0 is its middle; further points fill it evenly (Martin Roberts's R2 sequence).
fn point_of([a, b, c]: &[DVec3; 3], number: u32) -> DVec3 {
    if number == 0 {
        return (*a + *b + *c) / 3.0;
    }
    let [u, v] =
        [0.754_877_666_246_693, 0.569_840_290_998_053_2].map(|step| (f64::from(number) * step).fract());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    *a + (*b - *a) * u + (*c - *a) * v
}

/// Distance at which a ray meets a slightly enlarged triangle, in lengths of the ray (Tomas Möller and Ben Trumbore, "Fast,
/// Minimum Storage Ray/Triangle Intersection", 1997).
fn meet(start: DVec3, direction: DVec3, [a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (to_b, to_c) = (*b - *a, *c - *a);
    let across = direction.cross(to_c);
    let volume = to_b.dot(across);
    if volume == 0.0 {
        return None;
    }
    let from_a = start - *a;
    let along = from_a.cross(to_b);
    let (u, v, t) = (from_a.dot(across) / volume, direction.dot(along) / volume, to_c.dot(along) / volume);
    (u >= -MISS_TOLERANCE && v >= -MISS_TOLERANCE && u + v <= 1.0 + MISS_TOLERANCE).then_some(t)
}
