//! Occluders as a frame's picture has them: cut at the near plane, in pixels, turned one way round, each with its neighbours.

use glam::DVec3;

use super::{
    super::{EDGE_ON_SINE, ShadowVolume, raster::Raster},
    slope::{SIDE, Slope},
    surfaces::{EdgeCode, SIDES, Surfaces},
    table::NONE,
};
use crate::{polygon::PolygonId, view::ViewWindow};

/// Most sides of a facet: those of a quad, and one at the near plane.
pub(super) const FACET_SIDES: usize = SIDES + 1;

/// Steps of a pixel to which corners are rounded.
pub(super) const STEPS: f64 = 64.0;

/// How far, across and up, a corner's picture may lie from where it really is, pixels: half a step, and [`KNOWN`].
pub(super) const MARGIN: f64 = 1.0 / 64.0;

/// How well a corner's picture is known before it is rounded, pixels.
const KNOWN: f64 = 0.004;

/// Largest coordinate of a corner's picture, pixels: steps fit into `i32`, products of their differences into `i64`.
const FARTHEST_PX: f64 = (1 << 23) as f64;

/// Rounding of depths in `f32`, and what it takes to stay clear of it.
const DEPTH_SLACK: f64 = 1.0e-6;

/// A facet smaller than this both ways is given the depth of its farthest corner, pixels.
const SMALL_PX: i32 = 4;

/// Pixels of a tile's side.
const SQUARE: f64 = SIDE as f64;

/// A convex outline in the picture, counterclockwise (`y` up).
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// In steps.
    pub(super) at: [[i32; 2]; FACET_SIDES],
    pub(super) len: u8,
    /// Whether the picture turns the other way than the polygon.
    is_turned: bool,
    pub(super) polygon: u32,
    /// By edge, that from corner `i` to `i + 1`: the polygon's edge, [`NONE`] at the near plane.
    edges: [EdgeCode; FACET_SIDES],
    /// By edge: the facet on its other side, if there is one.
    pub(super) mates: [u32; FACET_SIDES],
    /// Its plane's reciprocal depth `[0] + [1] x + [2] y`, pushed back to its farthest corner.
    pub(super) plane: [f64; 3],
    /// The reciprocal depth of its farthest corner, or less; of a polygon that is tested that of its nearest, or more.
    pub(super) end: f64,
    has_plane: bool,
}

/// A corner from the eye, in the axes of the view, and its picture.
#[derive(Clone, Copy, Debug)]
struct Seen {
    corner: u32,
    /// Right, up and forward.
    eye: DVec3,
    at: [i32; 2],
    /// Reciprocal depth; 0 if it lies before the near plane, or has no picture.
    nearness: f64,
}

/// The facets of a frame; keeps its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Facets {
    seen: Vec<Seen>,
    /// By corner of the surfaces: its place in `seen`, if that says so, too.
    seen_of: Vec<u32>,
    /// By polygon: its facet, if that says so, too.
    facet_of: Vec<u32>,
    facets: Vec<Facet>,
    picture: Option<Picture>,
}

/// The picture that corners are projected to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture {
    raster: Raster,
    /// Nothing nearer is drawn; positive.
    near: f64,
    /// Largest size of a corner, by its depth, for which its picture is [`KNOWN`].
    most_tangent: f64,
}

impl Picture {
    pub(super) fn new(window: &ViewWindow, raster: &Raster, usual_m: f64) -> Self {
        // With `u = 2^-53`, a corner of size `s` (the sum of its coordinates from the eye) at depth `z`, and a tangent `t`
        // of at most `s / z`: its picture is wrong by less than `96 (1 + s / z)^2 u` times the pixels of a unit, as
        // [`super::super::depth`] shows. A corner at the near plane is wrong by no more, with the size of its edge.
        const U: f64 = 0.5 * f64::EPSILON;
        let pixels = raster.pixels_a_unit().max_element();
        let known = (KNOWN / (96.0 * U * pixels)).sqrt() - 1.0;
        let most_tangent = known.min(FARTHEST_PX / pixels);
        // What is cut off is only less that occludes.
        let near = window.near_m() * (1.0 + 1.0e-9);
        let near = if near > 0.0 { near } else { usual_m / most_tangent };
        Self { raster: *raster, near, most_tangent }
    }

