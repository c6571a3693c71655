//! Fills facets into tiles: finds the pixels whose samples a facet covers, and the pixels that its edges
//! touch.

use super::{
    facet::{Depths, FACET_SIDES, Facet},
    picture::{MARGIN, Picture, STEPS},
    slope::SIDE,
    table::NONE,
    tiles::{Entry, Tiles},
};
use crate::index::simd::{Kernel, WithKernel};

/// Position of the sample in a pixel, across and up. It lies between the steps to which corners are rounded, so no
/// horizontal or vertical edge passes through it.
const SAMPLE: f64 = 0.5 + 0.5 / STEPS;

/// A sample counts as covered if it lies at least this far inside each edge, pixels along the row. This is larger than
/// the rounding error: an edge's position in a row is a sum of terms below 2^25 pixels, so its error is below 1e-8.
const INSIDE: f64 = 1.0e-6;

/// Fills all facets into tiles.
pub(super) struct Fill<'a> {
    pub(super) facets: &'a [Facet],
    pub(super) tiles: &'a mut Tiles,
}

impl WithKernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) {
        let mut spans = Spans::NONE;
        for (facet, number) in self.facets.iter().zip(0..) {
            if facet.len > 0 {
                Strips::new(facet).fill(number, self.tiles, &mut spans);
            }
        }
        self.tiles.join(self.facets);
    }
}

/// An edge as a line: its x for each y, pixels.
#[derive(Clone, Copy)]
struct Line {
    x: f64,
    y: f64,
    /// Increase of x from row to row, pixels; 0 for a horizontal line.
    slope: f64,
}

impl Line {
    const NONE: Self = Self { x: 0.0, y: 0.0, slope: 0.0 };

    #[inline(always)]
    fn at(&self, y: f64) -> f64 {
        self.x + (y - self.y) * self.slope
    }
}

/// A list of lines, at most one for each side of a facet.
struct Lines {
    lines: [Line; FACET_SIDES],
    len: usize,
}

impl Lines {
    const NONE: Self = Self { lines: [Line::NONE; FACET_SIDES], len: 0 };

    #[inline(always)]
    fn push(&mut self, line: Line) {
        self.lines[self.len] = line;
        self.len += 1;
    }

    #[inline(always)]
    fn iter(&self) -> std::slice::Iter<'_, Line> {
        self.lines[..self.len].iter()
    }
}

/// A number for each row of a tile.
type Rows = [i32; SIDE];

/// A facet, prepared for filling strips of tiles.
pub(super) struct Strips<'a> {
    facet: &'a Facet,
    /// Lines that bound the facet on the left, and on the right.
    left: Lines,
    right: Lines,
    /// Edges without a neighbour. `ends` are the ranges of their x and y.
    open: Lines,
    ends: [[[f64; 2]; 2]; FACET_SIDES],
    low: [f64; 2],
    high: [f64; 2],
}

impl<'a> Strips<'a> {
    #[inline(always)]
    pub(super) fn new(facet: &'a Facet) -> Self {
        let mut strips = Self {
            facet,
            left: Lines::NONE,
            right: Lines::NONE,
            open: Lines::NONE,
            ends: [[[0.0; 2]; 2]; FACET_SIDES],
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        };
        let len = usize::from(facet.len);
        let px = |i: usize| facet.at[i].map(|v| f64::from(v) * (1.0 / STEPS));
        let mut from = px(len - 1);
        for corner in 0..len {
            let to = px(corner);
            let rise = to[1] - from[1];
            let slope = if rise == 0.0 { 0.0 } else { (to[0] - from[0]) / rise };
            let line = Line { x: from[0], y: from[1], slope };
            // Counterclockwise: edges that go down are on the left.
            if rise < 0.0 {
                strips.left.push(line);
            } else if rise > 0.0 {
                strips.right.push(line);
            }
            if facet.mates[if corner == 0 { len - 1 } else { corner - 1 }] == NONE {
                strips.ends[strips.open.len] =
                    [0, 1].map(|axis| [smaller(from[axis], to[axis]), larger(from[axis], to[axis])]);
                strips.open.push(line);
            }
            for (axis, &at) in to.iter().enumerate() {
                strips.low[axis] = smaller(strips.low[axis], at);
                strips.high[axis] = larger(strips.high[axis], at);
            }
            from = to;
        }
        strips
    }

    #[inline(always)]
    fn fill(&self, number: u32, tiles: &mut Tiles, spans: &mut Spans) {
        let [first, end] = self.strips(tiles);
        let depths = self.facet.depths();
        for strip in first..end {
            self.fill_strip(strip, number, &depths, tiles, spans);
        }
    }

    /// Range of the strips of tiles that the facet reaches.
    #[inline(always)]
    fn strips(&self, tiles: &Tiles) -> [i32; 2] {
        let height = (tiles.rows * SIDE) as f64;
        let (low, high) = (self.low[1] - MARGIN, self.high[1] + MARGIN);
        if high < 0.0 || low >= height {
            return [0; 2];
        }
        let strip_of = |y: f64| (smaller(larger(y, 0.0), height - 1.0) * (1.0 / SIDE as f64)) as i32;
        [strip_of(low), strip_of(high) + 1]
    }

