//! A facet: a polygon in the picture, or a part of it, as a convex outline with bounds of its depth.

use glam::DVec3;

use super::{
    super::{EDGE_ON_SINE, raster::Raster},
    picture::{Picture, STEPS},
    slope::{SIDE, Slope},
    surfaces::{EdgeCode, SIDES},
    table::NONE,
};

/// Largest number of sides of a facet: four of a quad, and one at the near plane.
pub(super) const FACET_SIDES: usize = SIDES + 1;

/// The number of lanes for the sides of a facet, a full register.
pub(super) const LANES: usize = 8;

/// Bound of the relative error of depths in `f32` from rounding, with a margin.
const DEPTH_SLACK: f64 = 1.0e-6;

/// A facet that is smaller than this in both directions, pixels, has the depth of its farthest corner
/// everywhere.
const SMALL_PX: i32 = 4;

/// Code of the edge along which a polygon is cut into two parts.
pub(super) const SHARED: EdgeCode = NONE - 1;

/// Width of a tile, pixels.
const SQUARE: f64 = SIDE as f64;

/// A convex outline in the picture, counterclockwise (`y` up).
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// The corners across and up, in steps. The first corner also fills the lanes without a corner.
    pub(super) at: [[i32; LANES]; 2],
    pub(super) len: u8,
    /// Whether the facet's orientation in the picture is the reverse of the polygon's.
    pub(super) is_turned: bool,
    pub(super) polygon: u32,
    /// The facet of the polygon's other part, if the polygon is cut into two.
    pub(super) half: u32,
    /// For each edge, from corner `i` to `i + 1`: the code of the polygon's edge, [`SHARED`], or [`NONE`] at
    /// the near plane.
    pub(super) edges: [EdgeCode; FACET_SIDES],
    /// For each edge, the facet on the other side of the edge; [`NONE`] without one.
    pub(super) mates: [u32; FACET_SIDES],
    /// Reciprocal depth at pixel (x, y): `[0] + [1] x + [2] y`. This is the facet's plane, moved away from
    /// the eye to the farthest corner. A tested polygon's plane is moved to the nearest corner.
    pub(super) plane: [f64; 3],
    /// A lower bound of the reciprocal depth of the facet's farthest corner. For a tested polygon, an upper bound
    /// of the reciprocal depth of its nearest corner.
    pub(super) end: f64,
    pub(super) has_plane: bool,
}

/// An outline in the picture, of unknown orientation.
#[derive(Default)]
pub(super) struct Outline {
    at: [[i32; 2]; FACET_SIDES],
    pub(super) edges: [EdgeCode; FACET_SIDES],
    len: usize,
    /// Whether more corners were added than a convex polygon can have.
    is_full: bool,
    farthest: Option<f64>,
}

impl Outline {
    #[inline(always)]
    pub(super) fn push(&mut self, at: [i32; 2], nearness: f64, edge: EdgeCode) {
        if self.len == FACET_SIDES {
            self.is_full = true;
            return;
        }
        (self.at[self.len], self.edges[self.len]) = (at, edge);
        self.len += 1;
        self.farthest = Some(self.farthest.map_or(nearness, |farthest| farthest.min(nearness)));
    }
}

impl Outline {
    /// Whether no corner lies outside the line of an edge. With more than four corners, the turns at the corners do not
    /// suffice, because corners at the same place have no turn.
    fn is_convex(&self, is_turned: bool) -> bool {
        let at = |i: usize| self.at[i % self.len].map(i64::from);
        (0..self.len).all(|i| {
            let (a, b) = (at(i), at(i + 1));
            (0..self.len).map(at).all(|p| {
                let side = turn(a, b, p);
                side == 0 || (side < 0) == is_turned
            })
        })
    }
}

/// Direction in which a plane is moved until no corner of a bent polygon lies beyond it.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Pushed {
    Back,
    Forth,
}

impl Facet {
    pub(super) fn shared(&self) -> Option<usize> {
        self.edges[..usize::from(self.len)].iter().position(|&edge| edge == SHARED)
    }

