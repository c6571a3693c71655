use osp::{
    index::{
        Backend,
        kernels::{Boxes, Kernel, PlaneSet, WithKernel},
    },
    math::{Aabb, Frustum},
    polygon::{BLOCK, VisibleBlocks},
};

/// The boxes of a block's polygons in groups of sixteen, and a box around each group. A block is loaded and dropped as
/// a whole, so no box is inserted or removed. This structure takes a third of the memory of an index that supports
/// changes.
pub(super) struct PolygonBoxes {
    backend: Backend,
    sixteens: Vec<Boxes<BLOCK>>,
    /// The boxes around the groups, also in groups of sixteen.
    around: Vec<Boxes<BLOCK>>,
    pub(super) len: usize,
}

impl PolygonBoxes {
    pub(super) fn new(boxes: &[Aabb]) -> Self {
        let union = |sixteen: &[Aabb]| sixteen.iter().fold(Aabb::EMPTY, |all, one| all.union(one));
        let unions: Vec<Aabb> = boxes.chunks(BLOCK).map(union).collect();
        let (sixteens, around) = (in_sixteens(boxes), in_sixteens(&unions));
        Self { backend: Backend::detect(), sixteens, around, len: boxes.len() }
    }

    /// Adds the positions of the boxes that the frustum may see: exactly the boxes that [`Frustum::may_see`] accepts.
    pub(super) fn cull(&self, frustum: &Frustum, seen: &mut VisibleBlocks) {
        let planes = PlaneSet::new(frustum);
        self.backend.run(BoxCull { boxes: self, planes, seen });
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        (self.sixteens.capacity() + self.around.capacity()) * size_of::<Boxes<BLOCK>>()
    }
}

fn in_sixteens(all: &[Aabb]) -> Vec<Boxes<BLOCK>> {
    let sixteen = |group: &[Aabb]| {
        let mut boxes = Boxes::EMPTY;
        group.iter().enumerate().for_each(|(lane, bounds)| boxes.set(lane, bounds));
        boxes
    };
    all.chunks(BLOCK).map(sixteen).collect()
}

struct BoxCull<'a> {
    boxes: &'a PolygonBoxes,
    planes: PlaneSet,
    seen: &'a mut VisibleBlocks,
}

impl WithKernel for BoxCull<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let lanes = |count: usize| (1u32 << count.min(BLOCK)) - 1;
        let sixteens = &self.boxes.sixteens;
        for (group, around) in self.boxes.around.iter().enumerate() {
            let first = group * BLOCK;
            let mut left = lanes(sixteens.len() - first) & !self.planes.behind_any(kernel, around);
            while left != 0 {
                let at = first + left.trailing_zeros() as usize;
                left &= left - 1;
                let there = lanes(self.boxes.len - at * BLOCK);
                let seen = there & !self.planes.behind_any(kernel, &sixteens[at]);
                self.seen.insert_block(at, seen as u16);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use osp::{
        polygon::PolygonId,
        view::{Projection, View},
    };

    proptest! {
        #[test]
        fn what_is_seen_is_what_the_frustum_may_see(
            places in prop::collection::vec((prop::array::uniform3(-9.0f32..9.0), 0.0f32..2.0), 1..700),
            eye in prop::array::uniform3(-9.0f32..9.0),
        ) {
            let boxes: Vec<Aabb> = places.iter().map(|(p, size_m)| Aabb::cube(Vec3::from(*p), *size_m)).collect();
            let view = View::look_at(eye.into(), Vec3::ZERO, Projection::symmetric(50.0, 1.5, 0.1, 9.0));
            let (frustum, mut seen) = (view.frustum(), VisibleBlocks::new());
            PolygonBoxes::new(&boxes).cull(&frustum, &mut seen);
            for (i, bounds) in boxes.iter().enumerate() {
                prop_assert_eq!(seen.contains(PolygonId(i as u32)), frustum.may_see(bounds), "{}", i);
            }
        }
    }
}
