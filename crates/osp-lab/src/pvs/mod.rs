//! Potentially visible sets of a finished model: for each cell of space, the polygons that can be seen from it.
//!
//! J. Airey, J. Rohlf, F. Brooks, "Towards Image Realism with Interactive Update Rates in Complex Virtual Building
//! Environments", 1990 (view cells, sets found by sampling); S. Teller, C. Séquin, "Visibility Preprocessing for
//! Interactive Walkthroughs", 1991.
//!
//! # Differences from the papers
//! * Cells are cubes of a grid: a sketch has no walls and doors to take them from.
//! * It stores groups of sixteen consecutive polygons, as the index pages them: a bit for each cell and group.
//!
//! The sets are **sampled, not exact**: polygons visible only from between the samples of a cell are missing from its
//! set. `osp verify --pvs` counts them.

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

/// Consecutive polygons that share a bit.
pub const GROUP: usize = 16;

/// The cubes of space that have a set of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewCells {
    /// The corner with the least coordinates, world space, metres.
    pub min: Vec3,
    /// Side of a cell, metres.
    pub side_m: f32,
    /// Cells along x, y and z.
    pub count: UVec3,
}

impl ViewCells {
    /// Most cells of a grid.
    pub const MOST: u32 = 1 << 20;

    /// Cubes that fill a box, `along` of them along its longest side.
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

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.count.element_product() as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The cell around a point.
    pub fn around(&self, p: Vec3) -> Option<usize> {
        let at = (p - self.min) / self.side_m;
        let inside = at.cmpge(Vec3::ZERO).all() && at.cmplt(self.count.as_vec3()).all();
        let at = at.as_uvec3();
        inside.then(|| ((at.z * self.count.y + at.y) * self.count.x + at.x) as usize)
    }

    /// The corner of a cell with the least coordinates.
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

/// A fingerprint of a model: its polygons, their corners, and which of them are occluders. Sets are valid
/// for one model only.
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
    cells: ViewCells,
    /// Polygons of the model, visible or not.
    polygons: usize,
    model: u64,
    /// Sample points of each cell.
    samples: u32,
    /// By cell: a bit for each group, in whole words.
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

/// The error for sets that need more memory than [`Pvs::MOST_BYTES`], or than the machine has.
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
    /// Most bytes of all sets together.
    pub const MOST_BYTES: usize = 1 << 30;

    /// Empty sets: nothing is visible from any cell.
    ///
    /// # Errors
    /// They would take too much memory.
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

    /// The cells.
    pub fn cells(&self) -> &ViewCells {
        &self.cells
    }

    /// Sample points of each cell.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Polygons of the model.
    pub fn polygons(&self) -> usize {
        self.polygons
    }

    /// Bytes of all sets.
    pub fn bytes(&self) -> usize {
        self.sets.len() * size_of::<u64>()
    }

    /// Stores the set of a cell: one bit for each group, as [`Baker::cell`] makes it.
    pub fn set_cell(&mut self, cell: usize, groups: &[u64]) {
        let words = words_of(self.polygons);
        self.sets[cell * words..(cell + 1) * words].copy_from_slice(groups);
    }

    /// Share of the groups in the sets, mean over the cells.
    pub fn mean_share(&self) -> f64 {
        let groups = self.polygons.div_ceil(GROUP) * self.cells.len();
        let ones: u64 = self.sets.iter().map(|word| u64::from(word.count_ones())).sum();
        if groups == 0 { 0.0 } else { ones as f64 / groups as f64 }
    }

    /// Appends the polygons of `polygons` that may be seen from a point; all of them from outside of the cells.
    /// Returns whether the point has a set.
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

/// Words of a cell's set.
fn words_of(polygons: usize) -> usize {
    bits::words_for(polygons.div_ceil(GROUP))
}
