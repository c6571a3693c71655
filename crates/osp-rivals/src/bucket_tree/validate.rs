use super::{BucketTree, NONE, Partition, ROOT};
use crate::buckets;
use osp::math::Aabb;

impl<P: Partition> BucketTree<P> {
    pub(super) fn check(&self) -> Result<(), String> {
        let mut reached = 1;
        let mut stack = vec![(ROOT, NONE)];
        while let Some((at, parent)) = stack.pop() {
            let node = self.node(at);
            let fault = |what: &str| Err(format!("node {at}: {what}"));
            if node.parent != parent {
                return fault("wrong parent");
            }
            let (mut bounds, mut polygons) = (Aabb::EMPTY, 0);
            if node.is_leaf() {
                self.buckets.validate_chain(node.chain, at)?;
                for (spot, item) in self.buckets.items(node.chain) {
                    if self.spot.get(item.id) != spot || self.inserted.get(item.id) != item.bounds {
                        return fault("a polygon's spot or box is wrong");
                    }
                    if self.leaf_for(item.bounds.center()) != Some(at) {
                        return fault("a polygon belongs to another leaf");
                    }
                    bounds = bounds.union(&item.bounds);
                    polygons += 1;
                }
                if polygons > node.rebuild_at {
                    return fault("too full");
                }
            } else {
                if node.chain != buckets::NONE {
                    return fault("an inner node holds polygons");
                }
                if node.polygons <= self.leaf_capacity / 2 {
                    return fault("so few polygons need no children");
                }
                for child in self.children(at) {
                    bounds = bounds.union(&self.node(child).bounds);
                    polygons += self.node(child).polygons;
                    stack.push((child, at));
                }
                reached += P::ARITY;
            }
            if polygons != node.polygons {
                return fault("wrong count");
            }
            if bounds != node.bounds {
                return fault("its box is not tight");
            }
        }
        let mut free = 0;
        let mut at = self.first_free;
        while at != NONE && free <= self.nodes.len() {
            free += P::ARITY;
            at = self.node(at).parent;
        }
        if reached + free != self.nodes.len() {
            return Err(format!("{reached} nodes in the tree, {free} free, {} made", self.nodes.len()));
        }
        if self.node(ROOT).polygons as usize != self.inserted.len() {
            return Err(format!(
                "{} polygons in the tree, {} inserted",
                self.node(ROOT).polygons,
                self.inserted.len()
            ));
        }
        Ok(())
    }
}