    pub(super) const NONE: Self = Self {
        at: [[0; LANES]; 2],
        len: 0,
        is_turned: false,
        polygon: NONE,
        half: NONE,
        edges: [NONE; FACET_SIDES],
        mates: [NONE; FACET_SIDES],
        plane: [0.0; 3],
        end: 0.0,
        has_plane: false,
    };

    /// Stores an outline in counterclockwise order. Does nothing if the outline is not convex in the picture.
    #[inline(always)]
    pub(super) fn set_outline(&mut self, outline: &Outline) {
        let len = outline.len;
        if len < 3 || outline.is_full {
            return;
        }
        let (mut lefts, mut rights) = (0, 0);
        for i in 0..len {
            let [a, b, c] = [i, (i + 1) % len, (i + 2) % len].map(|k| outline.at[k].map(i64::from));
            let turn = turn(a, b, c);
            lefts += u32::from(turn > 0);
            rights += u32::from(turn < 0);
        }
        if (lefts == 0) == (rights == 0) {
            return;
        }
        let is_turned = rights > 0;
        if len > SIDES && !outline.is_convex(is_turned) {
            return;
        }
        self.is_turned = is_turned;
        self.len = len as u8;
        self.end = outline.farthest.unwrap_or(0.0) * (1.0 - DEPTH_SLACK);
        self.edges = outline.edges;
        if self.is_turned {
            for i in 0..len {
                // In the reversed outline, the edge that ends at a corner begins there.
                self.edges[i] = outline.edges[(2 * len - 2 - i) % len];
            }
        }
        let corners = &outline.at[..len];
        if self.is_turned {
            self.set_corners(corners.iter().rev().copied());
        } else {
            self.set_corners(corners.iter().copied());
        }
    }

    #[inline(always)]
    pub(super) fn set_corners(&mut self, mut corners: impl Iterator<Item = [i32; 2]>) {
        let first = corners.next().unwrap_or_default();
        self.at = first.map(|v| [v; LANES]);
        for (i, [x, y]) in corners.enumerate() {
            (self.at[0][i + 1], self.at[1][i + 1]) = (x, y);
        }
    }

    #[inline(always)]
    pub(super) fn corner(&self, i: usize) -> [i32; 2] {
        [self.at[0][i], self.at[1][i]]
    }

    /// The lowest and highest coordinates across and up, in steps.
    #[inline(always)]
    pub(super) fn ends(&self) -> [[i32; 2]; 2] {
        self.at.map(|along| {
            let (mut low, mut high) = (i32::MAX, i32::MIN);
            for v in along {
                (low, high) = (low.min(v), high.max(v));
            }
            [low, high]
        })
    }

