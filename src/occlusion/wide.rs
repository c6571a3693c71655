//! Tests sixteen boxes at once against the cells of a shadow tree. Neighbouring boxes take the same way through the tree.
//! So a plane is read once, and tested by one instruction, for all boxes that reach its node. Each box meets the planes
//! that [`ShadowTree::test_box`] would meet, with the same arithmetic, so the same boxes are hidden. If a box is in
//! front of a cap by less than its slack, it counts as partly hidden here, but as unoccluded in `test_box`. If only
//! hidden boxes are needed, the test of a box ends at the first leaf that does not hide it.

use super::{
    Needed, QUERY_SLACK, TestedBoxes,
    tree::{CapRule, Caps, Cell, Child, ShadowTree},
    verdict::{TOGETHER, one_by_one},
};
use crate::{
    index::simd::{EyeBoxes, Kernel, WithKernel},
    math::Aabb,
};

/// Depth of the deepest tree that is walked by sixteen boxes at once. Most trees have 20 to 30 levels. Every test reserves
/// an entry for each level.
const DEEPEST: usize = 63;

impl ShadowTree {
    /// Tests at most sixteen boxes. All of them lie in a box whose test ended with the cell `from`.
    pub fn test_boxes(&self, boxes: &[Aabb], from: Cell, needed: Needed) -> TestedBoxes {
        if self.depth() as usize > DEEPEST {
            return one_by_one(boxes, |bounds| self.test_box_in(bounds, from).0);
        }
        self.backend().run(TestBoxes { tree: self, boxes, from, needed })
    }
}

struct TestBoxes<'a> {
    tree: &'a ShadowTree,
    boxes: &'a [Aabb],
    from: Cell,
    needed: Needed,
}

impl WithKernel for TestBoxes<'_> {
    type Output = TestedBoxes;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> TestedBoxes {
        let Self { tree, boxes, from, needed } = self;
        let all = (1 << boxes.len().min(TOGETHER)) - 1;
        let eye_boxes = EyeBoxes::new(boxes, tree.eye_in_world(), QUERY_SLACK);
        let (mut lit, mut shadowed) = (0, if needed == Needed::Hidden { all } else { 0 });
        let (mut steps, mut planes) = (0, 0);
        // A loop replaces recursion, because a recursive function would not be compiled for the instruction set.
        let mut waiting = [(Child::UNOCCLUDED, 0_u32); DEEPEST + 1];
        let mut count = 0;
        let (mut at, mut lanes) = (tree.below(from), all);
        loop {
            lanes &= !(lit & shadowed);
            if lanes == 0 {
                if count == 0 {
                    break;
                }
                count -= 1;
                (at, lanes) = waiting[count];
                continue;
            }
            match at.read() {
                Ok(i) => {
                    let node = tree.node(i);
                    (steps, planes) = (steps + lanes.count_ones(), planes + 1);
                    let (beyond, in_front) =
                        kernel.beyond_and_in_front(node.normal.to_array(), 0.0, &eye_boxes);
                    // A NaN fails both comparisons and goes both ways.
                    let (to_front, to_back) = (lanes & (beyond | !in_front), lanes & !beyond);
                    if to_front == 0 {
                        (at, lanes) = (node.back, to_back);
                    } else {
                        if to_back != 0 {
                            waiting[count] = (node.back, to_back);
                            count += 1;
                        }
                        (at, lanes) = (node.front, to_front);
                    }
                }
                Err(Caps::NONE) => {
                    lit |= lanes;
                    lanes = 0;
                }
                Err(caps) => {
                    let mut leaf =
                        Leaf { beyond_one: 0, beyond_all: lanes, in_front_of_one: 0, in_front_of_all: lanes };
                    leaf.test(kernel, tree, caps, lanes, &eye_boxes, [&mut steps, &mut planes]);
                    let (shadow, light) = match tree.rule() {
                        CapRule::Any => (leaf.beyond_one, leaf.in_front_of_all),
                        CapRule::All => (leaf.beyond_all, leaf.in_front_of_one),
                        CapRule::Ignore => (lanes, 0),
                    };
                    shadowed |= lanes & (shadow | !light);
                    lit |= lanes & (light | !shadow);
                    lanes = 0;
                }
            }
        }
        let unoccluded = if needed == Needed::Hidden { 0 } else { all & lit & !shadowed };
        TestedBoxes { hidden: (all & !lit) as u16, unoccluded: unoccluded as u16, steps, planes }
    }
}

/// Positions of boxes relative to the caps of a leaf, a bit for each box.
struct Leaf {
    beyond_one: u32,
    beyond_all: u32,
    in_front_of_one: u32,
    in_front_of_all: u32,
}

impl Leaf {
    #[inline(always)]
    fn test<K: Kernel>(
        &mut self,
        kernel: K,
        tree: &ShadowTree,
        caps: Caps,
        lanes: u32,
        boxes: &EyeBoxes,
        [steps, planes]: [&mut u32; 2],
    ) {
        if tree.rule() == CapRule::Ignore {
            return;
        }
        let is_any = tree.rule() == CapRule::Any;
        let mut at = caps;
        while at != Caps::NONE {
            let left = if is_any { lanes & !self.beyond_one } else { lanes };
            if left == 0 {
                break;
            }
            let cap = tree.cap(at);
            (*steps, *planes) = (*steps + left.count_ones(), *planes + 1);
            let (beyond, in_front) = kernel.beyond_and_in_front(cap.normal.to_array(), cap.distance_m, boxes);
            self.beyond_one |= left & beyond;
            self.beyond_all &= beyond;
            self.in_front_of_one |= lanes & in_front;
            self.in_front_of_all &= in_front;
            at = cap.next;
        }
    }
}
