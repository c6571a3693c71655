use glam::DVec3;
use robust::{Coord3D, orient3d};

/// Largest number of corners of a hull. A larger number gives finer hulls of long strokes, but each point takes more
/// time.
const MAX_CORNERS: usize = 1000;

/// Number of directions. If a hull has too many corners, only the farthest point in each direction stays.
const DIRECTIONS: usize = 700;

/// Points whose distance from a hull is below this fraction of their coordinates count as inside. The fraction follows
/// from the precision of `f32`.
const PRECISION: f64 = 1.0 / (1 << 22) as f64;

/// The convex hull of points that are added one by one: a closed mesh of triangles.
///
/// For a point outside the hull, all triangles that face it are removed. New triangles join the outline of the hole to
/// the point (Clarkson and Shor, "Applications of Random Sampling in Computational Geometry, II", 1989). There are no
/// conflict lists, because a hull of a stroke has only about a hundred triangles. The facing test is exact (Shewchuk's
/// predicates), so coplanar, collinear and repeated points are safe.
#[derive(Clone, Debug)]
pub(super) struct ConvexHull {
    tolerance_m: f64,
    /// All points, while they are coplanar. Afterwards, the corners and some former corners.
    points: Vec<DVec3>,
    /// The triangles, counterclockwise from outside.
    triangles: Vec<Triangle>,
    /// Extent of the hull in each of the [`directions`]; `None` until the hull first has too many corners.
    reach: Option<Vec<f64>>,
}

#[derive(Clone, Copy, Debug)]
struct Triangle {
    corners: [u32; 3],
    /// Outward unit normal; zero for a needle.
    normal: DVec3,
    /// Position of the first corner.
    at: DVec3,
    /// Bound of the rounding error of a point's height above the plane, as a fraction of the point's distance from the
    /// first corner. It is not finite for a needle.
    rounding: f64,
}

impl Triangle {
    fn height_m(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.at)
    }
}