    /// The facet of a tested polygon. `eyes` are the polygon's corners relative to the eye, in the axes of the view.
    /// `seen` are their pixels and reciprocal depths. `None` if the polygon has no convex outline in the picture.
    #[inline(always)]
    pub(super) fn of_tested(eyes: &[DVec3], seen: &[([i32; 2], f64)], picture: &Picture) -> Option<Self> {
        let mut outline = Outline::default();
        let mut nearest = 0.0_f64;
        for &(at, nearness) in seen {
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

    /// Sets the facet's plane from the corners of the polygon before it was cut. Does nothing if the facet is
    /// small or nearly edge-on.
    #[inline(always)]
    pub(super) fn set_plane(&mut self, eyes: &[DVec3], raster: &Raster, pushed: Pushed) {
        let is_small = self
            .ends()
            .into_iter()
            .all(|[low, high]| i64::from(high) - i64::from(low) < i64::from(SMALL_PX) * STEPS as i64);
        if is_small {
            return;
        }
        if let Some(plane) = plane_of(eyes, raster, pushed) {
            (self.plane, self.has_plane) = (plane, true);
        }
    }

    /// Bounds of the facet's depth, prepared for tiles that begin at coordinates up to `most`, pixels.
    #[inline(always)]
    pub(super) fn depths(&self, most: [f64; 2]) -> Depths {
        let [base, by_x, by_y] = self.plane;
        let across = [by_x * SQUARE, by_y * SQUARE];
        let slack = self.slack(most[0], most[1]);
        if !self.has_plane {
            let level = self.end;
            return Depths { plane: [level, 0.0, 0.0], low: 0.0, across: [0.0; 2], end: level };
        }
        Depths {
            plane: [base - slack, by_x, by_y],
            low: across[0].min(0.0) + across[1].min(0.0),
            across: across.map(|v| v as f32),
            end: self.end,
        }
    }

    /// An upper bound of the reciprocal depth of a tested polygon, in the tile that begins at pixel (x, y).
    #[inline(always)]
    pub(super) fn nearest_in(&self, x: f64, y: f64) -> Slope {
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

    /// Rounding error of the plane's reciprocal depth in a tile. The terms may cancel, so the error is a part
    /// of the largest terms.
    #[inline(always)]
    fn slack(&self, x: f64, y: f64) -> f64 {
        let [base, by_x, by_y] = self.plane;
        DEPTH_SLACK * (base.abs() + (by_x * (x + SQUARE)).abs() + (by_y * (y + SQUARE)).abs())
    }
}

/// Bounds of a facet's depth, with the terms that are equal for all tiles.
pub(super) struct Depths {
    /// The facet's plane, moved away from the eye by the rounding error.
    plane: [f64; 3],
    /// Least value in a tile minus the value at its first corner (<= 0).
    low: f64,
    across: [f32; 2],
    end: f64,
}

impl Depths {
    /// A lower bound of the facet's reciprocal depth, in the tile that begins at pixel (x, y).
    #[inline(always)]
    pub(super) fn farthest_in(&self, x: f64, y: f64) -> Slope {
        let [base, by_x, by_y] = self.plane;
        let from = base + by_x * x + by_y * y;
        let least = from + self.low;
        let end = if least > self.end { least } else { self.end };
        Slope { from: from as f32, across: self.across, end: end as f32 }
    }
}

/// The reciprocal depth of a polygon's plane as a linear function of pixels; `None` if the polygon is nearly edge-on. A
/// plane behind all corners is behind the whole polygon, small or not. If edge-on, rounding exceeds the slack only if a
/// corner lies more than 10^9 times as far as the nearest depth.
#[inline(always)]
pub(super) fn plane_of(eyes: &[DVec3], raster: &Raster, pushed: Pushed) -> Option<[f64; 3]> {
    let normal = match *eyes {
        [a, b, c] => (b - a).cross(c - a),
        [a, b, c, d] => (c - a).cross(d - b),
        _ => return None,
    };
    let normal = if normal.dot(eyes[0]) < 0.0 { -normal } else { normal };
    let (mut nearest, mut distance, mut far) = (f64::INFINITY, 0.0_f64, 0.0_f64);
    for eye in eyes {
        let away = normal.dot(*eye);
        (nearest, distance) = (nearest.min(away), distance.max(away));
        far = far.max(eye.length_squared());
    }
    // Distances are multiples of the normal's length. Squared, numbers in `f32` neither overflow nor vanish.
    let least = EDGE_ON_SINE * EDGE_ON_SINE * far * normal.length_squared();
    let is_flat = nearest > 0.0 && nearest * nearest > least;
    let distance = if pushed == Pushed::Back { distance } else { nearest };
    is_flat.then(|| plane_in_pixels(normal, distance, raster))
}

/// The reciprocal depth of a plane as a linear function of pixels. The plane has this normal and this
/// scalar product with it.
#[inline(always)]
pub(super) fn plane_in_pixels(normal: DVec3, distance: f64, raster: &Raster) -> [f64; 3] {
    let [by_x, by_y, base] = raster.axes_in_pixels(normal);
    [base, by_x, by_y].map(|v| v / distance)
}

/// Twice the signed area of the triangle `a b c`, in square steps. It is positive if the triangle is
/// counterclockwise.
#[inline(always)]
pub(super) fn turn(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
}
