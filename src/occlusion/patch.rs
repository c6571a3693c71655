use glam::{DVec2, DVec3, Vec3};

use super::{MAX_SIDES, ShadowVolume, hull::Hull};
use crate::{
    polygon::{ConvexPolygon, Geometry, PolygonId},
    view::ViewWindow,
};

/// Largest number of polygons of a patch. With a larger number, smooth strokes and fine meshes give fewer and larger
/// occluders, and each takes more work.
pub(super) const MAX_PATCH: usize = 24;

/// Largest number of corners of a border.
const MAX_BORDER: usize = 2 * MAX_PATCH + 4;

/// Largest number of corners inside the border. Each of them was on the border of a smaller patch.
const MAX_INNER: usize = MAX_PATCH;

/// A polygon joins a patch if the area that the patch hides along its normal grows by at least this fraction of the
/// polygon's area. With a larger value, patches are smaller and flatter.
const WORTH_JOINING: f32 = 0.7;

/// A polygon in the patch's plane (to a cosine of [`FLAT_COSINE`]) may join even if [`WORTH_JOINING`] excludes it. The
/// patch must hide at least this fraction of its own area. The fraction is less than 1, because a row of a grid adds
/// nothing until it is full.
const WORTH_WAITING: f32 = 0.5;

/// Two patches are merged if the area that they hide together is at least this fraction of the sum of their
/// hidden areas.
const WORTH_MERGING: f32 = 0.9;

/// See [`WORTH_WAITING`].
const FLAT_COSINE: f32 = 0.9999;

/// A list of points with room for `N`.
#[derive(Clone, Copy, Debug)]
struct Points<const N: usize> {
    len: u8,
    points: [Vec3; N],
}

impl<const N: usize> Points<N> {
    const EMPTY: Self = Self { len: 0, points: [Vec3::ZERO; N] };

    /// Appends a point; returns `false` if there is no room.
    #[must_use]
    fn push(&mut self, p: Vec3) -> bool {
        let has_room = usize::from(self.len) < N;
        if has_room {
            self.points[usize::from(self.len)] = p;
            self.len += 1;
        }
        has_room
    }

    fn points(&self) -> &[Vec3] {
        &self.points[..usize::from(self.len)]
    }

    fn len(&self) -> usize {
        usize::from(self.len)
    }

    /// The point number `i`, below twice the number of points; numbers wrap around.
    fn around(&self, i: usize) -> Vec3 {
        let len = self.len();
        self.points[if i < len { i } else { i - len }]
    }
}

/// Polygons that share edges bit for bit, as one virtual occluder.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    ids: [PolygonId; MAX_PATCH],
    len: u8,
    /// The line around the patch, in the direction of the first polygon. It is the sum of all outlines.
    border: Points<MAX_BORDER>,
    /// Corners inside the border.
    inner: Points<MAX_INNER>,
    /// Sum over the polygons, turned the same way round, of area times normal, m^2.
    area_vector: Vec3,
    /// Area that the patch hides along `area_vector`, m^2.
    area_m2: f32,
}

impl Patch {
    /// A patch of one polygon.
    pub(super) fn new(id: PolygonId, polygon: &ConvexPolygon) -> Self {
        let mut border = Points::EMPTY;
        border.points[..polygon.vertices().len()].copy_from_slice(polygon.vertices());
        border.len = polygon.vertices().len() as u8;
        let area_vector = polygon.area_vector() * 0.5;
        let mut ids = [PolygonId(0); MAX_PATCH];
        ids[0] = id;
        Self { ids, len: 1, border, inner: Points::EMPTY, area_vector, area_m2: area_vector.length() }
    }

    /// The polygons, in the order in which they joined.
    pub(super) fn ids(&self) -> &[PolygonId] {
        &self.ids[..usize::from(self.len)]
    }

    /// Area that the patch hides along its normal, m^2.
    pub(super) fn area_m2(&self) -> f32 {
        self.area_m2
    }

    /// The normal of the patch, pointing to either side, with the hidden area as its length, m^2.
    pub(super) fn area_vector(&self) -> Vec3 {
        self.area_vector.normalize_or_zero() * self.area_m2
    }

    /// All corners of the patch; a corner may occur twice.
    pub(super) fn points(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.border.points().iter().chain(self.inner.points()).copied()
    }

