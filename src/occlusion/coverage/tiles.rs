//! Joins the facets of each tile to surfaces, and adds the surfaces to the image.

use std::ops::Deref;

use super::{
    image::{GROUPS, Image},
    slope::{ROWS, Slope},
    table::NONE,
};
use crate::index::simd::Kernel;

/// Largest number of entries of a frame, 48 bytes each. [`RESERVED_ENTRIES`] is the number for which memory
/// is reserved.
const MOST_ENTRIES: usize = 1 << 18;
const RESERVED_ENTRIES: usize = 1 << 17;

/// Number of facets in one tile for which memory is reserved.
const RESERVED_LOCALS: usize = 1 << 10;

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

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Tiles {
    pub(super) image: Image,
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

impl Deref for Tiles {
    type Target = Image;

    fn deref(&self) -> &Image {
        &self.image
    }
}

impl Tiles {
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        let count = columns * rows;
        Self {
            image: Image::new(columns, rows),
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
        self.image.clear();
        self.last.fill(NONE);
        self.whole.fill(NONE);
        self.entries.clear();
        self.reaches.clear();
        if std::mem::take(&mut self.is_broken) {
            self.broken.fill(false);
        }
    }

    #[cfg(test)]
    pub(super) fn entries(&self) -> usize {
        self.entries.len()
    }

    /// Records that a facet covers all of a tile.
    #[inline(always)]
    pub(super) fn fill_whole(&mut self, tile: usize, facet: u32, depth: &Slope) {
        if depth.end > self.image.all[tile] {
            (self.image.all[tile], self.image.slopes[tile], self.whole[tile]) = (depth.end, *depth, facet);
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
                self.broken[row * self.image.columns..][columns[0]..columns[1]].fill(true);
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
        let tile = (row * self.image.columns + column) as u32;
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
        for tile in 0..self.image.all.len() {
            if self.last[tile] != NONE && !self.broken[tile] {
                self.add_surfaces(kernel, tile);
            }
            if let Some(useful) = self.useful.get_mut(self.whole[tile] as usize) {
                *useful = true;
            }
            self.image.nearest[tile] = self.image.all[tile];
            if self.image.is_fine[tile] {
                let [low, high] = self.image.depths[tile].ends();
                self.image.all[tile] = self.image.all[tile].max(low);
                self.image.nearest[tile] = high;
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
        let is_nearer = all.end > self.image.all[tile];
        if is_flat && !is_nearer {
            return 0;
        }
        if is_flat && is_whole && !self.image.is_fine[tile] {
            (self.image.all[tile], self.image.slopes[tile], self.whole[tile]) = (all.end, all, NONE);
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
        let was_fine = std::mem::replace(&mut self.image.is_fine[tile], true);
        let whole = self.image.slopes[tile];
        let mut all_raised = 0;
        for (group, depths) in self.image.depths[tile].0.iter_mut().enumerate() {
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
            (self.image.all[tile], self.image.slopes[tile], self.whole[tile]) = (all.end, all, NONE);
        }
        all_raised
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