    /// The picture of a point, and its reciprocal depth.
    #[inline(always)]
    fn project(&self, eye: DVec3) -> ([i32; 2], f64) {
        let nearness = 1.0 / eye.z;
        let size = eye.x.abs() + eye.y.abs();
        if !(eye.z >= self.near && size * nearness <= self.most_tangent) {
            return ([0; 2], 0.0);
        }
        let px = self.raster.flat_in_pixels(eye.x / eye.z, eye.y / eye.z) * STEPS;
        ([px.x, px.y].map(rounded), nearness)
    }
}

/// The nearest whole number, of one whose size is below 2^30.
#[inline(always)]
fn rounded(v: f64) -> i32 {
    // Below 0, a cast rounds up.
    const POSITIVE: i64 = 1 << 30;
    ((v + (POSITIVE as f64 + 0.5)) as i64 - POSITIVE) as i32
}

impl Facets {
    /// Makes room for surfaces of so many polygons, of which so many are taken in a frame.
    pub(super) fn reserve(&mut self, polygons: usize, taken: usize) {
        let corners = SIDES * taken;
        self.seen.reserve(corners);
        self.facets.reserve(taken);
        self.seen_of.resize(self.seen_of.len().max(2 * polygons), 0);
        self.facet_of.resize(self.facet_of.len().max(polygons), 0);
    }

    /// The picture of the last frame, if there was one.
    pub(super) fn picture(&self) -> Option<&Picture> {
        self.picture.as_ref()
    }

    /// The facets of the last frame.
    pub(super) fn all(&self) -> &[Facet] {
        &self.facets
    }

    /// Takes polygons of the surfaces.
    pub(super) fn take(
        &mut self,
        surfaces: &Surfaces,
        polygons: impl Iterator<Item = PolygonId>,
        window: &ViewWindow,
        raster: &Raster,
    ) {
        self.seen.clear();
        self.facets.clear();
        self.seen_of.resize(self.seen_of.len().max(surfaces.corner_end()), 0);
        self.facet_of.resize(self.facet_of.len().max(surfaces.face_end()), 0);
        for id in polygons {
            let corners = surfaces.corners_of(id);
            if corners.is_empty() {
                continue;
            }
            for &corner in corners {
                let place = self.seen_of[corner as usize] as usize;
                if self.seen.get(place).is_none_or(|seen| seen.corner != corner) {
                    self.seen_of[corner as usize] = self.seen.len() as u32;
                    let eye = raster.in_axes(surfaces.position(corner).as_dvec3() - raster.eye_in_world);
                    self.seen.push(Seen { corner, eye, at: [0; 2], nearness: 0.0 });
                }
            }
            self.facet_of[id.index()] = self.facets.len() as u32;
            self.facets.push(Facet { polygon: id.0, ..Facet::NONE });
        }
        let sum: f64 = self.seen.iter().map(|seen| seen.eye.abs().element_sum()).sum();
        let picture = Picture::new(window, raster, sum / self.seen.len().max(1) as f64);
        self.picture = Some(picture);
        for seen in &mut self.seen {
            (seen.at, seen.nearness) = picture.project(seen.eye);
        }
        for i in 0..self.facets.len() {
            let id = PolygonId(self.facets[i].polygon);
            self.set_up(i, surfaces.corners_of(id), id.0 * SIDES as u32, &picture);
        }
        for i in 0..self.facets.len() {
            self.find_mates(i, surfaces);
        }
    }

    /// Sets a facet up; leaves it without corners if it has no area in the picture.
    #[inline(always)]
    fn set_up(&mut self, facet: usize, corners: &[u32], first_edge: EdgeCode, picture: &Picture) {
        let mut places = [0; SIDES];
        let mut eyes = [DVec3::ZERO; SIDES];
        let mut is_whole = true;
        for (i, &corner) in corners.iter().enumerate() {
            places[i] = self.seen_of[corner as usize];
            let seen = &self.seen[places[i] as usize];
            eyes[i] = seen.eye;
            is_whole &= seen.nearness > 0.0;
        }
        let (places, eyes) = (&places[..corners.len()], &eyes[..corners.len()]);
        let mut outline = Outline::default();
        if is_whole {
            for (i, &place) in places.iter().enumerate() {
                let seen = &self.seen[place as usize];
                outline.push(seen.at, seen.nearness, first_edge + i as u32);
            }
        } else if !self.cut(places, first_edge, picture, &mut outline) {
            return;
        }
        let facet = &mut self.facets[facet];
        facet.set_outline(&outline);
        if facet.len > 0 {
            facet.set_plane(eyes, &picture.raster, Pushed::Back);
        }
    }