    /// Fills the facet's part in a strip of tiles.
    #[inline(always)]
    fn fill_strip(&self, strip: i32, number: u32, depths: &Depths<'_>, tiles: &mut Tiles, spans: &mut Spans) {
        const SIZE: f64 = SIDE as f64;
        let width = (tiles.columns * SIDE) as f64;
        let low = f64::from(strip) * SIZE;
        let Some([from, to]) = self.reach(low, low + SIZE, width) else { return };
        let [whole_first, whole_end] = self.whole(low, width);
        if from < whole_first || to > whole_end || whole_first >= whole_end {
            self.set_spans(low, width, spans);
        }
        for column in from..to {
            let tile = strip as usize * tiles.columns + column;
            let depth = depths.behind((column * SIDE) as f64, low);
            if column >= whole_first && column < whole_end {
                tiles.fill_whole(tile, number, &depth);
                continue;
            }
            let x = (column * SIDE) as i32;
            let mut open = 0;
            for (from, to) in &spans.open[..spans.open_count] {
                open |= pixels(from, to, x);
            }
            tiles.push(
                tile,
                Entry {
                    facet: number,
                    before: NONE,
                    covered: pixels(&spans.from, &spans.to, x),
                    open,
                    depth,
                },
            );
        }
    }

    /// Range of the tiles of a strip that the facet fills wholly.
    #[inline(always)]
    fn whole(&self, low: f64, width: f64) -> [usize; 2] {
        const SIZE: f64 = SIDE as f64;
        let (y0, y1) = (low - MARGIN, low + (SIZE + MARGIN));
        if self.high[0] - self.low[0] < SIZE || self.low[1] > y0 || self.high[1] < y1 {
            return [0; 2];
        }
        let (mut from, mut to) = (-SIZE, width);
        for line in self.left.iter() {
            from = larger(from, larger(line.at(y0), line.at(y1)) + 2.0 * MARGIN);
        }
        for line in self.right.iter() {
            to = smaller(to, smaller(line.at(y0), line.at(y1)) - 2.0 * MARGIN);
        }
        let first = if from < 0.0 { 0 } else { (smaller(from, width) * (1.0 / SIZE)) as usize + 1 };
        [first, (larger(to, 0.0) * (1.0 / SIZE)) as usize]
    }

    /// Range of the tiles of a strip that the facet reaches. `None` if there are none.
    #[inline(always)]
    fn reach(&self, low: f64, high: f64, width: f64) -> Option<[usize; 2]> {
        let (y0, y1) = (larger(low - MARGIN, self.low[1]), smaller(high + MARGIN, self.high[1]));
        let (mut from, mut to) = (self.low[0], self.high[0]);
        for line in self.left.iter() {
            from = larger(from, smaller(line.at(y0), line.at(y1)));
        }
        for line in self.right.iter() {
            to = smaller(to, larger(line.at(y0), line.at(y1)));
        }
        let (from, to) = (from - MARGIN, to + MARGIN);
        if to < 0.0 || from >= width || from > to {
            return None;
        }
        let tile_of = |x: f64| (smaller(larger(x, 0.0), width - 1.0) * (1.0 / SIDE as f64)) as usize;
        Some([tile_of(from), tile_of(to) + 1])
    }

    /// For each row of a strip, finds the pixels whose samples are covered, and the pixels that each edge without a
    /// neighbour touches.
    #[inline(always)]
    fn set_spans(&self, low: f64, width: f64, spans: &mut Spans) {
        let (mut from, mut to) = ([0.0_f64; SIDE], [width; SIDE]);
        let ys: [f64; SIDE] = std::array::from_fn(|k| low + k as f64 + SAMPLE);
        for line in self.left.iter() {
            for k in 0..SIDE {
                from[k] = larger(from[k], line.at(ys[k]) + (INSIDE + 1.0 - SAMPLE));
            }
        }
        for line in self.right.iter() {
            for k in 0..SIDE {
                to[k] = smaller(to[k], line.at(ys[k]) + (1.0 - INSIDE - SAMPLE));
            }
        }
        spans.open_count = 0;
        for k in 0..SIDE {
            let is_in = ys[k] > self.low[1] && ys[k] < self.high[1];
            // The first pixel whose sample lies beyond a line, and one more than the last before a line.
            spans.from[k] = whole_part(smaller(from[k], width));
            spans.to[k] = whole_part(if is_in { larger(to[k], 0.0) } else { 0.0 }).max(spans.from[k]);
        }
        for (line, ends) in self.open.iter().zip(&self.ends) {
            let [[left, right], [bottom, top]] = *ends;
            if top < low - MARGIN || bottom > low + (SIDE as f64 + MARGIN) {
                continue;
            }
            let (from, to) = &mut spans.open[spans.open_count];
            spans.open_count += 1;
            // A level line has no part in any row.
            let (level_left, level_right) =
                if top == bottom { (left, right) } else { (f64::INFINITY, f64::NEG_INFINITY) };
            for k in 0..SIDE {
                let (y0, y1) = (low + k as f64 - MARGIN, low + (k as f64 + 1.0 + MARGIN));
                let is_in = y1 >= bottom && y0 <= top;
                let (y0, y1) = (larger(y0, bottom), smaller(y1, top));
                let (a, b) = (line.at(y0), line.at(y1));
                let first = smaller(level_left, smaller(a, b)) - MARGIN;
                let last = larger(level_right, larger(a, b)) + MARGIN;
                from[k] = whole_part(smaller(larger(first, 0.0), width));
                to[k] = whole_part(if is_in { larger(smaller(last, width) + 1.0, 0.0) } else { 0.0 })
                    .max(from[k]);
            }
        }
    }