/// Bound of the relative error of a sum of products of differences.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl ConvexHull {
    /// Creates an empty hull. Points that lie outside by less than `tolerance_m` are ignored.
    pub(super) fn new(tolerance_m: f64) -> Self {
        Self { tolerance_m, points: Vec::new(), triangles: Vec::new(), reach: None }
    }

    /// Whether the hull has no triangles, because all points so far are coplanar.
    pub(super) fn is_flat(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The triangles, counterclockwise from outside. Triangles that a new point does not change usually keep their
    /// index.
    pub(super) fn triangles(&self) -> impl ExactSizeIterator<Item = [DVec3; 3]> {
        self.triangles.iter().map(|triangle| self.corners(triangle))
    }

    /// Normals of each triangle's corners for smooth shading. A normal is the mean over the triangles at the corner,
    /// weighted by their angles.
    pub(super) fn smooth_normals(&self) -> impl ExactSizeIterator<Item = [DVec3; 3]> {
        let mut sums = vec![DVec3::ZERO; self.points.len()];
        for triangle in &self.triangles {
            let at = self.corners(triangle);
            for (i, &corner) in triangle.corners.iter().enumerate() {
                let [to_next, to_last] =
                    [at[(i + 1) % 3], at[(i + 2) % 3]].map(|other| (other - at[i]).normalize_or_zero());
                sums[corner as usize] += triangle.normal * libm::acos(to_next.dot(to_last).clamp(-1.0, 1.0));
            }
        }
        self.triangles.iter().map(move |triangle| triangle.corners.map(|corner| sums[corner as usize]))
    }

    /// Adds a point with finite coordinates. Returns whether the triangles have changed.
    pub(super) fn insert(&mut self, point: DVec3) -> bool {
        if self.is_flat() {
            self.points.push(point);
            if self.points.len() > MAX_CORNERS {
                self.thin_out();
            }
            self.begin();
            return !self.is_flat();
        }
        if !self.has_outside(point) || !self.join(point) {
            return false;
        }
        if let Some(reach) = &mut self.reach {
            for (reach, direction) in reach.iter_mut().zip(directions()) {
                *reach = reach.max(direction.dot(point));
            }
        }
        if self.corner_count() > MAX_CORNERS {
            self.thin_out();
            self.begin();
        } else if self.points.len() > 2 * self.corner_count() + 64 {
            self.forget_inner_points();
        }
        true
    }

    /// Whether a point would change the hull.
    pub(super) fn has_outside(&self, point: DVec3) -> bool {
        if self.is_flat() {
            return true;
        }
        let tolerance_m = self.tolerance_at(point);
        let is_far = self.reach.as_ref().is_none_or(|reach| {
            reach
                .iter()
                .zip(directions())
                .any(|(reach, direction)| direction.dot(point) > reach + tolerance_m)
        });
        if !is_far {
            return false;
        }
        // Near a sharp edge a point may be near to the planes but far from the hull.
        let (mut is_seen, mut is_near) = (false, false);
        for triangle in &self.triangles {
            let height_m = triangle.height_m(point);
            if height_m > tolerance_m {
                return true;
            }
            if self.is_outside(triangle, height_m, point) {
                is_seen = true;
                is_near = is_near || distance(point, self.corners(triangle)) <= tolerance_m;
            }
        }
        is_seen && !is_near
    }

    fn tolerance_at(&self, point: DVec3) -> f64 {
        self.tolerance_m.max(PRECISION * point.abs().max_element())
    }

    fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.corners.map(|corner| self.points[corner as usize])
    }

    /// Number of corners, by Euler's formula.
    fn corner_count(&self) -> usize {
        self.triangles.len() / 2 + 2
    }

    fn triangle(&self, corners: [u32; 3]) -> Triangle {
        let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
        let (to_b, to_c) = (b - a, c - a);
        let doubled_m2 = to_b.cross(to_c);
        let rounding = ROUNDING * (1.0 + to_b.length() * to_c.length() / doubled_m2.length());
        Triangle { corners, normal: doubled_m2.normalize_or_zero(), at: a, rounding }
    }

    /// Creates the first tetrahedron, of points far from each other, and adds the other points to it.
    fn begin(&mut self) {
        let Some([a, b, c, d]) = self.first_corners() else { return };
        for corners in [[a, b, c], [a, d, b], [b, d, c], [c, d, a]] {
            self.triangles.push(self.triangle(corners));
        }
        for at in 0..self.points.len() {
            self.join_known(at as u32);
        }
        self.forget_inner_points();
    }

    /// Corners of a tetrahedron; the first three are counterclockwise from outside.
    fn first_corners(&self) -> Option<[u32; 4]> {
        let a = *self.points.first()?;
        let farthest = |distance: &dyn Fn(DVec3) -> f64| {
            let of = |at: usize| distance(self.points[at]);
            let at = (0..self.points.len()).reduce(|best, at| if of(at) > of(best) { at } else { best })?;
            (of(at) > self.tolerance_at(self.points[at])).then_some(at)
        };
        let b = farthest(&|p| p.distance(a))?;
        let along = (self.points[b] - a).normalize_or_zero();
        let c = farthest(&|p| (p - a).cross(along).length())?;
        let normal = along.cross(self.points[c] - a).normalize_or_zero();
        let d = farthest(&|p| normal.dot(p - a).abs())?;
        let [mut b, mut c, d] = [b, c, d].map(|at| at as u32);
        let side = self.side_of([0, b, c], self.points[d as usize]);
        if side > 0.0 {
            std::mem::swap(&mut b, &mut c);
        }
        (side != 0.0).then_some([0, b, c, d])
    }

    /// Whether a point is on the outer side of a triangle's plane. The result is exact. `height_m` is the point's
    /// height above the plane, with rounding errors.
    fn is_outside(&self, triangle: &Triangle, height_m: f64, point: DVec3) -> bool {
        // The bound of a needle is not finite, so the comparison fails.
        let is_certain = height_m.abs() > triangle.rounding * (point - triangle.at).abs().element_sum();
        if is_certain { height_m > 0.0 } else { self.side_of(triangle.corners, point) > 0.0 }
    }

    /// Positive if the corners are counterclockwise as seen from the point. The sign is exact.
    fn side_of(&self, corners: [u32; 3], point: DVec3) -> f64 {
        let coordinates = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
        let [a, b, c] = corners.map(|corner| coordinates(self.points[corner as usize]));
        -orient3d(a, b, c, coordinates(point))
    }

    /// Makes a point outside the hull a corner. Returns `false` if the point is not outside.
    fn join(&mut self, point: DVec3) -> bool {
        self.points.push(point);
        let is_joined = self.join_known(self.points.len() as u32 - 1);
        if !is_joined {
            self.points.pop();
        }
        is_joined
    }

    fn join_known(&mut self, at: u32) -> bool {
        let point = self.points[at as usize];
        let is_seen = |triangle: &Triangle| self.is_outside(triangle, triangle.height_m(point), point);
        let seen: Vec<usize> = (0..self.triangles.len()).filter(|&i| is_seen(&self.triangles[i])).collect();
        let mut edges: Vec<[u32; 2]> = seen
            .iter()
            .flat_map(|&i| {
                let [a, b, c] = self.triangles[i].corners;
                [[a, b], [b, c], [c, a]]
            })
            .collect();
        edges.sort_unstable();
        let outline: Vec<[u32; 2]> =
            edges.iter().copied().filter(|&[a, b]| edges.binary_search(&[b, a]).is_err()).collect();
        if outline.is_empty() {
            return false;
        }
        for (i, &[a, b]) in outline.iter().enumerate() {
            let triangle = self.triangle([a, b, at]);
            match seen.get(i) {
                Some(&gone) => self.triangles[gone] = triangle,
                None => self.triangles.push(triangle),
            }
        }
        for &gone in seen.iter().skip(outline.len()).rev() {
            self.triangles.swap_remove(gone);
        }
        true
    }

    fn forget_inner_points(&mut self) {
        const NONE: u32 = u32::MAX;
        let mut numbers = vec![NONE; self.points.len()];
        let mut points = Vec::with_capacity(self.corner_count());
        for corner in self.triangles.iter_mut().flat_map(|triangle| &mut triangle.corners) {
            let number = &mut numbers[*corner as usize];
            if *number == NONE {
                *number = points.len() as u32;
                points.push(self.points[*corner as usize]);
            }
            *corner = *number;
        }
        self.points = points;
    }

    /// Keeps only the points that are farthest in one of the [`directions`], and removes all triangles.
    fn thin_out(&mut self) {
        if !self.is_flat() {
            self.forget_inner_points();
        }
        self.triangles.clear();
        let (mut farthest, mut reach) = (Vec::with_capacity(DIRECTIONS), Vec::with_capacity(DIRECTIONS));
        for direction in directions() {
            let of = |at: usize| direction.dot(self.points[at]);
            let best = (0..self.points.len()).reduce(|best, at| if of(at) > of(best) { at } else { best });
            farthest.extend(best);
            reach.extend(best.map(of));
        }
        farthest.sort_unstable();
        farthest.dedup();
        self.points = farthest.iter().map(|&at| self.points[at]).collect();
        self.reach = Some(reach);
    }
}

