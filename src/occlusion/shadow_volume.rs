use glam::{DVec3, Vec3};
use thiserror::Error;

use super::{EDGE_ON_SINE, END_ON_SINE, cone};
use crate::{
    index::simd::{Backend, Kernel, WithKernel},
    math::{Part, clip_convex, split_convex, triangle_solid_angle_sr},
    view::ViewWindow,
};

/// Largest number of sides of a shadow volume. A polygon may have one corner less, because the near plane can add one.
pub const MAX_SIDES: usize = 8;

/// The reason why a polygon casts no usable shadow from this eye. It is then no occluder, which is always safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NotAnOccluder {
    /// The polygon has fewer than 3 corners, or at least [`MAX_SIDES`].
    #[error("expected 3 to 7 corners")]
    CornerCount,
    /// A corner is not finite.
    #[error("expected finite corners")]
    NotFinite,
    /// No part of the polygon lies beyond the near plane.
    #[error("expected a part beyond the near plane")]
    TooNear,
    /// The polygon has no area, or the eye lies (almost) in its plane.
    #[error("seen edge-on, or without area")]
    EdgeOn,
    /// An edge points at the eye, or a corner is a needle, so that the direction of a shadow plane would be random.
    #[error("an edge seen end-on, or a needle")]
    IllConditioned,
    /// The polygon's outline from the eye is not convex (a bent quad). Its triangles may cast shadows.
    #[error("not convex as seen from the eye")]
    NotConvex,
    /// The near plane cuts the polygon, and it has more than three corners. Such a polygon may be bent, at least by
    /// rounding. Then its border at the near plane depends on its division into triangles.
    #[error("cut by the near plane, and not a triangle")]
    CutByNear,
}

/// The shadow of one occluder, with the eye as the origin:
/// `{x : side[i] . x >= 0 for all i, and cap_normal . x >= cap_distance_m}`.
///
/// The cap is the occluder's own plane, pushed to the occluder's farthest corner. Without the cap, everything *between* the
/// eye and the occluder would count as hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowVolume {
    len: u8,
    corners: [DVec3; MAX_SIDES],
    sides: [DVec3; MAX_SIDES],
    cap_normal: DVec3,
    cap_distance_m: f64,
}

impl ShadowVolume {
    /// The shadow of a convex polygon, world space, in either orientation. The polygon may be slightly bent.
    ///
    /// The part in front of the window's near plane is not drawn, so it casts no shadow. The shadow is right for every fan
    /// of triangles in which the renderer may draw a polygon with more than three corners.
    ///
    /// # Errors
    /// See [`NotAnOccluder`].
    pub fn of_polygon(corners_in_world: &[Vec3], window: &ViewWindow) -> Result<Self, NotAnOccluder> {
        if corners_in_world.len() < 3 || corners_in_world.len() >= MAX_SIDES {
            return Err(NotAnOccluder::CornerCount);
        }
        let mut corners = [DVec3::ZERO; MAX_SIDES];
        for (corner, p) in corners.iter_mut().zip(corners_in_world) {
            *corner = window.from_eye(*p);
        }
        let (corners, len, is_cut) = clip_to_near(&corners[..corners_in_world.len()], window)?;
        if is_cut && corners_in_world.len() > 3 {
            return Err(NotAnOccluder::CutByNear);
        }
        let cap_normal = corners[1..len]
            .windows(2)
            .map(|w| (w[0] - corners[0]).cross(w[1] - corners[0]))
            .fold(DVec3::ZERO, |sum, v| sum + v);
        Self::of_outline(&corners[..len], cap_normal)
    }

    /// Appends the shadow of a convex polygon. If the polygon has none, appends the shadows of its triangles.
    pub fn push_polygon(corners_in_world: &[Vec3], window: &ViewWindow, out: &mut Vec<Self>) {
        match Self::of_polygon(corners_in_world, window) {
            Ok(volume) => out.push(volume),
            Err(NotAnOccluder::NotConvex | NotAnOccluder::CutByNear) => {
                for pair in corners_in_world[1..].windows(2) {
                    out.extend(Self::of_polygon(&[corners_in_world[0], pair[0], pair[1]], window));
                }
            }
            Err(_) => {}
        }
    }

