//! An octree with a bounding volume hierarchy in each of its cells, in one tree. It is rebuilt when polygons come or
//! go, and refitted when they only move.
//!
//! The cells are those of `octree-rebuild`: a polygon lies in the cell of its centre, and
//! every node has the tight box around all polygons below. The hierarchies are those of `bvh-sah`.
//! After a refit a polygon may lie outside its cell, but its node's box is still tight.

use super::{
    bvh::{BinnedSah, BinnedSahBuilder},
    flat_tree::FlatTree,
    item::Item,
    octree_rebuild::OctreeBuilder,
    rebuilt::{OnUpdate, TreeBuilder},
};

/// A cell with more polygons than this is split into octants. A larger capacity makes a smaller octree and larger
/// hierarchies.
const CELL_CAPACITY: usize = 512;
/// The deepest level of the octree. Cells on this level have any number of polygons.
const MAX_DEPTH: usize = 8;

#[derive(Debug)]
pub(super) struct OctreeBvhBuilder {
    octree: OctreeBuilder<false>,
    hierarchy: BinnedSahBuilder,
}

impl OctreeBvhBuilder {
    pub(super) fn new(sah: BinnedSah) -> Self {
        let octree = OctreeBuilder::new(CELL_CAPACITY, MAX_DEPTH);
        Self { octree, hierarchy: BinnedSahBuilder::new(sah) }
    }
}

impl TreeBuilder for OctreeBvhBuilder {
    const NAME: &'static str = "octree-bvh";
    const ON_UPDATE: OnUpdate = OnUpdate::Refit;

    fn build(&mut self, items: &mut [Item], tree: &mut FlatTree) {
        let Self { octree, hierarchy } = self;
        octree.build_cells(items, tree, |cell, depth, tree| hierarchy.build_below(cell, depth, tree));
    }

    fn bytes(&self) -> usize {
        self.octree.bytes() + self.hierarchy.bytes()
    }
}

#[cfg(test)]
mod tests {
    use crate::IndexKind;
    use glam::Vec3;
    use osp::{
        index::{IndexConfig, Node, Visit, Visitor},
        math::{Aabb, Frustum},
        polygon::PolygonId,
    };

    /// Depth and number of polygons of each node.
    struct Nodes(Vec<(u32, usize)>);

    impl Visitor for Nodes {
        fn node(&mut self, node: &Node<'_>) -> Visit {
            self.0.push((node.depth, node.polygons));
            Visit::Descend
        }

        fn polygons(&mut self, _ids: &[PolygonId], _decision: Visit) {}
    }

    #[test]
    fn eight_cells_above_and_halves_below() {
        let mut index = IndexKind::OctreeBvh.create(&IndexConfig::default());
        for id in 0..800 {
            // A hundred polygons in each corner of a cube of eight metres.
            let corner = Vec3::from_array([0, 1, 2].map(|axis| (id >> axis & 1) as f32 * 8.0));
            let along = Vec3::new((id / 8 % 10) as f32, (id / 80) as f32, 0.0) * 0.1;
            index.insert(PolygonId(id), &Aabb::cube(corner + along, 0.05)).expect("a new box");
        }
        index.commit();
        let mut nodes = Nodes(Vec::new());
        index.traverse(&Frustum::everything(), &mut nodes);
        let at = |depth| nodes.0.iter().filter(move |node| node.0 == depth).map(|node| node.1);
        assert!(at(0).eq([800]) && at(1).eq([100; 8]), "{:?}", nodes.0);
        assert_eq!((at(2).count(), at(2).sum::<usize>()), (16, 800), "two halves of each cell");
        assert!(nodes.0.iter().all(|&(depth, polygons)| depth < 12 && polygons > 0));
    }
}
