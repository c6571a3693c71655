//! The measured structures: one that updates every moving polygon, or a group index that updates groups.

use osp_session::platform::time::Instant;

use super::world::World;
use crate::Contender;
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, Upkeep, WorkCounts},
    math::{Aabb, Frustum},
    polygon::{ConvexPolygon, PolygonId, VisibleBlocks},
};
use osp_rivals::{
    Bsp,
    groups::{CullScratch, GroupIndex, NodeId, Polygons},
};

/// The name of the group index in the tables.
pub(super) const GROUP_INDEX: &str = "group-index";

/// The input of a frame.
pub(super) struct Step<'a> {
    pub(super) frame: u64,
    pub(super) moved: &'a [(PolygonId, Aabb)],
    /// The corners of the moved polygons, for a structure that needs them.
    pub(super) shapes: Option<&'a [ConvexPolygon]>,
    /// Time to compute the boxes, if it is part of the frame.
    pub(super) boxes_ns: f64,
    pub(super) frustum: Frustum,
}

/// Times and work of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Took {
    pub(super) move_ns: f64,
    pub(super) cull_ns: f64,
    pub(super) work: WorkCounts,
}

impl Took {
    pub(super) fn total_ns(&self) -> f64 {
        (self.move_ns + self.cull_ns).max(1.0)
    }
}

/// A structure that follows a moving model and culls it.
pub(super) trait Subject {
    fn frame(&mut self, step: &Step<'_>) -> Took;

    /// Visible polygons of the last frame, for comparison.
    fn seen(&mut self, frustum: &Frustum) -> &VisibleBlocks;

    fn wants_shapes(&self) -> bool {
        false
    }

    fn upkeep(&self) -> Option<Upkeep>;

    fn bytes(&self) -> usize;
}

pub(super) struct EachPolygon {
    pub(super) index: Box<dyn SpatialIndex>,
    wants_shapes: bool,
    refused: Vec<IndexError>,
    visible: VisibleBlocks,
}

impl EachPolygon {
    pub(super) fn new(kind: Contender, world: &World<'_>) -> Self {
        let visible = VisibleBlocks::with_capacity(world.len());
        let mut index = world.filled(kind);
        let wants_shapes = Bsp::of(&mut *index).is_some();
        Self { index, wants_shapes, refused: Vec::new(), visible }
    }
}

impl Subject for EachPolygon {
    fn frame(&mut self, step: &Step<'_>) -> Took {
        let start = Instant::now();
        self.index.update_all(step.moved, &mut self.refused);
        // The polygons are in the index and their boxes are finite, so no error can occur.
        debug_assert_eq!(self.refused, []);
        if let (Some(shapes), Some(tree)) = (step.shapes, Bsp::of(&mut *self.index)) {
            step.moved.iter().zip(shapes).for_each(|((id, _), shape)| tree.shape(*id, shape));
        }
        self.index.commit();
        let move_ns = start.elapsed().as_nanos() as f64 + step.boxes_ns;
        self.visible.clear();
        let start = Instant::now();
        let work = self.index.frustum_cull_blocks(&step.frustum, &mut self.visible);
        Took { move_ns, cull_ns: start.elapsed().as_nanos() as f64, work }
    }

    fn seen(&mut self, _frustum: &Frustum) -> &VisibleBlocks {
        &self.visible
    }

    fn wants_shapes(&self) -> bool {
        self.wants_shapes
    }

    fn upkeep(&self) -> Option<Upkeep> {
        self.index.upkeep()
    }

    fn bytes(&self) -> usize {
        self.index.bytes()
    }
}

/// A group index with a node for each part of the model.
pub(super) struct EachGroup<'a> {
    world: &'a World<'a>,
    index: GroupIndex,
    scratch: CullScratch,
    visible: VisibleBlocks,
}

impl<'a> EachGroup<'a> {
    pub(super) fn new(world: &'a World<'a>) -> Self {
        let config = IndexConfig { root: world.model.root, capacity: world.parts.len() };
        let mut index = GroupIndex::new(&config);
        let mut last = None;
        for part in &world.parts {
            // Instances of the same mesh are consecutive parts.
            let mesh = match last {
                Some((range, mesh)) if range == part.mesh => mesh,
                _ => {
                    let mesh = index.add_mesh();
                    for (bounds, number) in world.model.boxes[part.mesh.clone()].iter().zip(0..) {
                        let inserted = index.set_polygon(mesh, PolygonId(number), Some(bounds));
                        debug_assert_eq!(inserted, Ok(()));
                    }
                    mesh
                }
            };
            last = Some((part.mesh.clone(), mesh));
            let node = index.add_node(None, world.place(part, 0), Some(mesh));
            debug_assert!(node.is_ok(), "places are finite");
        }
        index.commit();
        let visible = VisibleBlocks::with_capacity(world.len());
        Self { world, index, scratch: CullScratch::default(), visible }
    }
}

impl Subject for EachGroup<'_> {
    fn frame(&mut self, step: &Step<'_>) -> Took {
        let start = Instant::now();
        for (node, part) in self.world.parts.iter().enumerate().filter(|(_, part)| part.moves) {
            let placed = self.index.place(NodeId(node as u32), self.world.place(part, step.frame));
            debug_assert_eq!(placed, Ok(()));
        }
        self.index.commit();
        let move_ns = start.elapsed().as_nanos() as f64;
        let start = Instant::now();
        let work = self.index.frustum_cull(&step.frustum, &mut self.scratch, |found| {
            std::hint::black_box(found.node);
        });
        Took { move_ns, cull_ns: start.elapsed().as_nanos() as f64, work }
    }

    fn seen(&mut self, frustum: &Frustum) -> &VisibleBlocks {
        self.visible.clear();
        let (parts, visible) = (&self.world.parts, &mut self.visible);
        self.index.frustum_cull(frustum, &mut self.scratch, |found| {
            let ids = parts[found.node.0 as usize].ids();
            match found.polygons {
                Polygons::All => visible.extend(ids.map(|id| PolygonId(id as u32))),
                Polygons::Some(some) => {
                    visible.extend(some.ids().map(|PolygonId(id)| PolygonId(ids.start as u32 + id)));
                }
            }
        });
        visible
    }

    /// Counts of the index: entries of its trees, and boxes of nodes.
    fn upkeep(&self) -> Option<Upkeep> {
        let work = self.index.work();
        Some(Upkeep { adjusted: work.entries, inserted: 0, boxes: work.boxes })
    }

    fn bytes(&self) -> usize {
        self.index.bytes()
    }
}