    /// The shadow of an outline seen from the eye, in either orientation. The surface inside the outline must not reach
    /// beyond the plane that has the normal `cap_normal` and passes through the outline's farthest corner.
    pub(super) fn of_outline(outline: &[DVec3], cap_normal: DVec3) -> Result<Self, NotAnOccluder> {
        let len = outline.len();
        if !(3..=MAX_SIDES).contains(&len) {
            return Err(NotAnOccluder::CornerCount);
        }
        if !outline.iter().all(|v| v.is_finite()) {
            return Err(NotAnOccluder::NotFinite);
        }
        let Some(mut cap_normal) = cap_normal.try_normalize() else { return Err(NotAnOccluder::EdgeOn) };
        if cap_normal.dot(outline[0]) < 0.0 {
            cap_normal = -cap_normal;
        }
        let (nearest, cap_distance_m) = cone::reach(cap_normal, outline);
        let far = outline.iter().map(|v| v.length()).fold(0.0, f64::max);
        let faces_eye = nearest > EDGE_ON_SINE * far && far.is_finite();
        if !faces_eye {
            return Err(NotAnOccluder::EdgeOn);
        }
        let mut volume = Self {
            len: len as u8,
            corners: [DVec3::ZERO; MAX_SIDES],
            sides: [DVec3::ZERO; MAX_SIDES],
            cap_normal,
            cap_distance_m,
        };
        volume.corners[..len].copy_from_slice(outline);
        let middle = outline.iter().fold(DVec3::ZERO, |sum, v| sum + *v);
        let turns = (0..len).map(|i| outline[i].cross(outline[(i + 1) % len]).dot(middle)).sum::<f64>();
        if turns < 0.0 {
            volume.corners[..len].reverse();
        }
        volume.raise_sides()?;
        Ok(volume)
    }

    fn raise_sides(&mut self) -> Result<(), NotAnOccluder> {
        Backend::detect().run(RaiseSides(self))
    }

    /// Corners of the outline, with the eye as the origin; `corner[i] x corner[i + 1]` points inwards.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners[..usize::from(self.len)]
    }

    /// Unit normals of the shadow planes, pointing into the shadow; plane `i` contains the edge that begins at corner `i`.
    pub fn sides(&self) -> &[DVec3] {
        &self.sides[..usize::from(self.len)]
    }

    /// Unit normal of the cap, pointing away from the eye.
    pub fn cap_normal(&self) -> DVec3 {
        self.cap_normal
    }

    /// Distance of the cap from the eye, metres, positive.
    pub fn cap_distance_m(&self) -> f64 {
        self.cap_distance_m
    }

    /// The solid angle of the shadow's part in the window, steradians.
    pub fn solid_angle_in(&self, window: &ViewWindow) -> f64 {
        let mut outline = [DVec3::ZERO; MAX_SIDES + 4];
        let mut len = usize::from(self.len);
        outline[..len].copy_from_slice(self.corners());
        for i in 0..4 {
            let normal = window.corners()[i].cross(window.corners()[(i + 1) % 4]);
            let (low, high) = cone::reach(normal, &outline[..len]);
            if high <= 0.0 {
                return 0.0;
            }
            if low >= 0.0 {
                continue;
            }
            let uncut = outline;
            let mut count = 0;
            clip_convex(
                &uncut[..len],
                |p| normal.dot(p),
                |p| {
                    // Each plane adds at most one corner to a convex outline. More corners come from rounding, and are
                    // dropped.
                    if count < outline.len() {
                        outline[count] = p;
                        count += 1;
                    }
                },
            );
            len = count;
            if len < 3 {
                return 0.0;
            }
        }
        outline[1..len].windows(2).map(|w| triangle_solid_angle_sr(outline[0], w[0], w[1])).sum()
    }
}

/// Sets the side planes of a shadow volume, and checks that they are well-conditioned and form a convex cone. All sides are
/// computed together in plain loops, which the compiler vectorises.
struct RaiseSides<'a>(&'a mut ShadowVolume);

