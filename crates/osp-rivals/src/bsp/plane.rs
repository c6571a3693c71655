use glam::{DVec3, Vec3};

/// A point counts as in a plane if its distance from the plane is less than this fraction of its largest coordinate.
/// The fraction is twice the displacement of a cut point by rounding to `f32`. A larger fraction cuts fewer polygons
/// that hardly pierce each other.
const ROUNDING: f64 = 1.0 / (1u64 << 22) as f64;

/// A polygon has no plane if it is bent by more than this fraction of its longest edge: twice
/// [`osp::polygon::FLATNESS`].
const MAX_BEND: f64 = 2.0 * osp::polygon::FLATNESS as f64;

/// A polygon has no plane if its area is less than this fraction of its longest edge squared.
const MIN_AREA: f64 = 1.0e-9;

/// Largest number of corners of a piece; a piece with more is not cut further. Every cut adds at most one corner to a
/// convex piece.
pub(super) const MAX_CORNERS: usize = 64;

/// The plane of a node, with a tolerance for its polygon's deviation from flat.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplitPlane {
    normal: DVec3,
    d: f64,
    /// Distance from the plane, metres, below which a point lies in it.
    thickness: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    On,
    Front,
    Back,
    Both,
}

fn largest_coordinate(p: Vec3) -> f64 {
    f64::from(p.abs().max_element())
}

impl SplitPlane {
    /// Stands for no plane.
    pub(super) const NONE: Self = Self { normal: DVec3::ZERO, d: 0.0, thickness: 0.0 };

    /// The plane of a polygon; `None` if the polygon has no area or is bent.
    pub(super) fn of(corners: &[Vec3]) -> Option<Self> {
        let (normal, count) = match *corners {
            [a, b, c] => ((b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3()), 3.0),
            [a, b, c, d] => ((c.as_dvec3() - a.as_dvec3()).cross(d.as_dvec3() - b.as_dvec3()), 4.0),
            _ => return None,
        };
        let longest = (0..corners.len())
            .map(|i| corners[i].as_dvec3().distance(corners[(i + 1) % corners.len()].as_dvec3()))
            .fold(0.0, f64::max);
        let area = normal.length();
        // A polygon whose area is NaN has no plane, either.
        if !(area > MIN_AREA * longest * longest && area.is_finite()) {
            return None;
        }
        let normal = normal / area;
        let center = corners.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / count;
        let d = -normal.dot(center);
        let bend = corners.iter().map(|p| (normal.dot(p.as_dvec3()) + d).abs()).fold(0.0, f64::max);
        let reach = corners.iter().map(|&p| largest_coordinate(p)).fold(0.0, f64::max);
        let is_flat = bend <= MAX_BEND * longest + ROUNDING * reach;
        is_flat.then_some(Self { normal, d, thickness: bend + ROUNDING * reach })
    }

    /// The plane perpendicular to an axis at this coordinate.
    pub(super) fn across(axis: usize, at: f32) -> Self {
        let mut normal = DVec3::ZERO;
        normal[axis] = 1.0;
        Self { normal, d: -f64::from(at), thickness: 0.0 }
    }

    /// Whether this stands for no plane.
    pub(super) fn is_none(&self) -> bool {
        self.normal == DVec3::ZERO
    }

    /// Signed distance of a point in front of the plane, metres.
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        self.normal.dot(p.as_dvec3()) + self.d
    }

    /// Signed distance of a point in front of the plane, metres.
    pub(super) fn distance_of(&self, p: DVec3) -> f64 {
        self.normal.dot(p) + self.d
    }

    /// A square in the plane around the point nearest to `center`, at least `reach` metres to each side.
    pub(super) fn square(&self, center: DVec3, reach: f64) -> Vec<DVec3> {
        let middle = center - self.normal * self.distance_of(center);
        let right = self.normal.any_orthonormal_vector();
        let up = self.normal.cross(right);
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| middle + (right * x + up * y) * (reach * 1.5))
            .to_vec()
    }

    /// Distance, metres, up to which a point counts as in the plane.
    fn tolerance(&self, p: Vec3) -> f64 {
        self.thickness + ROUNDING * largest_coordinate(p)
    }

    /// The side on which a polygon lies.
    pub(super) fn side(&self, corners: &[Vec3]) -> Side {
        let (mut front, mut back) = (false, false);
        for &p in corners {
            let (distance, near) = (self.distance(p), self.tolerance(p));
            front |= distance > near;
            back |= distance < -near;
        }
        match (front, back) {
            (false, false) => Side::On,
            (true, false) => Side::Front,
            (false, true) => Side::Back,
            (true, true) => Side::Both,
        }
    }

    /// The side on which a polygon reaches farther.
    pub(super) fn larger_side(&self, corners: &[Vec3]) -> Side {
        let far = corners
            .iter()
            .map(|&p| self.distance(p))
            .fold((0.0f64, 0.0f64), |(low, high), distance| (low.min(distance), high.max(distance)));
        if far.1 >= -far.0 { Side::Front } else { Side::Back }
    }

    /// Cuts a polygon that lies on both sides. [`split_convex`](osp::math::split_convex) cannot do this, because this plane
    /// has a thickness, and a corner within the thickness belongs to both parts.
    pub(super) fn cut(&self, corners: &[Vec3], front: &mut Vec<Vec3>, back: &mut Vec<Vec3>) {
        front.clear();
        back.clear();
        let Some(&last) = corners.last() else { return };
        let mut from = last;
        let mut from_distance = self.distance(from);
        for &to in corners {
            let to_distance = self.distance(to);
            let is_front = |p: Vec3, distance: f64| distance > self.tolerance(p);
            let is_back = |p: Vec3, distance: f64| distance < -self.tolerance(p);
            let leaves_front = is_front(from, from_distance) && is_back(to, to_distance);
            let leaves_back = is_back(from, from_distance) && is_front(to, to_distance);
            if leaves_front || leaves_back {
                // The two distances differ in sign, so the divisor is not zero.
                let t = from_distance / (from_distance - to_distance);
                let at = (from.as_dvec3() + (to.as_dvec3() - from.as_dvec3()) * t).as_vec3();
                front.push(at);
                back.push(at);
            }
            if !is_back(to, to_distance) {
                front.push(to);
            }
            if !is_front(to, to_distance) {
                back.push(to);
            }
            (from, from_distance) = (to, to_distance);
        }
    }
}
