use super::FlatTree;
use crate::{by_id::NO_POLYGON, walk_stack::WalkStack};
use osp::{
    index::kernels::{Nearest, is_wanted},
    math::Ray,
};

/// Largest number of children that are sorted by distance. More children are visited in the order of the tree.
const ORDERED: usize = 8;

impl FlatTree {
    /// Passes the polygons along a ray to `nearest`, near nodes first.
    pub(crate) fn ray_nearest(&self, ray: &Ray, nearest: &mut Nearest<'_>) {
        let Some(top) = self.nodes.first() else { return };
        let Some(t) = ray.enter_box(&top.bounds, nearest.reach()) else { return };
        let mut stack = WalkStack::from((t, 0, 0));
        while let Some((t, at, first)) = stack.pop() {
            if !is_wanted(t, nearest.reach()) {
                continue;
            }
            if self.is_leaf(at) {
                self.test_leaf(first..first + self.nodes[at].polygons as usize, ray, nearest);
                continue;
            }
            let mut ways = [(0.0, 0, 0); ORDERED];
            let (mut count, mut first) = (0, first);
            for child in self.children(at) {
                if let Some(t) = ray.enter_box(&self.nodes[child].bounds, nearest.reach()) {
                    match ways.get_mut(count) {
                        Some(way) => {
                            *way = (t, child, first);
                            count += 1;
                        }
                        None => stack.push((t, child, first)),
                    }
                }
                first += self.nodes[child].polygons as usize;
            }
            let ways = &mut ways[..count];
            ways.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            ways.iter().for_each(|&way| stack.push(way));
        }
    }

    fn test_leaf(&self, range: std::ops::Range<usize>, ray: &Ray, nearest: &mut Nearest<'_>) {
        for at in range {
            let id = self.lanes.ids()[at];
            if id != NO_POLYGON && ray.enter_box(&self.lanes.get(at), nearest.reach()).is_some() {
                nearest.test(id);
            }
        }
    }
}
