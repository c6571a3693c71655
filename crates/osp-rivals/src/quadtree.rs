//! A quadtree over the ground: space is divided along x and z only, as for scenes that are wider than they are high.
//!
//! Source: Raphael Finkel and Jon Bentley, "Quad Trees: A Data Structure for Retrieval on Composite Keys" (1974), in the
//! regular form with polygons in leaves (Hanan Samet, "The Quadtree and Related Hierarchical Data Structures", 1984).
//!
//! Differences: polygons are stored by the centres of their boxes, and every node has the tight box, in three dimensions,
//! around all polygons below. The root doubles towards polygons outside of it.

use glam::Vec3;

use super::{bucket_tree::Partition, item::Item};
use osp::math::Aabb;

/// Half the edge of the smallest cells, in units: 32 levels below the first root. Polygons that share such a cell stay
/// together.
const SMALLEST_HALF: f64 = 1.0 / (1u64 << 32) as f64;

/// Farthest coordinate that the root grows to, in units. All whole numbers and halves up to it are exact in `f64`, so
/// no border moves by rounding. Polygons farther out are stored as if they had this coordinate.
const FARTHEST: f64 = (1u64 << 50) as f64;

/// A partition into squares. The unit is half the first root's edge, and the origin is the first root's middle.
#[derive(Debug)]
pub(super) struct QuadPartition {
    origin_m: [f64; 2],
    unit_m: f64,
}

/// A square of the ground, by x and z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    center: [f64; 2],
    half: f64,
}

impl QuadPartition {
    /// A partition of this cube, or of a usual one in place of an unusable cube: the root grows.
    pub(super) fn new(root: &Aabb) -> Self {
        let size = f64::from(root.max.x - root.min.x).max(f64::from(root.max.z - root.min.z));
        let usable = root.is_valid() && size > 0.0 && size.is_finite();
        let (center, unit_m) = if usable { (root.center(), size * 0.5) } else { (Vec3::ZERO, 2.0) };
        Self { origin_m: [f64::from(center.x), f64::from(center.z)], unit_m }
    }

    fn on_ground(&self, p: Vec3) -> [f64; 2] {
        let p = [f64::from(p.x), f64::from(p.z)];
        std::array::from_fn(|i| ((p[i] - self.origin_m[i]) / self.unit_m).clamp(-FARTHEST, FARTHEST))
    }
}

impl Partition for QuadPartition {
    const NAME: &'static str = "quadtree";
    const ARITY: usize = 4;
    const FOLLOWS_POLYGONS: bool = false;
    type Cell = Square;

    fn root_cell(&self) -> Square {
        Square { center: [0.0; 2], half: 1.0 }
    }

    fn grow(&self, root: &Square, center: Vec3) -> Option<(Square, usize)> {
        let p = self.on_ground(center);
        // Borders belong to the same side as in `child_of`, so polygons inside stay in the old root.
        let is_inside = |i: usize| {
            let (center, half) = (root.center[i], root.half);
            p[i] >= center - half && p[i] < center + half
        };
        if is_inside(0) && is_inside(1) {
            return None;
        }
        // The old root becomes the child on the side away from the polygon.
        let mut grown = Square { center: root.center, half: 2.0 * root.half };
        let mut child = 0;
        for (i, center) in grown.center.iter_mut().enumerate() {
            if p[i] < *center {
                *center -= root.half;
                child |= 1 << i;
            } else {
                *center += root.half;
            }
        }
        Some((grown, child))
    }

    fn split(&self, cell: &Square, items: &mut [Item]) -> Option<Square> {
        let first = self.on_ground(items.first()?.bounds.center());
        let differ = items.iter().any(|item| self.on_ground(item.bounds.center()) != first);
        (differ && cell.half > SMALLEST_HALF).then_some(*cell)
    }

    fn child_cell(cell: &Square, child: usize) -> Square {
        let half = 0.5 * cell.half;
        let center = std::array::from_fn(|i| cell.center[i] + if child >> i & 1 == 1 { half } else { -half });
        Square { center, half }
    }

    fn child_of(&self, cell: &Square, center: Vec3) -> usize {
        let p = self.on_ground(center);
        usize::from(p[0] >= cell.center[0]) | usize::from(p[1] >= cell.center[1]) << 1
    }

    fn is_lopsided(&self, _count: u32, _child: u32) -> bool {
        false // Cells are regular, so the depth of a subtree depends on its polygons, not on their order.
    }
}