    /// The patch with one more polygon. `None` if the polygon shares no edge with the border, the patch is full, or its
    /// hidden area grows too little ([`WORTH_JOINING`]).
    pub(super) fn joined(&self, id: PolygonId, polygon: &ConvexPolygon) -> Option<Self> {
        if usize::from(self.len) == MAX_PATCH {
            return None;
        }
        let mut corners = [Vec3::ZERO; 4];
        let len = polygon.vertices().len();
        corners[..len].copy_from_slice(polygon.vertices());
        let corners = &mut corners[..len];
        let (at, entry, turned) = self.shared_edge(corners)?;
        if turned {
            corners.reverse();
        }
        let mut patch = self.spliced(at, corners, entry)?;
        patch.ids[usize::from(self.len)] = id;
        patch.len += 1;
        let area_vector = polygon.area_vector() * if turned { -0.5 } else { 0.5 };
        patch.area_vector += area_vector;
        patch.area_m2 = patch.hull_along_normal().area() as f32;
        let (gain, own) = (patch.area_m2 - self.area_m2, area_vector.length());
        let is_flat = area_vector.dot(self.area_vector) >= FLAT_COSINE * own * self.area_vector.length();
        let pays = gain >= WORTH_JOINING * own;
        let may_pay = is_flat
            && gain >= -1.0e-3 * self.area_m2
            && patch.area_m2 >= WORTH_WAITING * patch.area_vector.length();
        (pays || may_pay).then_some(patch)
    }

    /// This patch and `other` as one patch. `polygon`, which belongs to this patch, must share an edge with `other`, and
    /// together the patches must hide nearly as much as both alone. Otherwise `None`.
    pub(super) fn merged(&self, other: &Self, polygon: &ConvexPolygon) -> Option<Self> {
        if usize::from(self.len + other.len) > MAX_PATCH {
            return None;
        }
        let mut corners = [Vec3::ZERO; 4];
        let len = polygon.vertices().len();
        corners[..len].copy_from_slice(polygon.vertices());
        let (at, ..) = other.shared_edge(&corners[..len])?;
        let edge = [other.border.around(at), other.border.around(at + 1)];
        let (at, entry, turned) = self.shared_edge_with(edge, at)?;
        let mut border = other.border;
        if turned {
            border.points[..other.border.len()].reverse();
        }
        let entry = if turned { (2 * border.len() - 2 - entry) % border.len() } else { entry };
        let mut patch = self.spliced(at, border.points(), entry)?;
        for &p in other.inner.points() {
            if !patch.inner.push(p) {
                return None;
            }
        }
        let len = usize::from(self.len);
        patch.ids[len..len + usize::from(other.len)].copy_from_slice(other.ids());
        patch.len += other.len;
        patch.area_vector += if turned { -other.area_vector } else { other.area_vector };
        patch.area_m2 = patch.hull_along_normal().area() as f32;
        (patch.area_m2 >= WORTH_MERGING * (self.area_m2 + other.area_m2)).then_some(patch)
    }

    /// Finds an edge of another border, `p` to `q` with number `entry`, on this border. Returns its position here, `entry`,
    /// and whether both borders pass the edge in the same direction.
    fn shared_edge_with(&self, [p, q]: [Vec3; 2], entry: usize) -> Option<(usize, usize, bool)> {
        (0..self.border.len()).find_map(|i| {
            let (a, b) = (self.border.points[i], self.border.around(i + 1));
            ((a == q && b == p) || (a == p && b == q)).then_some((i, entry, a == p))
        })
    }

    /// Finds an edge that the border and a polygon share. Returns the number of the edge's first corner on the border
    /// and on the polygon, and whether the polygon has to be reversed. Neighbours that turn the same way pass their
    /// edge in opposite directions.
    fn shared_edge(&self, corners: &[Vec3]) -> Option<(usize, usize, bool)> {
        let n = corners.len();
        let border = self.border.points();
        // The newest edges are searched first, because strokes continue at their end.
        for i in (0..border.len()).rev() {
            let (p, q) = (border[i], self.border.around(i + 1));
            for k in 0..n {
                let (a, b) = (corners[k], corners[(k + 1) % n]);
                if a == q && b == p {
                    return Some((i, k, false));
                }
                if a == p && b == q {
                    // In the reversed polygon, the edge begins at corner b, number n - 1 - (k + 1).
                    return Some((i, (2 * n - 2 - k) % n, true));
                }
            }
        }
        None
    }

