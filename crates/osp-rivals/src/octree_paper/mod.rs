//! The octree that the OSP paper compares its tree with, as the paper describes it (section 2.1 and Fig. 1(a), 4.3).
//!
//! In the paper, "to be divided among eight child nodes, each of the eight nodes is tested for whether it holds the
//! polygon". For each of the eight children, the test uses the three planes that divide the parent. The OSP tree tests
//! three planes in total. The octree is also rebuilt "under optimal conditions whenever a new model is input".
//! [`octree_rebuild`](super::octree_rebuild) is the same structure in its best form.
//!
//! # Where the text is silent
//! * *A polygon that no child contains wholly.* It stays in the node, as in the OSP tree.
//! * *Optimal conditions.* The root is the box around all polygons. A node is divided only if it has more than
//!   [`OctreePaperConfig::leaf_capacity`] polygons; it has no children without polygons.
//! * *The output.* It is exact. With [`CutNodes::Drawn`] it is the output of the paper's Fig. 6.

mod build;
mod cull;

pub(super) use build::octant;

use std::ops::Range;

use super::{
    as_printed::{CutNodes, InsertionCounts},
    by_id::InsertedBoxes,
    item::Item,
};
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};

/// The number that stands for no node.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OctreePaperConfig {
    /// A node with more polygons than this is divided.
    pub leaf_capacity: usize,
    /// The deepest level, at most [`OctreePaperConfig::DEEPEST`]. Nodes on this level are leaves of any size.
    pub max_depth: u32,
}

impl OctreePaperConfig {
    /// Largest depth of a tree.
    pub const DEEPEST: u32 = 21;
}

impl Default for OctreePaperConfig {
    fn default() -> Self {
        Self { leaf_capacity: 16, max_depth: 10 }
    }
}

/// A node. Its own polygons are consecutive, followed by the polygons of its subtree.
#[derive(Clone, Debug)]
struct Node {
    cell: Aabb,
    children: [u32; 8],
    depth: u32,
    start: u32,
    own_end: u32,
    all_end: u32,
}

impl Node {
    fn own(&self) -> Range<usize> {
        self.start as usize..self.own_end as usize
    }

    fn all(&self) -> Range<usize> {
        self.start as usize..self.all_end as usize
    }

    fn children(&self) -> impl DoubleEndedIterator<Item = u32> {
        self.children.into_iter().filter(|&child| child != NONE)
    }
}

#[derive(Debug)]
pub struct OctreePaper {
    config: OctreePaperConfig,
    cut_nodes: CutNodes,
    inserted: InsertedBoxes,
    is_due: bool,
    nodes: Vec<Node>,
    items: Vec<Item>,
    ids: Vec<PolygonId>,
    insertions: InsertionCounts,
    upkeep: Upkeep,
}

impl OctreePaper {
    pub fn new(config: OctreePaperConfig, index: &IndexConfig) -> Self {
        Self {
            config: OctreePaperConfig {
                max_depth: config.max_depth.min(OctreePaperConfig::DEEPEST),
                ..config
            },
            cut_nodes: CutNodes::default(),
            inserted: InsertedBoxes::with_capacity(index.room()),
            is_due: false,
            nodes: Vec::new(),
            items: Vec::new(),
            ids: Vec::new(),
            insertions: InsertionCounts::default(),
            upkeep: Upkeep::default(),
        }
    }

    /// Changes the treatment of nodes that the frustum cuts.
    #[must_use]
    pub fn with_cut_nodes(self, cut_nodes: CutNodes) -> Self {
        Self { cut_nodes, ..self }
    }

    /// Work counts of all builds.
    pub fn insertions(&self) -> InsertionCounts {
        self.insertions
    }
}

impl SpatialIndex for OctreePaper {
    fn name(&self) -> &'static str {
        "octree-paper"
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.is_due = true;
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.is_due = true;
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        self.is_due = true;
        Ok(())
    }

    fn may_skip_commits(&self) -> bool {
        true
    }

    fn commit(&mut self) {
        if self.is_due {
            self.rebuild();
            self.upkeep.inserted += self.items.len() as u64;
            self.upkeep.boxes += self.nodes.len() as u64;
            self.is_due = false;
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.cull(frustum, draw_list)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.visit(frustum, visitor)
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn bytes(&self) -> usize {
        self.inserted.bytes()
            + self.nodes.capacity() * size_of::<Node>()
            + self.items.capacity() * size_of::<Item>()
            + self.ids.capacity() * size_of::<PolygonId>()
    }

    fn clear(&mut self) {
        self.inserted.clear();
        self.nodes.clear();
        self.items.clear();
        self.ids.clear();
        self.is_due = false;
    }
}