impl WithKernel for RaiseSides<'_> {
    type Output = Result<(), NotAnOccluder>;

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) -> Self::Output {
        const N: usize = MAX_SIDES;
        let Self(volume) = self;
        let len = usize::from(volume.len);
        let (mut from, mut to) = ([[0.0_f64; N]; 3], [[0.0_f64; N]; 3]);
        for i in 0..N {
            // Unused lanes repeat the last side.
            let i_or_last = i.min(len - 1);
            let next = if i_or_last + 1 == len { 0 } else { i_or_last + 1 };
            for axis in 0..3 {
                from[axis][i] = volume.corners[i_or_last][axis];
                to[axis][i] = volume.corners[next][axis];
            }
        }
        let (mut sides, mut end_on) = ([[0.0_f64; N]; 3], [0.0_f64; N]);
        for i in 0..N {
            let [x, y, z] = [from[0][i], from[1][i], from[2][i]];
            // `from x (to - from)` loses precision only for edges that point at the eye, not for short edges.
            let [u, v, w] = [to[0][i] - x, to[1][i] - y, to[2][i] - z];
            let [a, b, c] = [y * w - v * z, z * u - w * x, x * v - u * y];
            // Squares of sines are compared, so no roots are needed.
            let area = a * a + b * b + c * c;
            end_on[i] = area / ((x * x + y * y + z * z) * (u * u + v * v + w * w));
            let length = area.sqrt();
            (sides[0][i], sides[1][i], sides[2][i]) = (a / length, b / length, c / length);
        }
        let end_on = end_on[..len].iter().fold(1.0_f64, |least, s| least.min(*s));
        for (i, side) in volume.sides[..len].iter_mut().enumerate() {
            *side = DVec3::new(sides[0][i], sides[1][i], sides[2][i]);
        }
        let mut last = volume.sides[len - 1];
        for &side in &volume.sides[..len] {
            // A straight corner is well-conditioned, because its two planes are one. At sharp corners, with a small sine
            // and normals that point against each other, the shadow would reach out of the polygon.
            let needle = if last.dot(side) < 0.0 { last.cross(side).length_squared() } else { 1.0 };
            let condition = end_on * needle;
            if condition.is_nan() || condition < END_ON_SINE * END_ON_SINE {
                return Err(NotAnOccluder::IllConditioned);
            }
            last = side;
        }
        for corner in &volume.corners[..len] {
            let mut low = [0.0_f64; N];
            for i in 0..N {
                low[i] = sides[0][i] * corner.x + sides[1][i] * corner.y + sides[2][i] * corner.z;
            }
            let mut half = N / 2;
            while half > 0 {
                for i in 0..half {
                    low[i] = low[i].min(low[i + half]);
                }
                half /= 2;
            }
            let is_inside = low[0] >= 0.0 || low[0] * low[0] <= 1.0e-20 * corner.length_squared();
            if !is_inside {
                return Err(NotAnOccluder::NotConvex);
            }
        }
        Ok(())
    }
}

/// The drawn part of a convex polygon, beyond the near plane, and whether the plane cut anything off. (A cut need not add a
/// corner, because the near plane may pass through two corners of the polygon.)
fn clip_to_near(
    corners: &[DVec3],
    window: &ViewWindow,
) -> Result<([DVec3; MAX_SIDES], usize, bool), NotAnOccluder> {
    if !corners.iter().all(|v| v.is_finite()) {
        return Err(NotAnOccluder::NotFinite);
    }
    let far = corners.iter().map(|v| v.length()).fold(0.0, f64::max);
    // Even without a near plane, points at the eye have no direction, so the plane stays in front of it.
    let near = window.near_m().max(1.0e-9 * far);
    let mut kept = [DVec3::ZERO; MAX_SIDES];
    let (mut len, mut is_cut, mut is_too_long) = (0, false, false);
    split_convex(
        corners,
        |p| window.forward().dot(p) - near,
        |part, p| {
            if part == Part::Back {
                is_cut = true;
                return;
            }
            is_too_long |= len == MAX_SIDES;
            // Two equal corners would make an edge without direction.
            if !is_too_long && (len == 0 || kept[len - 1] != p) {
                kept[len] = p;
                len += 1;
            }
        },
    );
    if is_too_long {
        return Err(NotAnOccluder::NotConvex);
    }
    while len > 1 && kept[len - 1] == kept[0] {
        len -= 1;
    }
    if len < 3 { Err(NotAnOccluder::TooNear) } else { Ok((kept, len, is_cut)) }
}
