//! Fills facets into tiles: finds the pixels whose samples a facet covers, and the pixels that its edges
//! touch.

use super::{
    facet::{FACET_SIDES, Facet, LANES as EDGES},
    image::pixels_within,
    picture::{MARGIN, STEPS, pixels_between},
    slope::SIDE,
    surfaces::SIDES,
    table::NONE,
    tiles::{Part, Tiles},
};
use crate::index::simd::{Kernel, WithKernel};

/// Position of the sample in a pixel, across and up. It lies between the steps to which corners are rounded, so no
/// horizontal or vertical edge passes through it. [`TOUCH`] makes any place from the middle to the last corner safe.
const SAMPLE: f64 = 0.5 + 0.5 / STEPS;

/// A sample counts as covered if it lies at least this far inside each edge. See [`Edges`] for the unit and the
/// rounding error.
const INSIDE: f32 = 2.0e-5;

/// Largest distance of a sample from an edge that comes within [`MARGIN`] of the sample's pixel. Without
/// [`INSIDE`], the excess of [`MARGIN`] would cover the rounding.
const TOUCH: f32 = (SAMPLE + MARGIN) as f32 + INSIDE;

/// The distance of an edge that bounds nothing.
const NOWHERE: f64 = 1.0e9;

/// The bits of all edges.
const ALL: u32 = (1 << EDGES) - 1;

const SIZE: f64 = SIDE as f64;

/// Fills all facets into tiles.
pub(super) struct Fill<'a> {
    pub(super) facets: &'a [Facet],
    pub(super) tiles: &'a mut Tiles,
}

impl WithKernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        for (facet, number) in self.facets.iter().zip(0..) {
            if facet.len > 0 {
                fill(kernel, facet, number, self.tiles);
            } else {
                self.tiles.begin_facet([[0; 2]; 2]);
            }
        }
        self.tiles.join(kernel, self.facets.len());
    }
}

/// Fills one facet into all tiles that it reaches.
#[inline(always)]
fn fill<K: Kernel>(kernel: K, facet: &Facet, number: u32, tiles: &mut Tiles) {
    let edges = Edges::new(facet);
    let reach = edges.reach(tiles);
    if !tiles.begin_facet(reach) {
        return;
    }
    let depths = facet.depths(reach.map(|[_, end]| (end * SIDE) as f64));
    let mut earlier = 0;
    for (edge, &mate) in facet.mates.iter().enumerate() {
        earlier |= u32::from(mate < number) << edge;
    }
    let [columns, rows] = reach;
    for row in rows[0]..rows[1] {
        for column in columns[0]..columns[1] {
            let (x, y) = (column * SIDE, row * SIDE);
            let Some(part) = edges.in_tile(kernel, x as f64, y as f64) else { continue };
            let tile = row * tiles.columns + column;
            let depth = depths.farthest_in(x as f64, y as f64);
            if part.cut == 0 {
                tiles.fill_whole(tile, number, &depth);
                continue;
            }
            let covered = edges.inside(kernel, &part, INSIDE);
            let (mut open, mut left) = (0, part.cut & edges.open);
            while left != 0 {
                open |= edges.touched(kernel, &part, left.trailing_zeros() as usize, [x as i32, y as i32]);
                left &= left - 1;
            }
            let touched = pixels_within(edges.pixels[0], edges.pixels[1], x as i32, y as i32);
            tiles.push([column, row], number, Part { covered, open, touched, depth });
            let mut left = part.cut & earlier;
            while left != 0 {
                tiles.unite([column, row], facet.mates[left.trailing_zeros() as usize]);
                left &= left - 1;
            }
        }
    }
}

/// Whether all pixels that a tested polygon touches are covered nearer than the polygon's nearest depth. The polygon must
/// lie in the shown part of the picture.
#[inline(always)]
pub(super) fn is_hidden<K: Kernel>(kernel: K, facet: &Facet, tiles: &Tiles) -> bool {
    let edges = Edges::new(facet);
    let [columns, rows] = edges.reach(tiles);
    for row in rows[0]..rows[1] {
        for column in columns[0]..columns[1] {
            let (x, y) = (column * SIDE, row * SIDE);
            let Some(part) = edges.in_tile(kernel, x as f64, y as f64) else { continue };
            let tile = row * tiles.columns + column;
            let near = facet.nearest_in(x as f64, y as f64);
            if tiles.hides_all(tile, &near) {
                continue;
            }
            let [columns, rows] = edges.pixels;
            let pixels =
                edges.inside(kernel, &part, -TOUCH) & pixels_within(columns, rows, x as i32, y as i32);
            if !tiles.hides(kernel, tile, pixels, &near) {
                return false;
            }
        }
    }
    true
}

/// The edges of a facet as linear functions of the position in the picture, `a x + b y + c`, positive on the facet's
/// side. They are scaled so that `|a| + |b| = 1`: then the function changes by at most 1 over a pixel, and by
/// [`MARGIN`] if the edge moves by that much across and up.
///
/// A function's value at a sample is wrong by less than [`INSIDE`], or has the right sign: corners are exact, `c` is
/// wrong by less than 2^-27, and values in a tile are computed in `f32`. If `c` at the tile is at most 24, each of
/// nine roundings errs by at most 2^-19.9, together 1e-5. If it is larger, the function is larger than 16 everywhere
/// in the tile, and so it keeps its sign.
struct Edges {
    a: [f64; EDGES],
    b: [f64; EDGES],
    /// The value at the first sample of the tile at the origin.
    c: [f64; EDGES],
    /// Least value at a tile's corners, less twice [`MARGIN`], and greatest value, plus twice [`MARGIN`]; both relative to
    /// the value at the first sample. If the least is below 0, the edge may come near the tile. If the greatest is, the
    /// facet does not. One [`MARGIN`] covers all errors; the other one makes neighbours decide alike despite rounding.
    ends: [[f32; EDGES]; 2],
    /// Bits of the edges without a neighbour, and of the edges without length.
    open: u32,
    points: u32,
    /// The columns and rows of pixels within [`MARGIN`] of each open edge, and of the facet.
    near: [[[i32; 2]; 2]; FACET_SIDES],
    pixels: [[i32; 2]; 2],
}