    /// The patch extended by a polygon beyond border edge `at`. The polygon's edge `entry` is the same edge in the opposite
    /// direction. `None` if there is no room.
    fn spliced(&self, at: usize, corners: &[Vec3], entry: usize) -> Option<Self> {
        let n = corners.len();
        let mut patch = *self;
        let mut border = Points::EMPTY;
        let mut has_room = true;
        // The new border goes from the edge's end all the way to its beginning, then along the polygon's other corners.
        for i in 0..self.border.len() {
            has_room &= border.push(self.border.around(at + 1 + i));
        }
        for i in 2..n {
            has_room &= border.push(corners[(entry + i) % n]);
        }
        // If the polygon shares more edges, the border goes along them and straight back. Each such spur is removed.
        while border.len() > 2 {
            let len = border.len();
            let spur = (0..len).find(|&i| border.around(i + len - 1) == border.around(i + 1));
            let Some(tip) = spur else { break };
            has_room &= patch.inner.push(border.points[tip]);
            // The tip and one of its two equal neighbours are removed.
            let mut kept = Points::EMPTY;
            for i in 0..len {
                if i != tip && i != (tip + 1) % len {
                    has_room &= kept.push(border.points[i]);
                }
            }
            border = kept;
        }
        patch.border = border;
        (has_room && border.len() >= 3).then_some(patch)
    }

    /// A convex polygon inside the projection of the patch. `project` maps a corner to two dimensions, in which the border
    /// must run counterclockwise.
    fn hull(&self, project: impl Fn(Vec3) -> DVec2) -> Hull {
        let mut border = [DVec2::ZERO; MAX_BORDER];
        for (to, p) in border.iter_mut().zip(self.border.points()) {
            *to = project(*p);
        }
        Hull::inside(&border[..self.border.len()])
    }

    /// The hull of the patch's projection along its normal.
    fn hull_along_normal(&self) -> Hull {
        let normal = self.area_vector.as_dvec3().normalize_or(DVec3::Z);
        let x = normal.any_orthonormal_vector();
        let y = normal.cross(x);
        self.hull(|p| DVec2::new(x.dot(p.as_dvec3()), y.dot(p.as_dvec3())))
    }

    /// Appends the patch's shadow for an eye: a convex outline inside its picture, with the cap behind its farthest corner.
    /// If the patch has no such shadow, because it reaches back to the near plane or folds, appends the shadows of its
    /// polygons.
    pub(super) fn push_shadows(
        &self,
        geometry: &dyn Geometry,
        window: &ViewWindow,
        out: &mut Vec<ShadowVolume>,
    ) {
        match if self.len == 1 { None } else { self.shadow(window) } {
            Some(shadow) => out.push(shadow),
            None => {
                for polygon in self.ids().iter().filter_map(|&id| geometry.occluder(id)) {
                    ShadowVolume::push_polygon(polygon.vertices(), window, out);
                }
            }
        }
    }

    /// The shadow of the patch as a whole; `None` if the patch has no convex outline from the eye.
    pub(super) fn shadow(&self, window: &ViewWindow) -> Option<ShadowVolume> {
        shadow_of_points(self.border.points(), self.inner.points(), self.area_vector, window)
    }
}

/// Largest number of corners of the border of a patch.
const MOST_CORNERS: usize = 96;

/// The common shadow of polygons that share edges bit for bit; `None` if they have no convex outline from the eye. `border`
/// is the line around them, `inner` their other corners.
fn shadow_of_points(
    border: &[Vec3],
    inner: &[Vec3],
    area_vector: Vec3,
    window: &ViewWindow,
) -> Option<ShadowVolume> {
    let (mut count, mut middle) = (0.0, DVec3::ZERO);
    let points = || border.iter().chain(inner);
    for p in points() {
        let v = window.from_eye(*p);
        // If the near plane cuts a polygon, the patch is left out as a whole.
        if window.forward().dot(v) <= window.near_m() {
            return None;
        }
        count += 1.0;
        middle += v;
    }
    let ahead = (middle / count).try_normalize()?;
    let mut cap_normal = area_vector.as_dvec3().try_normalize()?;
    let away = cap_normal.dot(ahead);
    if away < 0.0 {
        cap_normal = -cap_normal;
    }
    let mut cap_distance_m = 0.0f64;
    for p in points() {
        let v = window.from_eye(*p);
        // The picture is projected along `ahead`. A corner beside or behind the eye has no position in it.
        if ahead.dot(v) <= 0.1 * v.length() {
            return None;
        }
        cap_distance_m = cap_distance_m.max(cap_normal.dot(v));
    }
    let x = ahead.any_orthonormal_vector();
    let y = ahead.cross(x);
    // If the normal points at the eye, the border turns the other way, so the picture is mirrored.
    let x = if away > 0.0 { x } else { -x };
    let mut picture = [DVec2::ZERO; MOST_CORNERS];
    for (to, p) in picture.iter_mut().zip(border) {
        let v = window.from_eye(*p);
        *to = DVec2::new(x.dot(v), y.dot(v)) / ahead.dot(v);
    }
    let hull = Hull::inside(picture.get(..border.len())?);
    shadow_of_hull(&hull, [ahead, x, y], cap_normal, cap_distance_m)
}

