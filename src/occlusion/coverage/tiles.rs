//! The picture as tiles of 8 x 8 pixels. Each tile has a depth beyond which all of it is covered, and two nearer layers
//! that cover some pixels.

use super::{
    facet::Facet,
    picture::STEPS,
    slope::{SIDE, Slope},
    table::NONE,
};
use crate::occlusion::Needed;

/// Largest number of entries of a frame, 48 bytes each. [`RESERVED_ENTRIES`] is the number for which memory
/// is reserved.
const MOST_ENTRIES: usize = 1 << 18;
const RESERVED_ENTRIES: usize = 1 << 17;

/// Number of facets in one tile for which memory is reserved.
const RESERVED_LOCALS: usize = 1 << 10;

/// Number of bits of a corner's coordinate that are below the pixel.
const STEP_BITS: u32 = (STEPS as u32).trailing_zeros();
const TILE_STEPS: i32 = SIDE as i32 * STEPS as i32 - 1;

/// Covered pixels of a tile, and a lower bound of the reciprocal depth at which all of them are covered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Layer {
    pub(super) pixels: u64,
    pub(super) depth: Slope,
}

/// The part of one facet in a tile's pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) facet: u32,
    /// The previous entry of the same tile.
    pub(super) before: u32,
    /// Pixels whose samples the facet covers.
    pub(super) covered: u64,
    /// Pixels through which an edge without a neighbour passes.
    pub(super) open: u64,
    /// A lower bound of the facet's reciprocal depth in the tile.
    pub(super) depth: Slope,
}

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Tiles {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// For each tile, from the lowest row up: the reciprocal depth at which all its pixels are covered; 0 if
    /// some are not.
    all: Vec<f32>,
    /// For each tile, the same depth as a linear bound, which is more precise.
    slopes: Vec<Slope>,
    /// For each tile, the nearest depth at which any pixel is covered.
    nearest: Vec<f32>,
    /// For each tile, two layers nearer than `all`, the nearest first.
    layers: Vec<[Layer; 2]>,
    /// For each tile, its last entry.
    last: Vec<u32>,
    entries: Vec<Entry>,
    /// Marks tiles that have too many entries, so that their lists are incomplete.
    broken: Vec<bool>,
    is_broken: bool,
    /// The facets in the tile that is being processed. The parent of a facet is another facet of its surface,
    /// or the facet itself.
    locals: Vec<Entry>,
    parents: Vec<u32>,
    /// For each facet, its index in `locals`. It is valid only if that entry has the facet's number.
    local_of: Vec<u32>,
    surfaces: Vec<(Layer, u32)>,
    /// For each tile, the facet that set `all`, if this facet alone fills the tile.
    whole: Vec<u32>,
    /// For each facet, whether it hides anything.
    useful: Vec<bool>,
}

