use std::collections::BinaryHeap;

use super::FlatTree;
use crate::by_id::NO_POLYGON;
use osp::index::{
    WorkCounts,
    kernels::{NearestPolygons, SearchEntry},
};

impl FlatTree {
    /// Passes the polygons around a point to `nearest`, always the polygons of the nearest node first. No order of nodes
    /// tests fewer polygons (Gisli R. Hjaltason and Hanan Samet, "Distance Browsing in Spatial Databases", 1999).
    pub(crate) fn test_nearest(&self, nearest: &mut NearestPolygons<'_>) -> WorkCounts {
        let mut work = WorkCounts::default();
        let mut heap = BinaryHeap::new();
        let Some(top) = self.nodes.first() else { return work };
        // An entry is a node, and the position of its first polygon.
        heap.extend(nearest.distance_of(&top.bounds).map(|t| SearchEntry { t, place: (0, 0) }));
        while let Some(SearchEntry { place: (node, first), .. }) = heap.pop() {
            // The query may have found nearer polygons after this entry was added. If this node is now too far, all
            // other nodes are too far, too.
            if nearest.distance_of(&self.nodes[node].bounds).is_none() {
                break;
            }
            work.nodes += 1;
            if self.is_leaf(node) {
                for at in first..first + self.nodes[node].polygons as usize {
                    let id = self.lanes.ids()[at];
                    work.boxes += 1;
                    if id != NO_POLYGON && nearest.distance_of(&self.lanes.get(at)).is_some() {
                        nearest.test(id);
                    }
                }
                continue;
            }
            let mut first = first;
            for child in self.children(node) {
                work.boxes += 1;
                let distance_m = nearest.distance_of(&self.nodes[child].bounds);
                heap.extend(distance_m.map(|t| SearchEntry { t, place: (child, first) }));
                first += self.nodes[child].polygons as usize;
            }
        }
        work
    }
}
