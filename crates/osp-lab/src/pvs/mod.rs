//! Potentially visible sets of a finished model: for each cell of space, the polygons that are visible from the cell.
//!
//! J. Airey, J. Rohlf, F. Brooks, "Towards Image Realism with Interactive Update Rates in Complex Virtual Building
//! Environments", 1990 (view cells, sets found by sampling); S. Teller, C. Séquin, "Visibility Preprocessing for
//! Interactive Walkthroughs", 1991.
//!
//! # Differences from the papers
//! * Cells are cubes of a grid, because a sketch has no walls and doors that define cells.
//! * The sets store one bit for each cell and each group of sixteen consecutive polygons.
//!
//! The sets are **sampled, not exact**: polygons that are visible only between the sample points of a cell are missing
//! from its set. `osp verify --pvs` counts them.

mod bake;
mod file;

pub use bake::{BakeConfig, Baker};
pub use file::PvsError;

use glam::{UVec3, Vec3};
use thiserror::Error;
use xxhash_rust::xxh3::Xxh3;

use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, Geometry, PolygonId, bits},
};
use osp_session::scene::Scene;

/// Number of consecutive polygons that share a bit.
pub const GROUP: usize = 16;

/// The grid of cubic cells; each cell has a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewCells {
    /// The smallest corner, world space, metres.
    pub min: Vec3,
    /// Edge of a cell, metres.
    pub side_m: f32,
    /// Number of cells along x, y and z.
    pub count: UVec3,
}

impl ViewCells {
    /// Largest number of cells of a grid.
    pub const MOST: u32 = 1 << 20;

    /// Cubes that fill a box, `along` of them along its longest edge.
    pub fn filling(space: &Aabb, along: u32) -> Self {
        let extent = space.extent().max(Vec3::splat(1.0e-3));
        let mut along = along.max(1);
        loop {
            let side_m = extent.max_element() / along as f32;
            let count = (extent / side_m).ceil().as_uvec3().max(UVec3::ONE).min(UVec3::splat(along));
            if u64::from(count.x) * u64::from(count.y) * u64::from(count.z) <= u64::from(Self::MOST) {
                return Self { min: space.min, side_m, count };
            }
            along -= 1;
        }
    }

    pub fn len(&self) -> usize {
        self.count.element_product() as usize
    }

    /// Whether the grid has no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The cell that contains a point; `None` outside the grid.
    pub fn around(&self, p: Vec3) -> Option<usize> {
        let at = (p - self.min) / self.side_m;
        let inside = at.cmpge(Vec3::ZERO).all() && at.cmplt(self.count.as_vec3()).all();
        let at = at.as_uvec3();
        inside.then(|| ((at.z * self.count.y + at.y) * self.count.x + at.x) as usize)
    }

    /// The smallest corner of a cell.
    pub fn corner(&self, cell: usize) -> Vec3 {
        let cell = cell as u32;
        let at = UVec3::new(
            cell % self.count.x,
            cell / self.count.x % self.count.y,
            cell / self.count.x / self.count.y,
        );
        self.min + at.as_vec3() * self.side_m
    }
}

/// A fingerprint of a model: its polygons, their corners, and which polygons are occluders. Sets are valid for one
/// model only.
pub fn fingerprint_of_model(geometry: &dyn Geometry) -> u64 {
    let mut hash = Xxh3::new();
    let ids = (0..geometry.id_end() as u32).map(PolygonId);
    for id in ids.filter(|&id| geometry.is_present(id)) {
        hash.update(&id.0.to_le_bytes());
        hash.update(&[u8::from(geometry.may_occlude(id))]);
        let polygon = geometry.polygon(id);
        for corner in polygon.iter().flat_map(ConvexPolygon::vertices) {
            corner.to_array().iter().for_each(|c| hash.update(&c.to_bits().to_le_bytes()));
        }
    }
    hash.digest()
}

/// The sets of all cells.
#[derive(Clone, PartialEq)]
pub struct Pvs {
    pub cells: ViewCells,
    /// Number of polygons of the model, visible or not.
    pub polygons: usize,
    model: u64,
    /// Number of sample points of each cell.
    pub samples: u32,
    /// One bit per group, in whole words for each cell.
    sets: Vec<u64>,
}

impl std::fmt::Debug for Pvs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pvs")
            .field("cells", &self.cells)
            .field("polygons", &self.polygons)
            .field("model", &self.model)
            .finish_non_exhaustive()
    }
}

/// The error of sets that need more memory than [`Pvs::MOST_BYTES`], or than the machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "the sets of {cells} cells and {polygons} polygons take {bytes} bytes: expected at most {}, and memory for them; \
     fewer cells take less",
    Pvs::MOST_BYTES
)]
pub struct TooManySets {
    cells: usize,
    polygons: usize,
    bytes: u64,
}

impl Pvs {
    /// Largest size of all sets together, bytes.
    pub const MOST_BYTES: usize = 1 << 30;

    /// Empty sets: no polygon is visible from any cell.
    ///
    /// # Errors
    /// The sets would take too much memory.
    pub fn new(scene: &Scene, cells: ViewCells, samples: u32) -> Result<Self, TooManySets> {
        let polygons = scene.polygon_count();
        let bytes = words_of(polygons) as u64 * cells.len() as u64 * 8;
        let mut sets = Vec::new();
        if bytes > Self::MOST_BYTES as u64 || sets.try_reserve_exact(bytes as usize / 8).is_err() {
            return Err(TooManySets { cells: cells.len(), polygons, bytes });
        }
        sets.resize(bytes as usize / 8, 0);
        Ok(Self { cells, polygons, model: fingerprint_of_model(scene), samples, sets })
    }

    pub fn bytes(&self) -> usize {
        self.sets.len() * size_of::<u64>()
    }

    /// Stores the set of a cell: one bit per group, as returned by [`Baker::cell`].
    pub fn set_cell(&mut self, cell: usize, groups: &[u64]) {
        let words = words_of(self.polygons);
        self.sets[cell * words..(cell + 1) * words].copy_from_slice(groups);
    }

    /// Mean share of the groups in the set of a cell.
    pub fn mean_share(&self) -> f64 {
        let groups = self.polygons.div_ceil(GROUP) * self.cells.len();
        let ones: u64 = self.sets.iter().map(|word| u64::from(word.count_ones())).sum();
        if groups == 0 { 0.0 } else { ones as f64 / groups as f64 }
    }

    /// Appends the polygons of `in_view` that may be visible from a point; outside the grid, all of them. Returns
    /// whether the point has a set.
    pub fn cull(
        &self,
        eye_in_world: Vec3,
        in_view: impl Iterator<Item = PolygonId>,
        drawn: &mut impl Extend<PolygonId>,
    ) -> bool {
        let Some(cell) = self.cells.around(eye_in_world) else {
            drawn.extend(in_view);
            return false;
        };
        let words = words_of(self.polygons);
        let set = &self.sets[cell * words..(cell + 1) * words];
        drawn.extend(in_view.filter(|id| {
            let group = id.index() / GROUP;
            group >= set.len() * bits::WORD || bits::contains(set, group)
        }));
        true
    }
}

/// Number of words of a cell's set.
fn words_of(polygons: usize) -> usize {
    bits::words_for(polygons.div_ceil(GROUP))
}