impl Tiles {
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        let count = columns * rows;
        Self {
            columns,
            rows,
            all: vec![0.0; count],
            slopes: vec![Slope::default(); count],
            nearest: vec![0.0; count],
            layers: vec![[Layer::default(); 2]; count],
            last: vec![NONE; count],
            whole: vec![NONE; count],
            broken: vec![false; count],
            entries: Vec::with_capacity(RESERVED_ENTRIES),
            locals: Vec::with_capacity(RESERVED_LOCALS),
            parents: Vec::with_capacity(RESERVED_LOCALS),
            surfaces: Vec::with_capacity(RESERVED_LOCALS),
            ..Self::default()
        }
    }

    /// Makes room for this many facets.
    pub(super) fn reserve(&mut self, facets: usize) {
        self.local_of.reserve(facets);
        self.useful.reserve(facets);
    }

    /// Empties the picture.
    pub(super) fn clear(&mut self) {
        self.all.fill(0.0);
        self.nearest.fill(0.0);
        self.layers.fill([Layer::default(); 2]);
        self.last.fill(NONE);
        self.whole.fill(NONE);
        self.entries.clear();
        if std::mem::take(&mut self.is_broken) {
            self.broken.fill(false);
        }
    }

    /// Number of tiles with a covered pixel.
    pub(super) fn covered(&self) -> usize {
        self.nearest.iter().filter(|depth| **depth > 0.0).count()
    }

    #[cfg(test)]
    pub(super) fn entries(&self) -> usize {
        self.entries.len()
    }

    /// Records that a facet covers all of a tile.
    #[inline(always)]
    pub(super) fn fill_whole(&mut self, tile: usize, facet: u32, depth: &Slope) {
        if depth.end > self.all[tile] {
            (self.all[tile], self.slopes[tile], self.whole[tile]) = (depth.end, *depth, facet);
        }
    }

    /// Whether a facet hides anything.
    pub(super) fn is_useful(&self, facet: usize) -> bool {
        self.useful[facet]
    }

    /// Adds a facet's entry to a tile.
    #[inline(always)]
    pub(super) fn push(&mut self, tile: usize, entry: Entry) {
        if self.entries.len() == MOST_ENTRIES {
            (self.broken[tile], self.is_broken) = (true, true);
            return;
        }
        let before = std::mem::replace(&mut self.last[tile], self.entries.len() as u32);
        self.entries.push(Entry { before, ..entry });
    }

    /// Joins the entries of each tile to surfaces, and adds the surfaces to the tile's layers.
    #[inline(always)]
    pub(super) fn join(&mut self, facets: &[Facet]) {
        self.local_of.resize(self.local_of.len().max(facets.len()), 0);
        self.useful.clear();
        self.useful.resize(facets.len(), false);
        for tile in 0..self.all.len() {
            let at = self.last[tile];
            if at != NONE && !self.broken[tile] {
                self.surfaces.clear();
                let entry = self.entries[at as usize];
                match self.entries.get(entry.before as usize) {
                    None => self.add_alone(tile, &entry),
                    // Most often the two halves of a quad.
                    Some(&before) if before.before == NONE => self.join_two(tile, facets, [entry, before]),
                    Some(_) => {
                        self.gather(at);
                        self.join_locals(facets);
                        self.add_surfaces(tile);
                    }
                }
                // A surface no nearer than the one that covers everything is useless.
                let all = self.all[tile];
                for layer in &mut self.layers[tile] {
                    if layer.depth.end <= all {
                        *layer = Layer::default();
                    }
                }
            }
            if let Some(useful) = self.useful.get_mut(self.whole[tile] as usize) {
                *useful = true;
            }
            self.nearest[tile] = self.layers[tile][0].depth.end.max(self.all[tile]);
        }
    }

    /// Adds the only entry of a tile as a surface.
    #[inline(always)]
    fn add_alone(&mut self, tile: usize, entry: &Entry) {
        let layer = Layer { pixels: entry.covered & !entry.open, depth: entry.depth };
        if layer.pixels != 0 && self.add_surface(tile, &layer) {
            self.useful[entry.facet as usize] = true;
        }
    }

    /// Joins the only two entries of a tile, the last one first. The result is that of [`Tiles::join_locals`] and
    /// [`Tiles::add_surfaces`].
    #[inline(always)]
    fn join_two(&mut self, tile: usize, facets: &[Facet], [a, b]: [Entry; 2]) {
        // Neighbours refer to each other.
        if facets[a.facet as usize].mates.contains(&b.facet) {
            let pixels = (a.covered | b.covered) & !(a.open | b.open);
            let layer = Layer { pixels, depth: a.depth.behind_both(&b.depth) };
            if pixels != 0 && self.add_surface(tile, &layer) {
                self.useful[a.facet as usize] = true;
                self.useful[b.facet as usize] = true;
            }
            return;
        }
        let [near, far] = if a.depth.end.total_cmp(&b.depth.end).is_lt() { [b, a] } else { [a, b] };
        self.add_alone(tile, &near);
        self.add_alone(tile, &far);
    }

    /// Lists the entries of a tile.
    #[inline(always)]
    fn gather(&mut self, mut at: u32) {
        self.locals.clear();
        self.parents.clear();
        while at != NONE {
            let entry = self.entries[at as usize];
            let place = self.locals.len() as u32;
            self.local_of[entry.facet as usize] = place;
            self.locals.push(entry);
            self.parents.push(place);
            at = entry.before;
        }
    }

    #[inline(always)]
    fn root(parents: &mut [u32], mut at: u32) -> u32 {
        loop {
            let parent = parents[at as usize];
            if parent == at {
                return at;
            }
            let next = parents[parent as usize];
            parents[at as usize] = next;
            at = next;
        }
    }

    /// Joins neighbouring facets to surfaces, and finds the pixels that each surface covers wholly.
    #[inline(always)]
    fn join_locals(&mut self, facets: &[Facet]) {
        let (locals, parents) = (&mut *self.locals, &mut *self.parents);
        for i in 0..locals.len() {
            let own = locals[i].facet;
            let facet = &facets[own as usize];
            for &mate in &facet.mates[..usize::from(facet.len)] {
                // Neighbours refer to each other: once is enough. The other facet's place confirms it, or the facet is
                // not in this tile.
                if mate < own
                    && let place = self.local_of[mate as usize]
                    && locals.get(place as usize).is_some_and(|local| local.facet == mate)
                {
                    let (a, b) = (Self::root(parents, i as u32), Self::root(parents, place));
                    parents[a.max(b) as usize] = a.min(b);
                }
            }
        }
        // A root comes before all others of its surface.
        for i in 1..locals.len() {
            let root = Self::root(parents, i as u32) as usize;
            if root != i {
                let Entry { covered, open, depth, .. } = locals[i];
                let sum = &mut locals[root];
                sum.covered |= covered;
                sum.open |= open;
                sum.depth = sum.depth.behind_both(&depth);
            }
        }
        for ((local, parent), i) in locals.iter().zip(parents.iter()).zip(0..) {
            let Entry { covered, open, depth, .. } = *local;
            let pixels = covered & !open;
            if *parent == i && pixels != 0 {
                self.surfaces.push((Layer { pixels, depth }, i));
            }
        }
    }

    /// Adds the surfaces of a tile to its layers.
    #[inline(always)]
    fn add_surfaces(&mut self, tile: usize) {
        if self.surfaces.len() > 1 {
            self.surfaces.sort_unstable_by(|(a, _), (b, _)| b.depth.end.total_cmp(&a.depth.end));
        }
        for k in 0..self.surfaces.len() {
            let (surface, root) = self.surfaces[k];
            if self.add_surface(tile, &surface) {
                for i in 0..self.locals.len() {
                    if Self::root(&mut self.parents, i as u32) == root {
                        self.useful[self.locals[i].facet as usize] = true;
                    }
                }
            }
        }
    }

    /// Adds a surface to a tile. The surface must not be nearer than the surfaces added before. Returns whether
    /// it hides anything more.
    #[inline(always)]
    fn add_surface(&mut self, tile: usize, surface: &Layer) -> bool {
        let [first, second] = &mut self.layers[tile];
        if surface.depth.end <= self.all[tile] {
            return false;
        }
        if surface.pixels == u64::MAX {
            (self.all[tile], self.slopes[tile], self.whole[tile]) = (surface.depth.end, surface.depth, NONE);
            return true;
        }
        if first.pixels == 0 {
            *first = *surface;
            return true;
        }
        let before = first.pixels | second.pixels;
        if surface.pixels & !before == 0 {
            return false;
        }
        let depth = if second.pixels == 0 { surface.depth } else { second.depth.behind_both(&surface.depth) };
        *second = Layer { pixels: second.pixels | surface.pixels, depth };
        if first.pixels | second.pixels == u64::MAX {
            let depth = first.depth.behind_both(&second.depth);
            if depth.end > self.all[tile] {
                (self.all[tile], self.slopes[tile], self.whole[tile]) = (depth.end, depth, NONE);
            }
        }
        true
    }

    /// Whether a single bound covers the whole tile before the upper bound `near` of an object's reciprocal
    /// depth.
    #[inline(always)]
    pub(super) fn hides_all(&self, tile: usize, near: &Slope) -> bool {
        self.all[tile] > 0.0 && (self.all[tile] >= near.end || self.slopes[tile].is_before(near))
    }

    /// Whether the layers cover these pixels of a tile before the upper bound `near`. Call it only if
    /// [`Tiles::hides_all`] fails.
    #[inline(always)]
    pub(super) fn hides(&self, tile: usize, pixels: u64, near: &Slope) -> bool {
        let covered = |layer: &Layer| if layer.depth.is_before(near) { layer.pixels } else { 0 };
        let [first, second] = &self.layers[tile];
        pixels & !(covered(first) | covered(second)) == 0
    }

    /// Whether the pixel of a polygon's corner may be covered before the corner. `at` is the corner's position in
    /// steps, `nearness` its reciprocal depth.
    ///
    /// A bound is the farthest depth of a covering surface in a tile. The polygon touches this pixel, so it is visible if
    /// no bound of the pixel is nearer than the corner. A bound that hides the polygon is nearer in the whole tile. A corner that was rounded into
    /// the tile is an exception. The polygon then counts as visible, which is safe.
    #[inline(always)]
    pub(super) fn may_hide_corner(&self, at: [i32; 2], nearness: f64) -> bool {
        let [x, y] = at.map(|v| v >> STEP_BITS);
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return true };
        if x >= self.columns * SIDE || y >= self.rows * SIDE {
            return true;
        }
        let tile = y / SIDE * self.columns + x / SIDE;
        let bit = y % SIDE * SIDE + x % SIDE;
        let [u, v] = at.map(|v| (v & TILE_STEPS) as f32 * (1.0 / (TILE_STEPS + 1) as f32));
        let near = nearness as f32;
        let is_before = |bound: &Slope| bound.end >= near || bound.at(u, v) >= near;
        self.all[tile] > 0.0 && is_before(&self.slopes[tile])
            || self.layers[tile].iter().any(|layer| layer.pixels >> bit & 1 == 1 && is_before(&layer.depth))
    }

    /// Whether a pixel of the picture is covered before the reciprocal depth `near`, which is positive.
    #[inline(always)]
    pub(super) fn hides_pixel(&self, [x, y]: [usize; 2], near: f32) -> bool {
        let tile = y / SIDE * self.columns + x / SIDE;
        self.all[tile] >= near || self.hides(tile, 1 << (y % SIDE * SIDE + x % SIDE), &Slope::level(near))
    }

    /// Tests the pixels in these columns and rows; both ranges lie in the picture and are not empty. Returns whether
    /// all are covered before the reciprocal depth `near`, whether any may hide something at `far`, and the number of
    /// tiles read. The second result is computed only if `needed` includes it.
    #[inline(always)]
    pub(super) fn test(
        &self,
        x: [i32; 2],
        y: [i32; 2],
        near: f32,
        far: f32,
        needed: Needed,
    ) -> (bool, bool, u32) {
        let side = SIDE as i32;
        let (mut is_hidden, mut may_hide, mut steps) = (true, needed == Needed::Hidden, 0);
        let columns = (x[0] / side) as usize..((x[1] - 1) / side) as usize + 1;
        for row in y[0] / side..(y[1] - 1) / side + 1 {
            let first = row as usize * self.columns;
            let tiles = first + columns.start..first + columns.end;
            steps += columns.len() as u32;
            if is_hidden && !self.all[tiles.clone()].iter().all(|&depth| depth >= near) {
                for column in columns.clone() {
                    let tile = first + column;
                    is_hidden = self.all[tile] >= near
                        || self.hides(
                            tile,
                            pixels_within(x, y, column as i32 * side, row * side),
                            &Slope::level(near),
                        );
                    if !is_hidden {
                        break;
                    }
                }
            }
            may_hide = may_hide || self.nearest[tiles].iter().any(|&depth| depth > far);
            if !is_hidden && may_hide {
                break;
            }
        }
        (is_hidden, may_hide, steps)
    }
}

/// The pixels of a tile that lie in these columns and rows, as a mask. The tile begins at pixel (`left`,
/// `low`).
#[inline(always)]
fn pixels_within(x: [i32; 2], y: [i32; 2], left: i32, low: i32) -> u64 {
    let within = |v: i32, at: i32| (v - at).clamp(0, SIDE as i32) as u32;
    let (from, to) = (within(x[0], left), within(x[1], left));
    let row = ((1_u64 << to) - 1) & !((1_u64 << from) - 1);
    // One bit a row, spread over the row's first pixels, times the row.
    let rows = |end: u32| if end == 8 { u64::MAX } else { (1 << (8 * end)) - 1 };
    let (from, to) = (within(y[0], low), within(y[1], low));
    row.wrapping_mul(0x0101_0101_0101_0101) & rows(to) & !rows(from)
}