    /// The part of a polygon beyond the near plane. `false` if it is not known well enough.
    fn cut(&self, places: &[u32], first_edge: EdgeCode, picture: &Picture, outline: &mut Outline) -> bool {
        let count = places.len();
        for i in 0..count {
            let (from, to) = (places[i], places[(i + 1) % count]);
            let edge = first_edge + i as u32;
            let (a, b) = (&self.seen[from as usize], &self.seen[to as usize]);
            let [a_in, b_in] = [a, b].map(|seen| seen.eye.z >= picture.near);
            if a_in {
                if a.nearness == 0.0 {
                    return false;
                }
                outline.push(a.at, a.nearness, edge);
            }
            if a_in != b_in {
                // From the same end for both polygons of the edge: they get the same corner.
                let (low, high) = if from < to { (a.eye, b.eye) } else { (b.eye, a.eye) };
                let along = (picture.near - low.z) / (high.z - low.z);
                let mut eye = low + (high - low) * along;
                eye.z = picture.near;
                let size = low.abs().element_sum() + high.abs().element_sum();
                let (at, nearness) = picture.project(eye);
                let is_known = nearness > 0.0 && size <= picture.most_tangent * picture.near;
                if !is_known {
                    return false;
                }
                outline.push(at, nearness, if a_in { NONE } else { edge });
            }
        }
        true
    }

    /// Finds on the other side of each edge a facet that has none there yet.
    #[inline(always)]
    fn find_mates(&mut self, i: usize, surfaces: &Surfaces) {
        for side in 0..usize::from(self.facets[i].len) {
            let facet = &self.facets[i];
            let edge = facet.edges[side];
            if edge == NONE || facet.mates[side] != NONE {
                continue;
            }
            let end = surfaces.directed(edge)[usize::from(!facet.is_turned)];
            for other_edge in surfaces.mates(edge) {
                let polygon = other_edge / SIDES as u32;
                let place = self.facet_of[polygon as usize];
                let Some(other) = self.facets.get(place as usize) else { continue };
                // On the other side of the edge it runs the other way.
                if other.polygon != polygon
                    || place as usize == i
                    || surfaces.directed(other_edge)[usize::from(other.is_turned)] != end
                {
                    continue;
                }
                let sides = &other.edges[..usize::from(other.len)];
                let free =
                    sides.iter().position(|&edge| edge == other_edge).filter(|&k| other.mates[k] == NONE);
                if let Some(k) = free {
                    self.facets[place as usize].mates[k] = i as u32;
                    self.facets[i].mates[side] = place;
                    break;
                }
            }
        }
    }