/// The edges of a facet in a tile that the facet reaches.
struct EdgesInTile {
    /// Value of each edge at the first sample.
    at: [f32; EDGES],
    /// Bits of the edges that pass the tile or come near it.
    cut: u32,
}

impl Edges {
    #[inline(always)]
    fn new(facet: &Facet) -> Self {
        let mut edges = Self {
            a: [0.0; EDGES],
            b: [0.0; EDGES],
            c: [0.0; EDGES],
            ends: [[0.0; EDGES]; 2],
            open: 0,
            points: 0,
            near: [[[0; 2]; 2]; FACET_SIDES],
            pixels: facet.ends().map(pixels_between),
        };
        let from = &facet.at;
        let to = from.map(|at| std::array::from_fn::<_, EDGES, _>(|i| at[(i + 1) % EDGES]));
        for i in 0..EDGES {
            let [from_x, from_y] = [0, 1].map(|axis| f64::from(from[axis][i]) * (1.0 / STEPS));
            let [to_x, to_y] = [0, 1].map(|axis| f64::from(to[axis][i]) * (1.0 / STEPS));
            let (dx, dy) = (to_x - from_x, to_y - from_y);
            let length = dx.abs() + dy.abs();
            let is_point = length == 0.0;
            let length = if is_point { 1.0 } else { length };
            // Counterclockwise: the facet lies on the left of its edges.
            let (a, b) = (-dy / length, dx / length);
            let c = a * (SAMPLE - from_x) + b * (SAMPLE - from_y);
            (edges.a[i], edges.b[i], edges.c[i]) = (a, b, if is_point { NOWHERE } else { c });
            let first = -SAMPLE * (a + b);
            edges.ends[0][i] = (first + SIZE * (smaller(a, 0.0) + smaller(b, 0.0)) - 2.0 * MARGIN) as f32;
            edges.ends[1][i] = (first + SIZE * (larger(a, 0.0) + larger(b, 0.0)) + 2.0 * MARGIN) as f32;
        }
        for i in 0..usize::from(facet.len) {
            let [from, to] = [[from[0][i], from[1][i]], [to[0][i], to[1][i]]];
            edges.points |= u32::from(from == to) << i;
            if facet.mates[i] == NONE {
                edges.open |= 1 << i;
                edges.near[i] =
                    [0, 1].map(|axis| pixels_between([from[axis].min(to[axis]), from[axis].max(to[axis])]));
            }
        }
        edges
    }

    /// The columns and rows of tiles that the facet may reach.
    #[inline(always)]
    fn reach(&self, tiles: &Tiles) -> [[usize; 2]; 2] {
        let [columns, rows] = self.pixels;
        let range = |[from, end]: [i32; 2], count: usize| {
            let (from, end) = (from.max(0) as usize / SIDE, end.max(0) as usize);
            [from, end.div_ceil(SIDE).min(count)]
        };
        [range(columns, tiles.columns), range(rows, tiles.rows)]
    }

    /// The edges in the tile that begins at pixel (x, y). `None` if the facet is farther than [`MARGIN`] from the tile.
    #[inline(always)]
    fn in_tile<K: Kernel>(&self, kernel: K, x: f64, y: f64) -> Option<EdgesInTile> {
        let (mut at, mut least, mut most) = ([0.0; EDGES], [0.0; EDGES], [0.0; EDGES]);
        for i in 0..EDGES {
            at[i] = (self.a[i] * x + self.b[i] * y + self.c[i]) as f32;
            least[i] = at[i] + self.ends[0][i];
            most[i] = at[i] + self.ends[1][i];
        }
        // An edge without length counts as near every tile, until its pixels are compared.
        let cut = !kernel.not_negative(&least) & ALL | self.points;
        (kernel.not_negative(&most) == ALL).then_some(EdgesInTile { at, cut })
    }

    /// The pixels whose samples lie at least `least` inside all edges.
    #[inline(always)]
    fn inside<K: Kernel>(&self, kernel: K, part: &EdgesInTile, least: f32) -> u64 {
        let (mut at, mut a, mut b) = ([0.0; SIDES], [0.0; SIDES], [0.0; SIDES]);
        for edge in 0..SIDES {
            (at[edge], a[edge], b[edge]) = (part.at[edge] - least, self.a[edge] as f32, self.b[edge] as f32);
        }
        let inside = kernel.half_planes(at, a, b);
        let [a, b] = [self.a[SIDES], self.b[SIDES]];
        if a == 0.0 && b == 0.0 {
            return inside;
        }
        inside & kernel.half_planes([part.at[SIDES] - least], [a as f32], [b as f32])
    }

    /// The pixels within [`MARGIN`] of an edge, in the tile that begins at pixel `first`.
    #[inline(always)]
    fn touched<K: Kernel>(&self, kernel: K, part: &EdgesInTile, edge: usize, first: [i32; 2]) -> u64 {
        let [columns, rows] = self.near[edge];
        let within = pixels_within(columns, rows, first[0], first[1]);
        if self.points >> edge & 1 == 1 {
            return within;
        }
        let (at, a, b) = (part.at[edge], self.a[edge] as f32, self.b[edge] as f32);
        within & kernel.half_planes([TOUCH + at, TOUCH - at], [a, -a], [b, -b])
    }
}

/// The larger number; unspecified for NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller number; unspecified for NaN.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
