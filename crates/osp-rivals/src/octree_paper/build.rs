use glam::Vec3;

use super::{NONE, Node, OctreePaper};
use crate::item::Item;
use osp::math::Aabb;

/// An octant of a cell that three planes through `center` divide. Bit `axis` of `child` is 1 for the side of larger
/// coordinates.
pub(crate) fn octant(cell: &Aabb, center: Vec3, child: usize) -> Aabb {
    let side = |axis: usize| child >> axis & 1 == 1;
    let min = std::array::from_fn(|a| if side(a) { center[a] } else { cell.min[a] });
    let max = std::array::from_fn(|a| if side(a) { cell.max[a] } else { center[a] });
    Aabb::new(Vec3::from_array(min), Vec3::from_array(max))
}

impl OctreePaper {
    pub(super) fn rebuild(&mut self) {
        self.nodes.clear();
        self.items.clear();
        self.ids.clear();
        let items: Vec<Item> =
            self.inserted.iter().map(|(id, bounds)| Item { bounds: *bounds, id }).collect();
        if !items.is_empty() {
            let cell = items.iter().fold(Aabb::EMPTY, |all, item| all.union(&item.bounds));
            self.build(items, cell, 0);
        }
    }

    /// Makes the node of a cell with its subtree; returns the node's number.
    fn build(&mut self, items: Vec<Item>, cell: Aabb, depth: u32) -> u32 {
        let number = self.nodes.len();
        let start = self.items.len() as u32;
        let node = Node { cell, children: [NONE; 8], depth, start, own_end: start, all_end: start };
        self.nodes.push(node);
        let mut parts: [Vec<Item>; 8] = Default::default();
        let is_leaf = items.len() <= self.config.leaf_capacity || depth == self.config.max_depth;
        let center = cell.center();
        for item in items {
            match (!is_leaf).then(|| self.child_of(&item.bounds, center)).flatten() {
                Some(child) => parts[child].push(item),
                None => {
                    self.ids.push(item.id);
                    self.items.push(item);
                }
            }
        }
        self.insertions.polygons += u64::from(depth == 0) * self.inserted.len() as u64;
        self.nodes[number].own_end = self.items.len() as u32;
        for (child, part) in parts.into_iter().enumerate().filter(|(_, part)| !part.is_empty()) {
            let below = self.build(part, octant(&cell, center, child), depth + 1);
            self.nodes[number].children[child] = below;
        }
        self.nodes[number].all_end = self.items.len() as u32;
        number as u32
    }

    /// The child that contains a box wholly. As in Fig. 1(a), the box is tested against the planes of each of the eight
    /// children.
    fn child_of(&mut self, bounds: &Aabb, center: Vec3) -> Option<usize> {
        let mut found = None;
        for child in 0..8 {
            let mut is_inside = true;
            for axis in 0..3 {
                is_inside &= match child >> axis & 1 {
                    1 => bounds.min[axis] > center[axis],
                    _ => bounds.max[axis] < center[axis],
                };
                self.insertions.planes += 1;
            }
            self.insertions.nodes += 1;
            if is_inside {
                found = Some(child);
            }
        }
        found
    }
}