    /// Takes outlines seen from the eye, without neighbours.
    pub(super) fn take_shadows(&mut self, shadows: &[ShadowVolume], window: &ViewWindow, raster: &Raster) {
        self.facets.clear();
        let corners = || shadows.iter().flat_map(ShadowVolume::corners);
        let sum: f64 = corners().map(|corner| corner.abs().element_sum()).sum();
        let picture = Picture::new(window, raster, sum / corners().count().max(1) as f64);
        self.picture = Some(picture);
        for shadow in shadows {
            let corners = shadow.corners();
            let eyes = corners.iter().map(|corner| raster.in_axes(*corner));
            let mut seen = [([0; 2], 0.0); super::super::MAX_SIDES];
            let mut is_seen = true;
            for (seen, eye) in seen.iter_mut().zip(eyes) {
                *seen = picture.project(eye);
                is_seen &= seen.1 > 0.0;
            }
            if !is_seen {
                continue;
            }
            let normal = raster.in_axes(shadow.cap_normal());
            let plane = plane_in_pixels(normal, shadow.cap_distance_m(), raster);
            // At most eight corners: two facets on both sides of a line.
            let first = self.facets.len() as u32;
            let (near_part, far_part) = (0..corners.len().min(FACET_SIDES), FACET_SIDES - 1..corners.len());
            let parts = [Some(near_part), (corners.len() > FACET_SIDES).then_some(far_part)];
            for (part, range) in parts.into_iter().enumerate() {
                let Some(range) = range else { continue };
                let mut outline = Outline::default();
                if part == 1 {
                    outline.push(seen[0].0, seen[0].1, SHARED);
                }
                for (at, nearness) in &seen[range] {
                    outline.push(*at, *nearness, NONE);
                }
                if part == 0 && corners.len() > FACET_SIDES {
                    outline.edges[FACET_SIDES - 1] = SHARED;
                }
                let mut facet = Facet { polygon: NONE, ..Facet::NONE };
                facet.set_outline(&outline);
                (facet.plane, facet.has_plane) = (plane, true);
                self.facets.push(facet);
            }
            if let [.., near_part, far_part] = &mut *self.facets
                && let (Some(a), Some(b)) = (near_part.shared(), far_part.shared())
            {
                (near_part.mates[a], far_part.mates[b]) = (first + 1, first);
            }
        }
    }
}

/// An outline in the picture, before it is looked at which way it turns.
#[derive(Default)]
struct Outline {
    at: [[i32; 2]; FACET_SIDES],
    edges: [EdgeCode; FACET_SIDES],
    len: usize,
    /// Whether there were more corners than a convex polygon leaves.
    is_full: bool,
    farthest: Option<f64>,
}

impl Outline {
    #[inline(always)]
    fn push(&mut self, at: [i32; 2], nearness: f64, edge: EdgeCode) {
        if self.len == FACET_SIDES {
            self.is_full = true;
            return;
        }
        (self.at[self.len], self.edges[self.len]) = (at, edge);
        self.len += 1;
        self.farthest = Some(self.farthest.map_or(nearness, |farthest| farthest.min(nearness)));
    }
}

/// Which way a plane is moved until no corner of a bent polygon lies beyond it.
#[derive(Clone, Copy, PartialEq)]
enum Pushed {
    Back,
    Forth,
}

/// The code of the line between the two facets of a shadow.
const SHARED: EdgeCode = 0;

impl Facet {
    fn shared(&self) -> Option<usize> {
        let is_loose = self.polygon == NONE;
        self.edges[..usize::from(self.len)].iter().position(|&edge| is_loose && edge == SHARED)
    }

    const NONE: Self = Self {
        at: [[0; 2]; FACET_SIDES],
        len: 0,
        is_turned: false,
        polygon: NONE,
        edges: [NONE; FACET_SIDES],
        mates: [NONE; FACET_SIDES],
        plane: [0.0; 3],
        end: 0.0,
        has_plane: false,
    };

    /// Takes an outline that is convex in the picture, counterclockwise.
    #[inline(always)]
    fn set_outline(&mut self, outline: &Outline) {
        let len = outline.len;
        if len < 3 || outline.is_full {
            return;
        }
        let (mut lefts, mut rights) = (0, 0);
        for i in 0..len {
            let [a, b, c] = [i, (i + 1) % len, (i + 2) % len].map(|k| outline.at[k].map(i64::from));
            let turn = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
            lefts += u32::from(turn > 0);
            rights += u32::from(turn < 0);
        }
        if (lefts == 0) == (rights == 0) {
            return;
        }
        self.is_turned = rights > 0;
        self.len = len as u8;
        self.end = outline.farthest.unwrap_or(0.0) * (1.0 - DEPTH_SLACK);
        if self.is_turned {
            for i in 0..len {
                self.at[i] = outline.at[len - 1 - i];
                // From the last corner back to the first: the edge before each.
                self.edges[i] = outline.edges[(2 * len - 2 - i) % len];
            }
        } else {
            (self.at, self.edges) = (outline.at, outline.edges);
        }
    }