/// Distance between a point's projection onto a triangle's plane and the triangle; 0 if the projection lies in the
/// triangle.
fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let edges = [0, 1, 2].map(|i| (corners[i], corners[(i + 1) % 3] - corners[i]));
    if edges.iter().all(|(start, edge)| edge.cross(point - start).dot(normal) >= 0.0) {
        return 0.0;
    }
    let to_edge = |(start, edge): (DVec3, DVec3)| {
        let along = (edge.dot(point - start) / edge.length_squared()).clamp(0.0, 1.0);
        point.distance(start + edge * along)
    };
    edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
}

/// Directions distributed uniformly on the sphere, by the sunflower (Fibonacci) pattern.
fn directions() -> &'static [DVec3] {
    static EVEN: std::sync::LazyLock<Vec<DVec3>> = std::sync::LazyLock::new(|| {
        let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..DIRECTIONS)
            .map(|i| {
                let z = 1.0 - (2 * i + 1) as f64 / DIRECTIONS as f64;
                let (sin, cos) = libm::sincos(golden_angle * i as f64);
                let ring = (1.0 - z * z).sqrt();
                DVec3::new(ring * cos, ring * sin, z)
            })
            .collect()
    });
    &EVEN
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use glam::UVec3;
    use proptest::{prelude::*, strategy::Union};

    use super::*;

    const TOLERANCE_M: f64 = 1.0e-6;

    fn hull_of(points: &[DVec3]) -> ConvexHull {
        let mut hull = ConvexHull::new(TOLERANCE_M);
        for &point in points {
            hull.insert(point);
        }
        hull
    }

    /// Checks that every edge belongs to two triangles with opposite directions of the edge, and that the surface is
    /// connected.
    fn assert_closed(hull: &ConvexHull) {
        let mut edges = BTreeSet::new();
        for triangle in &hull.triangles {
            let [a, b, c] = triangle.corners;
            for edge in [[a, b], [b, c], [c, a]] {
                assert!(edges.insert(edge), "{edge:?} twice in one direction");
            }
        }
        assert!(edges.iter().all(|&[a, b]| edges.contains(&[b, a])), "an edge of one triangle only");
        let corners: BTreeSet<u32> = hull.triangles.iter().flat_map(|triangle| triangle.corners).collect();
        assert_eq!(corners.len() + hull.triangles.len(), edges.len() / 2 + 2, "Euler's formula");
    }

    /// Largest distance of a point outside the hull, metres.
    fn farthest_outside_m(hull: &ConvexHull, points: &[DVec3]) -> f64 {
        let outside = |point: DVec3, triangle: &Triangle| {
            // The normal of a needle is numerical noise; its neighbours contain the point.
            let [a, b, c] = hull.corners(triangle);
            let is_needle =
                (b - a).cross(c - a).length() < 1.0e-6 * (b - a).length().max((c - a).length()).powi(2);
            if is_needle || hull.side_of(triangle.corners, point) <= 0.0 {
                return 0.0;
            }
            triangle.normal.dot(point - a)
        };
        points
            .iter()
            .flat_map(|&point| hull.triangles.iter().map(move |triangle| outside(point, triangle)))
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_cube_of_a_grid_has_twelve_triangles_worth_of_surface() {
        // All points except the corners lie on edges, on faces or inside. All points occur twice.
        let points: Vec<DVec3> = (0..2 * 125)
            .map(|i| DVec3::new(f64::from(i % 5), f64::from(i / 5 % 5), f64::from(i / 25 % 5)) * 0.25)
            .collect();
        let hull = hull_of(&points);
        assert_closed(&hull);
        let doubled: f64 = hull.triangles().map(|[a, b, c]| (b - a).cross(c - a).length()).sum();
        let sixfold: f64 = hull.triangles().map(|[a, b, c]| a.dot(b.cross(c))).sum();
        assert!((doubled - 12.0).abs() < 1.0e-12 && (sixfold - 6.0).abs() < 1.0e-12, "{doubled}, {sixfold}");
        assert_eq!(farthest_outside_m(&hull, &points), 0.0);
    }

    #[test]
    fn points_of_a_plane_a_line_and_a_place_have_no_hull_yet() {
        let mut hull = ConvexHull::new(TOLERANCE_M);
        let flat = |i: u32| DVec3::new(f64::from(i % 7), f64::from(i / 7), 0.0);
        let line = (0..20).map(|i| flat(0) + DVec3::X * f64::from(i) * 0.1);
        for point in [flat(0), flat(0)].into_iter().chain(line).chain((0..5000).map(flat)) {
            assert!(!hull.insert(point) && hull.is_flat());
        }
        assert!(hull.points.len() <= MAX_CORNERS, "{} points wait", hull.points.len());
        assert!(!hull.insert(DVec3::Z * 0.5e-6), "within the tolerance");
        assert!(hull.insert(DVec3::Z));
        assert_closed(&hull);
    }

    #[test]
    fn a_hull_of_very_many_points_stays_small_and_true() {
        // A ball that grows: every point lies outside the hull of the earlier points.
        let points: Vec<DVec3> = (0..5_000)
            .map(|i| directions()[i * 277 % DIRECTIONS] * (1.0 + i as f64 * 4.0e-5))
            .chain((0..5_000).map(|i| {
                let (sin, cos) = libm::sincos(f64::from(i) * 1.0e-3);
                DVec3::new(cos, sin, 0.01 * sin) * 1.3
            }))
            .collect();
        let hull = hull_of(&points);
        assert_closed(&hull);
        assert!(hull.corner_count() <= MAX_CORNERS && hull.points.len() <= 2 * MAX_CORNERS + 65);
        let outside_m = farthest_outside_m(&hull, &points[4_000..5_000]);
        assert!(outside_m < 0.02, "{outside_m} m");
    }

    #[test]
    fn smooth_normals_of_a_ball_point_outwards() {
        let hull = hull_of(directions());
        for (corners, normals) in hull.triangles().zip(hull.smooth_normals()) {
            for (corner, normal) in corners.iter().zip(normals) {
                assert!(corner.dot(normal.normalize()) > 0.995, "{corner}, {normal}");
            }
        }
    }

    fn points() -> impl Strategy<Value = Vec<DVec3>> {
        let within =
            |x: f64, y: f64, z: f64| (-x..x, -y..y, -z..z).prop_map(|(x, y, z)| DVec3::new(x, y, z)).boxed();
        let grid = (0..4_u32, 0..4_u32, 0..3_u32).prop_map(|p| UVec3::from(p).as_dvec3() * 0.1).boxed();
        let far_away = within(1.0, 1.0, 1.0).prop_map(|p| p + DVec3::X * 1000.0).boxed();
        let kinds = [grid, within(1.0, 1.0, 1.0), within(1.0, 1.0, 3.0e-6), far_away];
        let mixed = Union::new(kinds.iter().cloned().chain([within(1.0e15, 1.0e15, 1.0e15)])).boxed();
        let lists = kinds.into_iter().chain([mixed]).map(|point| proptest::collection::vec(point, 1..80));
        Union::new(lists)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn every_hull_is_closed_and_holds_its_points(points in points()) {
            let mut hull = ConvexHull::new(TOLERANCE_M);
            for &point in &points {
                let before: Vec<[u32; 3]> = hull.triangles.iter().map(|triangle| triangle.corners).collect();
                let is_outside = hull.has_outside(point);
                let is_changed = hull.insert(point);
                prop_assert!(is_outside || !is_changed);
                if !is_changed {
                    let after: Vec<[u32; 3]> = hull.triangles.iter().map(|triangle| triangle.corners).collect();
                    prop_assert_eq!(before, after);
                }
            }
            if !hull.is_flat() {
                assert_closed(&hull);
                let reach = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
                let outside_m = farthest_outside_m(&hull, &points);
                prop_assert!(outside_m <= 1.1 * TOLERANCE_M.max(PRECISION * reach), "{} m outside", outside_m);
            }
        }
    }
}