    /// For each row of a strip, the range of all pixels that the facet may touch.
    #[inline(always)]
    fn touched(&self, low: f64, width: f64) -> (Rows, Rows) {
        let (mut from, mut to) = ([0.0_f64; SIDE], [width; SIDE]);
        let (mut y0, mut y1) = ([0.0; SIDE], [0.0; SIDE]);
        for k in 0..SIDE {
            y0[k] = larger(low + k as f64 - MARGIN, self.low[1]);
            y1[k] = smaller(low + (k as f64 + 1.0 + MARGIN), self.high[1]);
        }
        for line in self.left.iter() {
            for k in 0..SIDE {
                from[k] = larger(from[k], smaller(line.at(y0[k]), line.at(y1[k])) - MARGIN);
            }
        }
        for line in self.right.iter() {
            for k in 0..SIDE {
                to[k] = smaller(to[k], larger(line.at(y0[k]), line.at(y1[k])) + MARGIN);
            }
        }
        let mut rows = ([0; SIDE], [0; SIDE]);
        for k in 0..SIDE {
            let is_in = y0[k] <= y1[k];
            rows.0[k] = whole_part(smaller(from[k], width));
            rows.1[k] = whole_part(if is_in { larger(to[k] + 1.0, 0.0) } else { 0.0 }).max(rows.0[k]);
        }
        rows
    }

    /// Whether all pixels that the facet touches are covered before the facet's nearest depth in their tile.
    #[inline(always)]
    pub(super) fn is_hidden(&self, tiles: &Tiles, picture: &Picture) -> bool {
        if !picture.shows(self.low.map(|v| v - MARGIN), self.high.map(|v| v + MARGIN)) {
            return false;
        }
        const SIZE: f64 = SIDE as f64;
        let width = (tiles.columns * SIDE) as f64;
        let [first, end] = self.strips(tiles);
        for strip in first..end {
            let low = f64::from(strip) * SIZE;
            let Some([from, to]) = self.reach(low, low + SIZE, width) else { continue };
            let mut rows = None;
            for column in from..to {
                let tile = strip as usize * tiles.columns + column;
                let near = self.facet.before((column * SIDE) as f64, low);
                if tiles.hides_all(tile, &near) {
                    continue;
                }
                let (from, to) = match &rows {
                    Some(rows) => rows,
                    None => &*rows.insert(self.touched(low, width)),
                };
                if !tiles.hides(tile, pixels(from, to, (column * SIDE) as i32), &near) {
                    return false;
                }
            }
        }
        true
    }
}

/// For each row of a strip, the range of covered pixels, and the range of pixels that each edge without a neighbour
/// touches.
struct Spans {
    from: Rows,
    to: Rows,
    open: [(Rows, Rows); FACET_SIDES],
    open_count: usize,
}

impl Spans {
    const NONE: Self =
        Self { from: [0; SIDE], to: [0; SIDE], open: [([0; SIDE], [0; SIDE]); FACET_SIDES], open_count: 0 };
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

/// Rounds a number from 0 to 2^20 down, with an error of 1e-9.
#[inline(always)]
fn whole_part(v: f64) -> i32 {
    // Next to one and a half times 2^52, numbers are whole: the last bits are the number.
    const LAST_BITS: f64 = (3_u64 << 51) as f64;
    (v - (0.5 - 1.0e-9) + LAST_BITS).to_bits() as i32
}

/// The pixels of a tile within one interval in each row, from bit 0, row by row. Each interval ends at its
/// beginning or later.
#[inline(always)]
fn pixels(from: &Rows, to: &Rows, x: i32) -> u64 {
    const ROW: u32 = (1 << SIDE) - 1;
    let beyond = |at: i32| ROW << (at - x).clamp(0, SIDE as i32);
    let rows: [u8; SIDE] = std::array::from_fn(|k| (beyond(from[k]) ^ beyond(to[k])) as u8);
    u64::from_le_bytes(rows)
}