    /// A polygon that is to be tested, given by its corners from the eye in the axes of the view. `None` if it has no
    /// convex outline in the picture.
    #[inline(always)]
    pub(super) fn of_tested(eyes: &[DVec3], picture: &Picture) -> Option<Self> {
        let mut outline = Outline::default();
        let mut nearest = 0.0_f64;
        for eye in eyes {
            let (at, nearness) = picture.project(*eye);
            if nearness == 0.0 {
                return None;
            }
            nearest = nearest.max(nearness);
            outline.push(at, nearness, NONE);
        }
        let mut facet = Self::NONE;
        facet.set_outline(&outline);
        if facet.len == 0 {
            return None;
        }
        facet.end = nearest * (1.0 + DEPTH_SLACK);
        facet.set_plane(eyes, &picture.raster, Pushed::Forth);
        Some(facet)
    }

    /// Its plane, from its corners before they were cut.
    #[inline(always)]
    fn set_plane(&mut self, eyes: &[DVec3], raster: &Raster, pushed: Pushed) {
        let ends = |axis: usize| {
            let along = self.at[..usize::from(self.len)].iter().map(move |at| at[axis]);
            along.fold((i32::MAX, i32::MIN), |(low, high), v| (low.min(v), high.max(v)))
        };
        let is_small = [0, 1].into_iter().all(|axis| {
            let (low, high) = ends(axis);
            i64::from(high) - i64::from(low) < i64::from(SMALL_PX) * STEPS as i64
        });
        if is_small {
            return;
        }
        let normal = match *eyes {
            [a, b, c] => (b - a).cross(c - a),
            [a, b, c, d] => (c - a).cross(d - b),
            _ => return,
        };
        let Some(mut normal) = normal.try_normalize() else { return };
        if normal.dot(eyes[0]) < 0.0 {
            normal = -normal;
        }
        let (mut nearest, mut distance, mut far) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        for eye in eyes {
            let away = normal.dot(*eye);
            (nearest, distance) = (nearest.min(away), distance.max(away));
            far = far.max(eye.length_squared());
        }
        if nearest > EDGE_ON_SINE * far.sqrt() {
            let distance = if pushed == Pushed::Back { distance } else { nearest };
            (self.plane, self.has_plane) = (plane_in_pixels(normal, distance, raster), true);
        }
    }

    /// A lower bound of its reciprocal depth within the square of pixels that begins here.
    #[inline(always)]
    pub(super) fn behind(&self, x: f64, y: f64) -> Slope {
        let [base, by_x, by_y] = self.plane;
        let across = [by_x * SQUARE, by_y * SQUARE];
        let (from, slack) = (base + by_x * x + by_y * y, self.slack(x, y));
        let least = from - slack + across[0].min(0.0) + across[1].min(0.0);
        if self.has_plane && least + 0.5 * (across[0].abs() + across[1].abs()) > self.end {
            Slope {
                from: (from - slack) as f32,
                across: across.map(|v| v as f32),
                end: least.max(self.end) as f32,
            }
        } else {
            Slope::level(self.end as f32)
        }
    }

    /// An upper bound of the reciprocal depth of a polygon that is tested.
    #[inline(always)]
    pub(super) fn before(&self, x: f64, y: f64) -> Slope {
        let [base, by_x, by_y] = self.plane;
        let across = [by_x * SQUARE, by_y * SQUARE];
        let (from, slack) = (base + by_x * x + by_y * y, self.slack(x, y));
        let most = from + slack + across[0].max(0.0) + across[1].max(0.0);
        if self.has_plane && most - 0.5 * (across[0].abs() + across[1].abs()) < self.end {
            Slope {
                from: (from + slack) as f32,
                across: across.map(|v| v as f32),
                end: most.min(self.end) as f32,
            }
        } else {
            Slope::level(self.end as f32)
        }
    }

    /// Terms may cancel: the slack is that of the largest.
    #[inline(always)]
    fn slack(&self, x: f64, y: f64) -> f64 {
        let [base, by_x, by_y] = self.plane;
        DEPTH_SLACK * (base.abs() + (by_x * (x + SQUARE)).abs() + (by_y * (y + SQUARE)).abs())
    }
}

/// The reciprocal depth of the plane with this unit normal and distance, by pixels.
#[inline(always)]
fn plane_in_pixels(normal: DVec3, distance: f64, raster: &Raster) -> [f64; 3] {
    let [by_x, by_y, base] = raster.axes_in_pixels(normal);
    [base, by_x, by_y].map(|v| v / distance)
}