/// The shadow of a hull in the picture that `ahead`, `x` and `y` span. The cap has the normal `cap_normal` and the distance
/// `cap_distance_m`.
pub(super) fn shadow_of_hull(
    hull: &Hull,
    [ahead, x, y]: [DVec3; 3],
    cap_normal: DVec3,
    cap_distance_m: f64,
) -> Option<ShadowVolume> {
    let mut outline = [DVec3::ZERO; MAX_SIDES];
    let len = hull.corners().len();
    for (to, corner) in outline.iter_mut().zip(hull.corners()) {
        let direction = ahead + x * corner.x + y * corner.y;
        let along = cap_normal.dot(direction);
        // The cap has to lie in front of the eye in every direction.
        if along <= 1.0e-3 * direction.length() {
            return None;
        }
        *to = direction * (cap_distance_m / along);
    }
    ShadowVolume::of_outline(outline.get(..len)?, cap_normal).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(columns: usize, rows: usize) -> Vec<ConvexPolygon> {
        let at = |x: usize, y: usize| Vec3::new(x as f32 * 0.3, y as f32 * 0.7, 2.0);
        let mut polygons = Vec::new();
        for y in 0..rows {
            for x in 0..columns {
                polygons.push(ConvexPolygon::quad([at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]));
            }
        }
        polygons
    }

    /// Joins polygons as the pool does: each row by itself, then with the rows before it.
    fn patch_of(polygons: &[ConvexPolygon], columns: usize) -> Option<Patch> {
        let mut whole: Option<Patch> = None;
        for (y, row) in polygons.chunks(columns).enumerate() {
            let id = |x: usize| PolygonId((y * columns + x) as u32);
            let mut patch = Patch::new(id(0), &row[0]);
            for (x, polygon) in row.iter().enumerate().skip(1) {
                patch = patch.joined(id(x), polygon)?;
            }
            whole = Some(match &whole {
                Some(before) => patch.merged(before, &row[columns - 1])?,
                None => patch,
            });
        }
        whole
    }

    #[test]
    fn a_grid_grows_row_by_row_and_forgets_no_corner() {
        let patch = patch_of(&grid(4, 3), 4).expect("all of it joins");
        assert_eq!(patch.ids().len(), 12);
        assert_eq!(patch.border.len(), 14, "each corner on the rim once");
        assert_eq!(patch.inner.len(), 6, "each corner inside once");
        assert!((patch.area_m2 - 4.0 * 0.3 * 3.0 * 0.7).abs() < 1.0e-5, "{}", patch.area_m2);
    }

    #[test]
    fn polygons_wound_the_other_way_are_turned() {
        let mut polygons = grid(5, 2);
        for polygon in polygons.iter_mut().skip(1).step_by(2) {
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| polygon.vertices()[i]);
            *polygon = ConvexPolygon::quad([c, b, a, d]);
        }
        let patch = patch_of(&polygons, 5).expect("all of it joins");
        assert!((patch.area_m2 - 5.0 * 0.3 * 2.0 * 0.7).abs() < 1.0e-5, "{}", patch.area_m2);
    }

    #[test]
    fn what_shares_no_edge_or_stands_across_does_not_join() {
        let polygons = grid(3, 1);
        let patch = Patch::new(PolygonId(0), &polygons[0]);
        assert!(patch.joined(PolygonId(2), &polygons[2]).is_none());
        let [_, b, c, _] = [0, 1, 2, 3].map(|i| polygons[0].vertices()[i]);
        let across = ConvexPolygon::quad([b, c, c + Vec3::Z * 0.3, b + Vec3::Z * 0.3]);
        assert!(patch.joined(PolygonId(1), &across).is_none());
        // The same polygon must not join twice, because the border would vanish.
        assert!(patch.joined(PolygonId(1), &polygons[0]).is_none());
    }
}
