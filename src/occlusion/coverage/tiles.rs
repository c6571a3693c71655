//! The picture as tiles of 8 x 8 pixels. Each tile has a linear bound of the depth beyond which all of it is covered.
//! If some of its pixels are covered at nearer depths, the tile also has a depth for each pixel.

use super::{
    picture::{STEP_BITS, STEPS, pixels_between},
    slope::{ROWS, SIDE, Slope},
    table::NONE,
};
use crate::{index::simd::Kernel, occlusion::Needed};

/// Largest number of entries of a frame, 48 bytes each. [`RESERVED_ENTRIES`] is the number for which memory
/// is reserved.
const MOST_ENTRIES: usize = 1 << 18;
const RESERVED_ENTRIES: usize = 1 << 17;

/// Number of facets in one tile for which memory is reserved.
const RESERVED_LOCALS: usize = 1 << 10;

const TILE_STEPS: i32 = SIDE as i32 * STEPS as i32 - 1;

/// Facets of a surface are bounded together if their bounds differ by at most this share in the whole tile. Any share
/// is safe, as their bound is valid for each.
const FLAT: f32 = 1.0 / 500.0;

/// The part of a facet, or of a surface, in a tile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Part {
    /// Pixels whose samples it covers.
    pub(super) covered: u64,
    /// Pixels through which an edge without a neighbour passes.
    pub(super) open: u64,
    /// All pixels that it touches, and perhaps others.
    pub(super) touched: u64,
    /// A lower bound of its reciprocal depth in the tile.
    pub(super) depth: Slope,
}

/// Marks a root whose surface hides something. Its `open` then has the pixels in which the surface was the nearest.
const USEFUL: u32 = NONE - 1;

/// The part of one facet in a tile.
#[derive(Clone, Copy, Debug)]
struct Entry {
    part: Part,
    facet: u32,
    tile: u32,
    /// An earlier entry of the same surface in the tile. The first entry is the surface's root, and refers to itself.
    parent: u32,
    /// For a root, the previous root in the tile; later [`USEFUL`], if the surface hides anything.
    previous_root: u32,
    /// For a root, the last entry of its surface that it does not bound. For such an entry, the previous one.
    bent: u32,
}

/// The tiles that a facet reaches.
#[derive(Clone, Copy, Debug)]
struct Reach {
    /// The facet's first entry.
    first: u32,
    column: u32,
    row: u32,
    width: u32,
    /// Bits of the tiles with an entry, row by row, for the first 64 tiles.
    present: u64,
}

impl Reach {
    /// The number of a tile, row by row; `None` outside the facet's columns or below its rows.
    #[inline(always)]
    fn place(&self, column: usize, row: usize) -> Option<u32> {
        let (column, row) = ((column as u32).wrapping_sub(self.column), (row as u32).wrapping_sub(self.row));
        // There are at most 1,024 rows.
        if column < self.width && row <= 1024 { Some(row * self.width + column) } else { None }
    }
}

/// Number of groups of rows of a tile.
pub(super) const GROUPS: usize = SIDE * SIDE / ROWS;

/// A number for each pixel of a tile, from the lowest row up.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Depths([[f32; ROWS]; GROUPS]);

