use super::tree::{Below, BoxTree, NONE};

/// Upper bound of the height of a tree of `u32` polygons, as long as the heights of siblings stay within their limit.
const MAX_HEIGHT: u32 = 300;

impl BoxTree {
    /// Checks parents, children, boxes, heights and counts, and that every node is in the tree or free.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let mut reached = 0;
        let mut stack = Vec::new();
        if self.root != NONE {
            stack.push((self.root, NONE));
        }
        while let Some((at, parent)) = stack.pop() {
            reached += 1;
            let node = self.node(at);
            if node.parent != parent {
                return Err(format!("node {at} has the parent {}, is below {parent}", node.parent));
            }
            let Below::Inner(children) = self.below(at) else {
                if node.polygons != 1 || node.height != 0 {
                    return Err(format!("leaf {at} has a height or not one polygon"));
                }
                continue;
            };
            let [a, b] = children.map(|child| self.node(child));
            if node.bounds != a.bounds.union(&b.bounds) {
                return Err(format!("node {at} does not have the box of its children"));
            }
            if node.height != a.height.max(b.height) + 1 || node.polygons != a.polygons + b.polygons {
                return Err(format!("node {at} has the wrong height or count"));
            }
            if node.height > MAX_HEIGHT {
                return Err(format!("node {at} is {} levels high", node.height));
            }
            stack.extend(children.map(|child| (child, at)));
        }
        let mut free = 0;
        let mut at = self.first_free;
        while at != NONE {
            if self.node(at).polygons != 0 || free > self.nodes.len() {
                return Err(format!("free node {at} is in use"));
            }
            free += 1;
            at = self.node(at).parent;
        }
        if reached + free != self.nodes.len() || self.links.len() != self.nodes.len() {
            return Err(format!("{reached} nodes in the tree, {free} free, {} made", self.nodes.len()));
        }
        Ok(())
    }
}
