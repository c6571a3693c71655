use glam::{DMat3, DVec3, Mat3, Vec3};

use super::Aabb;

/// Half sides are enlarged by this fraction of the longest half side, because axes in `f32` are only approximately unit
/// vectors and perpendicular.
const GROWTH: f64 = 1.0e-6;

/// Number of sweeps of the Jacobi method. Five or six are enough for a 3 x 3 matrix.
const SWEEPS: usize = 12;

/// An oriented box, world space, metres: all points `center + x * axis 0 + y * axis 1 + z * axis 2` with `|x|`, `|y|`,
/// `|z|` at most the half sides.
///
/// Stefan Gottschalk, Ming Lin and Dinesh Manocha, "OBBTree: A Hierarchical Structure for Rapid Interference Detection"
/// (1996): the box is fitted along the principal axes of its points, and intersected by separating axes. Unlike in the
/// paper, the axes are the principal axes of the points, not of their convex hull. An axis-aligned box with less
/// surface replaces the fitted box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obb {
    center: Vec3,
    /// Unit vectors, as columns.
    axes: Mat3,
    half: Vec3,
}

impl Obb {
    /// A box around some points, fitted along their principal axes. `None` if there is no point, or a point is not finite.
    pub fn from_points(points: &[Vec3]) -> Option<Self> {
        let bounds = Aabb::from_points(points);
        if !bounds.is_valid() || points.iter().any(|p| !p.is_finite()) {
            return None;
        }
        let count = points.len() as f64;
        let mean = points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / count;
        let mut spread = DMat3::ZERO;
        for p in points {
            let v = p.as_dvec3() - mean;
            spread += DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        }
        let fitted = Self::along(principal_axes(spread).as_mat3(), points);
        let aligned = Self::along(Mat3::IDENTITY, points);
        Some(if fitted.surface() < aligned.surface() { fitted } else { aligned })
    }

    /// The same box as an oriented box with the world's axes.
    pub fn from_aabb(bounds: &Aabb) -> Self {
        Self::along(Mat3::IDENTITY, &[bounds.min, bounds.max])
    }

    /// The smallest box around the points with these axes.
    fn along(axes: Mat3, points: &[Vec3]) -> Self {
        let turned = axes.as_dmat3().transpose();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in points {
            let p = turned * p.as_dvec3();
            (low, high) = (low.min(p), high.max(p));
        }
        let center = (axes.as_dmat3() * (low * 0.5 + high * 0.5)).as_vec3();
        // The extents are measured from the rounded centre.
        let reach = |far: DVec3, p: &Vec3| far.max((turned * (p.as_dvec3() - center.as_dvec3())).abs());
        let half = points.iter().fold(DVec3::ZERO, reach);
        let half = (half + DVec3::splat(half.max_element() * GROWTH)).as_vec3();
        Self { center, axes, half }
    }

    /// Centre, world space.
    pub fn center(&self) -> Vec3 {
        self.center
    }

    /// The directions of the sides, of unit length.
    pub fn axes(&self) -> [Vec3; 3] {
        [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis]
    }

    /// Half the length of each side, metres.
    pub fn half_sides_m(&self) -> Vec3 {
        self.half
    }

    /// The eight corners. Bits 0, 1, 2 of a corner's position select the positive end of axis 0, 1, 2.
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            self.center + self.axes * (self.half * Vec3::new(sign(0), sign(1), sign(2)))
        })
    }

    /// An eighth of the surface area. It is computed in `f64`, because squares of large sides overflow `f32`.
    fn surface(&self) -> f64 {
        let half = self.half.as_dvec3();
        half.x * half.y + half.y * half.z + half.z * half.x
    }

    /// Whether a point lies in the box, up to rounding.
    pub fn contains(&self, p: Vec3) -> bool {
        let along = self.axes.as_dmat3().transpose() * (p.as_dvec3() - self.center.as_dvec3());
        let half = self.half.as_dvec3();
        along.abs().cmple(half + DVec3::splat(half.max_element() * GROWTH)).all()
    }

    /// Whether two boxes share a point; touching counts. Two boxes are separate if one of fifteen directions separates
    /// them: the axes of both, and the cross products of these axes. Boxes that share a point are never reported as
    /// separate.
    pub fn intersects(&self, other: &Self) -> bool {
        let apart = other.center.as_dvec3() - self.center.as_dvec3();
        let (mine, others) = (self.axes().map(|a| a.as_dvec3()), other.axes().map(|a| a.as_dvec3()));
        let separates = |direction: DVec3| {
            let reach = self.reach(direction) + other.reach(direction);
            // The cross product of two parallel axes is nearly zero, so all these numbers are nearly zero, too.
            let rounding = 1.0e-12 * (apart.length() + self.size() + other.size());
            apart.dot(direction).abs() > reach + rounding
        };
        let crossed = mine.iter().flat_map(|a| others.iter().map(|b| a.cross(*b)));
        !mine.iter().chain(&others).copied().chain(crossed).any(separates)
    }

    /// Does the test of [`Obb::intersects`] with an axis-aligned box.
    pub fn intersects_aabb(&self, other: &Aabb) -> bool {
        self.intersects(&Self::from_aabb(other))
    }

    /// Largest extent of the box from its centre along a direction, times the direction's length.
    fn reach(&self, direction: DVec3) -> f64 {
        let [a, b, c] = self.axes().map(|axis| axis.as_dvec3().dot(direction).abs());
        let half = self.half.as_dvec3();
        half.x * a + half.y * b + half.z * c
    }

    fn size(&self) -> f64 {
        self.half.as_dvec3().element_sum()
    }
}

/// The eigenvectors of a symmetric matrix, as columns, by Carl Jacobi's method (1846).
fn principal_axes(mut spread: DMat3) -> DMat3 {
    let mut axes = DMat3::IDENTITY;
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = spread.col(q)[p];
            let scale = spread.col(p)[p].abs() + spread.col(q)[q].abs();
            if off.abs() <= f64::EPSILON * scale {
                continue;
            }
            let theta = (spread.col(q)[q] - spread.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cos = 1.0 / (t * t + 1.0).sqrt();
            let sin = t * cos;
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = cos;
            turn.col_mut(q)[q] = cos;
            turn.col_mut(q)[p] = sin;
            turn.col_mut(p)[q] = -sin;
            spread = turn.transpose() * spread * turn;
            axes *= turn;
        }
    }
    axes
}