impl Depths {
    /// The smallest and the largest depth of the tile.
    #[inline(always)]
    fn ends(&self) -> [f32; 2] {
        let (mut low, mut high) = ([f32::INFINITY; ROWS], [0.0; ROWS]);
        for depths in &self.0 {
            for k in 0..ROWS {
                low[k] = if depths[k] < low[k] { depths[k] } else { low[k] };
                high[k] = if depths[k] > high[k] { depths[k] } else { high[k] };
            }
        }
        for step in [8, 4, 2, 1] {
            for k in 0..step {
                low[k] = if low[k + step] < low[k] { low[k + step] } else { low[k] };
                high[k] = if high[k + step] > high[k] { high[k + step] } else { high[k] };
            }
        }
        [low[0], high[0]]
    }
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
    /// For each tile, whether some pixels are covered nearer than by the linear bound, and the reciprocal depth at which
    /// each pixel is covered. The depths are valid only in these tiles.
    is_fine: Vec<bool>,
    depths: Vec<Depths>,
    /// For each tile, its last root.
    last: Vec<u32>,
    /// The entries of the facets, one facet after the other, ordered by tile.
    entries: Vec<Entry>,
    /// For each facet begun so far, its tiles.
    reaches: Vec<Reach>,
    /// Marks tiles that have too many entries, so that their lists are incomplete.
    broken: Vec<bool>,
    is_broken: bool,
    /// Working memory: the surfaces of the tile that is being processed.
    surfaces: Vec<(f32, u32)>,
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
            is_fine: vec![false; count],
            depths: vec![Depths([[0.0; ROWS]; GROUPS]); count],
            last: vec![NONE; count],
            whole: vec![NONE; count],
            broken: vec![false; count],
            entries: Vec::with_capacity(RESERVED_ENTRIES),
            surfaces: Vec::with_capacity(RESERVED_LOCALS),
            ..Self::default()
        }
    }

    /// Makes room for this many facets.
    pub(super) fn reserve(&mut self, facets: usize) {
        self.reaches.reserve(facets);
        self.useful.reserve(facets);
    }

    /// Empties the picture.
    pub(super) fn clear(&mut self) {
        self.all.fill(0.0);
        self.slopes.fill(Slope::default());
        self.is_fine.fill(false);
        self.last.fill(NONE);
        self.whole.fill(NONE);
        self.entries.clear();
        self.reaches.clear();
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

    /// Begins the next facet, which may reach these columns and rows of tiles. Returns whether there is room for its
    /// entries; otherwise its tiles hide nothing.
    #[inline(always)]
    pub(super) fn begin_facet(&mut self, [columns, rows]: [[usize; 2]; 2]) -> bool {
        let [width, height] = [columns, rows].map(|[from, end]| end.saturating_sub(from));
        let first = self.entries.len();
        let has_room = first + width * height <= MOST_ENTRIES;
        if !has_room {
            self.is_broken = true;
            for row in rows[0]..rows[1] {
                self.broken[row * self.columns..][columns[0]..columns[1]].fill(true);
            }
        }
        let [column, row, width] = [columns[0], rows[0], width].map(|v| v as u32);
        self.reaches.push(Reach { first: first as u32, column, row, width, present: 0 });
        has_room
    }

    /// Adds an entry of the facet begun last. The tiles of a facet must come in order, row by row.
    #[inline(always)]
    pub(super) fn push(&mut self, [column, row]: [usize; 2], facet: u32, part: Part) {
        let parent = self.entries.len() as u32;
        let tile = (row * self.columns + column) as u32;
        self.entries.push(Entry { part, facet, tile, parent, previous_root: NONE, bent: NONE });
        let reach = &mut self.reaches[facet as usize];
        let bit = |place| 1_u64.checked_shl(place);
        reach.present |= reach.place(column, row).and_then(bit).unwrap_or(0);
    }

    /// Joins the last entry, in this tile, with the entry that an earlier facet has there, if it has one.
    #[inline(always)]
    pub(super) fn unite(&mut self, [column, row]: [usize; 2], facet: u32) {
        let reach = self.reaches[facet as usize];
        let Some(place) = reach.place(column, row) else { return };
        let own = self.entries.len() as u32 - 1;
        let at = if place < u64::BITS {
            if reach.present >> place & 1 == 0 {
                return;
            }
            reach.first + (reach.present & ((1 << place) - 1)).count_ones()
        } else {
            let end = self.reaches[facet as usize + 1].first;
            let tile = self.entries[own as usize].tile;
            let entries = &self.entries[reach.first as usize..end as usize];
            let Ok(at) = entries.binary_search_by_key(&tile, |entry| entry.tile) else { return };
            reach.first + at as u32
        };
        let (a, b) = (self.root(own), self.root(at));
        self.entries[a.max(b) as usize].parent = a.min(b);
    }

    #[inline(always)]
    fn root(&mut self, mut at: u32) -> u32 {
        loop {
            let parent = self.entries[at as usize].parent;
            if parent == at {
                return at;
            }
            let next = self.entries[parent as usize].parent;
            self.entries[at as usize].parent = next;
            at = next;
        }
    }

    /// Joins the entries of each tile to surfaces, and adds the surfaces to the tile's depths. There are `facets` facets.
    #[inline(always)]
    pub(super) fn join<K: Kernel>(&mut self, kernel: K, facets: usize) {
        for number in 0..self.entries.len() {
            // A root comes before all other entries of its surface.
            let root = self.root(number as u32);
            let part = self.entries[number].part;
            if root as usize == number {
                let last = &mut self.last[self.entries[number].tile as usize];
                self.entries[number].previous_root = std::mem::replace(last, root);
            } else {
                let Entry { part: sum, bent, .. } = &mut self.entries[root as usize];
                sum.covered |= part.covered;
                sum.open |= part.open;
                let mut previous = NONE;
                if let Some(both) = sum.depth.joined(&part.depth, FLAT) {
                    sum.touched |= part.touched;
                    sum.depth = both;
                } else {
                    previous = std::mem::replace(bent, number as u32);
                }
                let entry = &mut self.entries[number];
                (entry.parent, entry.bent) = (root, previous);
            }
        }
        self.useful.clear();
        self.useful.resize(facets, false);
        for tile in 0..self.all.len() {
            if self.last[tile] != NONE && !self.broken[tile] {
                self.add_surfaces(kernel, tile);
            }
            if let Some(useful) = self.useful.get_mut(self.whole[tile] as usize) {
                *useful = true;
            }
            self.nearest[tile] = self.all[tile];
            if self.is_fine[tile] {
                let [low, high] = self.depths[tile].ends();
                self.all[tile] = self.all[tile].max(low);
                self.nearest[tile] = high;
            }
        }
        for entry in &self.entries {
            let root = &self.entries[entry.parent as usize];
            self.useful[entry.facet as usize] |=
                root.previous_root == USEFUL && root.part.open & entry.part.touched != 0;
        }
    }

    /// Adds the surfaces of a tile, the nearest first.
    #[inline(always)]
    fn add_surfaces<K: Kernel>(&mut self, kernel: K, tile: usize) {
        self.surfaces.clear();
        let mut at = self.last[tile];
        while at != NONE {
            let Entry { part: Part { covered, open, depth, .. }, previous_root, .. } =
                self.entries[at as usize];
            if covered & !open != 0 {
                self.surfaces.push((depth.end, at));
            }
            at = previous_root;
        }
        if self.surfaces.len() > 1 {
            self.surfaces.sort_unstable_by(|(a, _), (b, _)| b.total_cmp(a));
        }
        for k in 0..self.surfaces.len() {
            let (_, root) = self.surfaces[k];
            let raised = self.add_surface(kernel, tile, root);
            if raised != 0 {
                let root = &mut self.entries[root as usize];
                (root.previous_root, root.part.open) = (USEFUL, raised);
            }
        }
    }

    /// The parts of a surface that its root does not bound.
    #[inline(always)]
    fn bent(&self, root: u32) -> impl Iterator<Item = &Part> {
        let mut at = self.entries[root as usize].bent;
        std::iter::from_fn(move || {
            let Entry { part, bent, .. } = self.entries.get(at as usize)?;
            at = *bent;
            Some(part)
        })
    }

    /// Adds a surface to a tile. Returns the pixels that it covers nearer than the surfaces added before.
    #[inline(always)]
    fn add_surface<K: Kernel>(&mut self, kernel: K, tile: usize, root: u32) -> u64 {
        let surface = self.entries[root as usize].part;
        let covered = surface.covered & !surface.open;
        let is_whole = covered == u64::MAX;
        let is_flat = self.entries[root as usize].bent == NONE;
        let all = if is_flat || is_whole {
            self.bent(root).fold(surface.depth, |all, part| all.farther_of(&part.depth))
        } else {
            surface.depth
        };
        let is_nearer = all.end > self.all[tile];
        if is_flat && !is_nearer {
            return 0;
        }
        if is_flat && is_whole && !self.is_fine[tile] {
            (self.all[tile], self.slopes[tile], self.whole[tile]) = (all.end, all, NONE);
            return u64::MAX;
        }
        let mut bounds: [_; GROUPS] = std::array::from_fn(|_| [f32::INFINITY; ROWS]);
        if is_flat {
            for (group, bound) in bounds.iter_mut().enumerate() {
                *bound = all.least_in_pixels(group);
            }
        } else {
            farthest(kernel, &surface, &mut bounds);
            for part in self.bent(root).filter(|part| part.touched & covered != 0) {
                farthest(kernel, part, &mut bounds);
            }
        }
        let was_fine = std::mem::replace(&mut self.is_fine[tile], true);
        let whole = self.slopes[tile];
        let mut all_raised = 0;
        for (group, depths) in self.depths[tile].0.iter_mut().enumerate() {
            let pixels = (covered >> (group * ROWS)) as u32 & 0xFFFF;
            let before = if was_fine { *depths } else { whole.least_in_pixels(group) };
            let mut behind = [0.0; ROWS];
            for k in 0..ROWS {
                behind[k] = before[k] - bounds[group][k];
            }
            let raised = pixels & !kernel.not_negative(&behind);
            all_raised |= u64::from(raised) << (group * ROWS);
            *depths = kernel.select(raised, &bounds[group], &before);
        }
        if is_whole && is_nearer {
            (self.all[tile], self.slopes[tile], self.whole[tile]) = (all.end, all, NONE);
        }
        all_raised
    }

    /// Whether a single bound covers the whole tile in front of the upper bound `near` of an object's reciprocal
    /// depth.
    #[inline(always)]
    pub(super) fn hides_all(&self, tile: usize, near: &Slope) -> bool {
        let (all, slope) = (self.all[tile], &self.slopes[tile]);
        all > 0.0 && (all >= near.end || slope.end > 0.0 && slope.is_in_front_of(near))
    }

    /// Whether these pixels of a tile are covered in front of the upper bound `near`. Call it only if
    /// [`Tiles::hides_all`] fails.
    #[inline(always)]
    pub(super) fn hides<K: Kernel>(&self, kernel: K, tile: usize, pixels: u64, near: &Slope) -> bool {
        if !self.is_fine[tile] {
            return false;
        }
        let mut hidden = 0;
        for group in 0..GROUPS {
            let (depths, bound) = (&self.depths[tile].0[group], near.most_in_pixels(group));
            let mut margin = [0.0; ROWS];
            for k in 0..ROWS {
                margin[k] = depths[k] - bound[k];
            }
            hidden |= u64::from(kernel.not_negative(&margin)) << (group * ROWS);
        }
        pixels & !hidden == 0
    }

    /// Whether these pixels of a tile are covered in front of the reciprocal depth `near`.
    #[inline(always)]
    fn hides_level<K: Kernel>(&self, kernel: K, tile: usize, pixels: u64, near: f32) -> bool {
        if self.all[tile] >= near || !self.is_fine[tile] {
            return self.all[tile] >= near;
        }
        let mut hidden = 0;
        for group in 0..GROUPS {
            let (depths, mut margin) = (&self.depths[tile].0[group], [0.0; ROWS]);
            for k in 0..ROWS {
                margin[k] = depths[k] - near;
            }
            hidden |= u64::from(kernel.not_negative(&margin)) << (group * ROWS);
        }
        pixels & !hidden == 0
    }

    /// Whether the pixel of a polygon's corner may be covered in front of the corner. `at` is the corner's position in
    /// steps, `nearness` its reciprocal depth.
    ///
    /// A bound is the farthest depth of a covering surface in a tile or in a pixel. The polygon touches this pixel, so it is
    /// visible if no bound of the pixel is nearer than the corner. A bound that hides the polygon is nearer in the whole
    /// pixel. A corner that was rounded into the pixel is an exception. The polygon then counts as visible, which is safe.
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
        let is_in_front = |bound: &Slope| bound.end >= near || bound.at(u, v) >= near;
        self.all[tile] > 0.0 && (self.all[tile] >= near || is_in_front(&self.slopes[tile]))
            || self.is_fine[tile] && self.depths[tile].0[bit / ROWS][bit % ROWS] >= near
    }

    /// Whether a pixel of the picture is covered in front of the reciprocal depth `near`, which is positive.
    #[inline(always)]
    pub(super) fn hides_pixel(&self, [x, y]: [usize; 2], near: f32) -> bool {
        let tile = y / SIDE * self.columns + x / SIDE;
        let bit = y % SIDE * SIDE + x % SIDE;
        self.all[tile] >= near || self.is_fine[tile] && self.depths[tile].0[bit / ROWS][bit % ROWS] >= near
    }

    /// Whether all pixels in a range of corners are covered in front of the reciprocal depth `near`. The range is in steps,
    /// across and up.
    #[inline(always)]
    pub(super) fn hides_between<K: Kernel>(&self, kernel: K, ends: [[i32; 2]; 2], near: f32) -> bool {
        let [x, y] = ends.map(pixels_between);
        let within = |[from, end]: [i32; 2], tiles: usize| [from.max(0), end.min((tiles * SIDE) as i32)];
        let (x, y) = (within(x, self.columns), within(y, self.rows));
        x[0] >= x[1] || y[0] >= y[1] || self.test(kernel, x, y, near, 0.0, Needed::Hidden).0
    }

    /// Tests the pixels in these columns and rows; both ranges lie in the picture and are not empty. Returns whether
    /// all are covered in front of the reciprocal depth `near`, whether any may hide something at `far`, and the number
    /// of tiles read. The second result is computed only if `needed` includes it.
    #[inline(always)]
    pub(super) fn test<K: Kernel>(
        &self,
        kernel: K,
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
                    let pixels = pixels_within(x, y, column as i32 * side, row * side);
                    is_hidden = self.hides_level(kernel, first + column, pixels, near);
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

/// Moves the bounds of the pixels that a facet touches back to the facet's bound.
#[inline(always)]
fn farthest<K: Kernel>(kernel: K, part: &Part, bounds: &mut [[f32; ROWS]; GROUPS]) {
    for (group, bound) in bounds.iter_mut().enumerate() {
        let own = part.depth.least_in_pixels(group);
        let own = kernel.select((part.touched >> (group * ROWS)) as u32, &own, &[f32::INFINITY; ROWS]);
        for k in 0..ROWS {
            bound[k] = if own[k] < bound[k] { own[k] } else { bound[k] };
        }
    }
}

/// The pixels of a tile that lie in these columns and rows, as a mask. The tile begins at pixel (`left`,
/// `low`).
#[inline(always)]
pub(super) fn pixels_within(x: [i32; 2], y: [i32; 2], left: i32, low: i32) -> u64 {
    let within = |v: i32, at: i32| (v - at).clamp(0, SIDE as i32) as u32;
    let (from, to) = (within(x[0], left), within(x[1], left));
    let row = ((1_u64 << to) - 1) & !((1_u64 << from) - 1);
    // The product has a copy of `row` in each row of the tile.
    let rows = |end: u32| if end == 8 { u64::MAX } else { (1 << (8 * end)) - 1 };
    let (from, to) = (within(y[0], low), within(y[1], low));
    row.wrapping_mul(0x0101_0101_0101_0101) & rows(to) & !rows(from)
}
