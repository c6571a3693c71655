//! A tree that grows in place, for any partition of space. A polygon lies in the leaf that contains its centre. Leaves
//! split when they are full, and are joined when they have few polygons. Every node has the tight box around all
//! polygons below.

mod cull;
mod edit;

use glam::Vec3;

use super::{
    buckets::{Buckets, NOWHERE, Spot},
    by_id::{ById, InsertedBoxes},
    item::Item,
};
use osp::{
    index::{
        IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts,
        kernels::{IdWriter, Nearest},
    },
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// Number of blocks of sixteen polygons in a bucket: a bucket is a full leaf.
const BLOCKS: usize = 4;

/// The number that stands for no node.
const NONE: u32 = u32::MAX;

/// The top node.
const ROOT: u32 = 0;

/// A scheme that partitions space, such as that of a k-d tree.
pub(super) trait Partition: 'static + Send + Sync + std::fmt::Debug {
    /// The name of the index on the command line and in tables.
    const NAME: &'static str;

    /// Number of children of an inner node, at most four.
    const ARITY: usize;

    /// The extent of a node, and the split of an inner node.
    type Cell: Copy + Send + Sync + std::fmt::Debug;

    fn root_cell(&self) -> Self::Cell;

    /// A cell that contains `root` and extends towards `center`, and the number of the child that `root` becomes. [`None`]
    /// if `root` contains `center`, or if there is no larger cell.
    fn grow(&self, root: &Self::Cell, center: Vec3) -> Option<(Self::Cell, usize)>;

    /// Splits the cell of a leaf that becomes an inner node; `items` are its polygons. [`None`] if no split separates them.
    /// Every child gets at least one polygon, or all children have smaller cells.
    fn split(&self, cell: &Self::Cell, items: &mut [Item]) -> Option<Self::Cell>;

    fn child_cell(cell: &Self::Cell, child: usize) -> Self::Cell;

    /// The child of an inner node that contains a centre.
    fn child_of(&self, cell: &Self::Cell, center: Vec3) -> usize;

    /// Whether the positions of splits are computed from the polygons. If so, a subtree that has lost most of its polygons
    /// is built again.
    const FOLLOWS_POLYGONS: bool;

    /// Whether a child has too many polygons: `child` of its parent's `count`.
    fn is_lopsided(&self, count: u32, child: u32) -> bool;
}

#[derive(Clone, Copy, Debug)]
struct TreeNode<C> {
    bounds: Aabb,
    cell: C,
    parent: u32,
    /// The first of [`Partition::ARITY`] consecutive children; [`NONE`] in a leaf.
    first_child: u32,
    /// A leaf's chain of buckets.
    chain: u32,
    polygons: u32,
    /// A leaf with more polygons than this is split. If no split separates them, the number is doubled. An inner node
    /// with more polygons than this is checked for balance. For an inner node, the number is 1.5 times the number of
    /// polygons at the build.
    rebuild_at: u32,
}

impl<C> TreeNode<C> {
    fn is_leaf(&self) -> bool {
        self.first_child == NONE
    }
}

/// See [the module](self).
#[derive(Debug)]
pub(super) struct BucketTree<P: Partition> {
    partition: P,
    /// Largest number of polygons of a leaf. A subtree with half this number becomes a leaf again.
    leaf_capacity: u32,
    nodes: Vec<TreeNode<P::Cell>>,
    /// The first of a list of unused groups of [`Partition::ARITY`] nodes, linked by `parent`.
    first_free: u32,
    buckets: Buckets<BLOCKS>,
    inserted: InsertedBoxes,
    spot: ById<Spot>,
    /// Working memory of a change.
    items: Vec<Item>,
    pending: Vec<(u32, u32, u32)>,
    upkeep: Upkeep,
}

impl<P: Partition> BucketTree<P> {
    pub(super) fn new(partition: P, leaf_capacity: usize, index: &IndexConfig) -> Self {
        let mut spot = ById::new(NOWHERE);
        spot.reserve(index.room());
        let mut tree = Self {
            partition,
            leaf_capacity: leaf_capacity.clamp(1, 1 << 20) as u32,
            nodes: Vec::new(),
            first_free: NONE,
            buckets: Buckets::with_capacity(index.room()),
            inserted: InsertedBoxes::with_capacity(index.room()),
            spot,
            items: Vec::new(),
            pending: Vec::new(),
            upkeep: Upkeep::default(),
        };
        tree.init_root();
        tree
    }

    fn init_root(&mut self) {
        self.nodes.clear();
        self.first_free = NONE;
        let root = self.new_leaf(self.partition.root_cell(), NONE);
        self.nodes.push(root);
    }

    fn new_leaf(&self, cell: P::Cell, parent: u32) -> TreeNode<P::Cell> {
        TreeNode {
            bounds: Aabb::EMPTY,
            cell,
            parent,
            first_child: NONE,
            chain: super::buckets::NONE,
            polygons: 0,
            rebuild_at: self.leaf_capacity,
        }
    }

    fn node(&self, at: u32) -> &TreeNode<P::Cell> {
        &self.nodes[at as usize]
    }

    fn node_mut(&mut self, at: u32) -> &mut TreeNode<P::Cell> {
        &mut self.nodes[at as usize]
    }

    fn children(&self, at: u32) -> impl DoubleEndedIterator<Item = u32> + use<P> {
        let first = self.node(at).first_child;
        let count = if first == NONE { 0 } else { P::ARITY as u32 };
        (0..count).map(move |i| first + i)
    }
}

impl<P: Partition> SpatialIndex for BucketTree<P> {
    fn name(&self) -> &'static str {
        P::NAME
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.insert_item(&Item { bounds: *bounds, id });
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.take_out(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        let spot = self.spot.get(id);
        let owner = self.buckets.owner(spot);
        if self.leaf_for(bounds.center()) == Some(owner) {
            self.buckets.set_bounds(spot, bounds);
            self.tighten_upwards(owner);
            self.upkeep.adjusted += 1;
        } else {
            self.take_out(id);
            self.insert_item(&Item { bounds: *bounds, id });
        }
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        IdWriter::append(draw_list, |out| self.frustum_cull_all(frustum, out))
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.visit(frustum, visitor)
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = Nearest::new(t_max, hit);
        self.test_along(ray, &mut nearest);
        nearest.found()
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.upkeep)
    }

    fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<TreeNode<P::Cell>>()
            + self.buckets.bytes()
            + self.inserted.bytes()
            + self.spot.bytes()
            + self.items.capacity() * size_of::<Item>()
    }

    fn clear(&mut self) {
        self.buckets.clear();
        self.inserted.clear();
        self.spot.clear();
        self.init_root();
    }
}
