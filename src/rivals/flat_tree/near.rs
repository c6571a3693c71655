use std::{cmp::Ordering, collections::BinaryHeap};

use super::FlatTree;
use crate::{
    index::{WorkCounts, probe::NearestPolygons},
    rivals::by_id::NO_POLYGON,
};

/// A node that waits, with its distance from the point and the place of its first polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Waiting {
    pub(super) distance_m: f32,
    pub(super) node: usize,
    pub(super) first: usize,
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    /// The nearest is the greatest, so that the heap gives it first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance_m.total_cmp(&self.distance_m).then(other.node.cmp(&self.node))
    }
}

impl FlatTree {
    /// Asks about the polygons around a point, always those of the nearest node first: no order of nodes asks fewer
    /// (Gisli R. Hjaltason and Hanan Samet, "Distance Browsing in Spatial Databases", 1999).
    pub(in crate::rivals) fn ask_nearest(&self, nearest: &mut NearestPolygons<'_>) -> WorkCounts {
        let mut work = WorkCounts::default();
        let mut heap = BinaryHeap::new();
        let Some(top) = self.nodes.first() else { return work };
        heap.extend(nearest.distance_of(&top.bounds).map(|distance_m| Waiting {
            distance_m,
            node: 0,
            first: 0,
        }));
        while let Some(Waiting { node, first, .. }) = heap.pop() {
            // Others may have come nearer since it was put in; then all that wait are too far.
            if nearest.distance_of(&self.nodes[node].bounds).is_none() {
                break;
            }
            work.nodes += 1;
            if self.is_leaf(node) {
                for at in first..first + self.nodes[node].polygons as usize {
                    let id = self.lanes.ids()[at];
                    work.boxes += 1;
                    if id != NO_POLYGON && nearest.distance_of(&self.lanes.get(at)).is_some() {
                        nearest.ask(id);
                    }
                }
                continue;
            }
            let mut first = first;
            for child in self.children(node) {
                work.boxes += 1;
                let distance_m = nearest.distance_of(&self.nodes[child].bounds);
                heap.extend(distance_m.map(|distance_m| Waiting { distance_m, node: child, first }));
                first += self.nodes[child].polygons as usize;
            }
        }
        work
    }
}
