use super::{FlatTree, MAX_DEPTH};
use crate::by_id::NO_POLYGON;
use osp::math::Aabb;

/// Whether boxes may be larger than needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tightness {
    Tight,
    Loose,
}

impl FlatTree {
    /// Checks the structure of the tree, and that every box contains all boxes below, tightly if `tight` requires that.
    pub(crate) fn validate(&self, tight: Tightness) -> Result<(), String> {
        let mut ends = Vec::new();
        let mut first = 0;
        for (at, node) in self.nodes.iter().enumerate() {
            while ends.last() == Some(&at) {
                ends.pop();
            }
            let skip = node.skip as usize;
            if skip <= at || skip > *ends.last().unwrap_or(&self.nodes.len()) {
                return Err(format!("node {at} ends at {skip}"));
            }
            let (mut bounds, mut polygons) = (Aabb::EMPTY, 0);
            if self.is_leaf(at) {
                polygons = node.polygons;
                bounds = self.lanes.bounds(first..first + polygons as usize);
                first += polygons as usize;
            } else {
                for child in self.children(at) {
                    bounds = bounds.union(&self.nodes[child].bounds);
                    polygons += self.nodes[child].polygons;
                }
                ends.push(skip);
            }
            if ends.len() > MAX_DEPTH {
                return Err(format!("node {at} is deeper than {MAX_DEPTH}"));
            }
            if polygons != node.polygons || polygons == 0 {
                return Err(format!("node {at} counts {} polygons, has {polygons}", node.polygons));
            }
            if !node.bounds.contains(&bounds) || (tight == Tightness::Tight && node.bounds != bounds) {
                return Err(format!("node {at} has the box {:?}, needs {bounds:?}", node.bounds));
            }
        }
        if first != self.len() {
            return Err(format!("{first} polygons in leaves, {} inserted", self.len()));
        }
        let holes = self.ids().iter().filter(|&&id| id == NO_POLYGON).count();
        if holes != self.holes {
            return Err(format!("{holes} holes, {} counted", self.holes));
        }
        Ok(())
    }
}
