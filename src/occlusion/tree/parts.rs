//! Access to the parts of a tree, for drawings of the tree.

use glam::DVec3;

use super::{Caps, Child, ShadowTree};

impl ShadowTree {
    /// The caps of a leaf, the newest first: the unit normal of each, and its distance from the eye in metres.
    pub fn caps_of(&self, caps: Caps) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        let mut at = caps;
        std::iter::from_fn(move || {
            let cap = (at != Caps::NONE).then(|| self.cap(at))?;
            at = cap.next;
            Some((cap.normal, cap.distance_m))
        })
    }

    /// The tree of the first `planes` planes that were added. Later children are unoccluded leaves, so this tree hides
    /// nothing that the whole tree leaves visible. Takes O(planes + caps).
    #[must_use]
    pub fn first(&self, planes: usize) -> Self {
        let mut first = self.clone();
        first.nodes.truncate(planes);
        let is_later = |child: Child| child.read().is_ok_and(|node| node as usize >= planes);
        let children = first.nodes.iter_mut().flat_map(|node| [&mut node.front, &mut node.back]);
        for child in children.chain([&mut first.top]) {
            if is_later(*child) {
                *child = Child::UNOCCLUDED;
            }
        }
        first
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{CapRule, Link, Side},
        *,
    };
    use crate::{math::Aabb, occlusion::Verdict};
    use glam::Vec3;

    /// Two planes, the second behind the first, and a cap for each side of it.
    fn tree() -> ShadowTree {
        let mut tree = ShadowTree::new(2, 2, CapRule::Any);
        let above = tree.push(Link::Top, DVec3::X, 1);
        let below = tree.push(Link::Below(above, Side::Back), DVec3::Y, 2);
        tree.caps.push(super::super::Cap { normal: DVec3::Z, distance_m: 1.0, next: Caps::NONE });
        tree.caps.push(super::super::Cap { normal: DVec3::Z, distance_m: 2.0, next: Caps(0) });
        tree.set(Link::Below(above, Side::Front), Child::leaf(Caps(0)));
        tree.set(Link::Below(below, Side::Front), Child::leaf(Caps(1)));
        tree
    }

    #[test]
    fn a_leaf_lists_its_caps_from_the_newest() {
        let tree = tree();
        assert_eq!(tree.caps_of(Caps(1)).map(|(_, distance)| distance).collect::<Vec<_>>(), [2.0, 1.0]);
        assert_eq!(tree.caps_of(Caps::NONE).count(), 0);
    }

    #[test]
    fn the_first_planes_hide_only_what_they_have_proved() {
        let (right, left) =
            (Aabb::cube(Vec3::new(3.0, 3.0, 3.0), 0.1), Aabb::cube(Vec3::new(-3.0, 3.0, 3.0), 0.1));
        let hidden = [(0, false, false), (1, true, false), (2, true, true), (9, true, true)];
        for (planes, is_right_hidden, is_left_hidden) in hidden {
            let first = tree().first(planes);
            assert_eq!(first.node_count(), planes.min(2));
            assert_eq!(first.test_box(&right).verdict == Verdict::Hidden, is_right_hidden, "{planes}");
            assert_eq!(first.test_box(&left).verdict == Verdict::Hidden, is_left_hidden, "{planes}");
        }
    }
}
