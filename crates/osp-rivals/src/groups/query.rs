use glam::Affine3A;

use super::{GroupIndex, MeshId, NodeId, node::Node};
use osp::{
    index::{SpatialIndex, WorkCounts},
    math::{Aabb, Containment, Frustum},
    polygon::{PolygonId, VisibleBlocks},
};

/// The polygons of a mesh that a view may see.
#[derive(Clone, Copy, Debug)]
pub enum Polygons<'a> {
    All,
    /// The polygons of this set, at least one.
    Some(&'a VisibleBlocks),
}

/// A mesh in view.
#[derive(Clone, Copy, Debug)]
pub struct Found<'a> {
    pub node: NodeId,
    pub mesh: MeshId,
    /// The transform from the mesh's space to the world.
    pub world_from_mesh: &'a Affine3A,
    /// The polygons of the mesh that the view may see.
    pub polygons: Polygons<'a>,
}

/// Working memory of queries. Reuse it from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct CullScratch {
    tops: VisibleBlocks,
    polygons: VisibleBlocks,
    /// The nodes to visit, and whether everything below them is in view.
    walk: Vec<(u32, bool)>,
}

impl GroupIndex {
    /// Calls `found` for every mesh in view, once for each node that shows it, with the polygons that the frustum may see.
    pub fn frustum_cull(
        &self,
        frustum: &Frustum,
        scratch: &mut CullScratch,
        mut found: impl FnMut(Found<'_>),
    ) -> WorkCounts {
        let CullScratch { tops, polygons, walk } = scratch;
        tops.clear();
        let mut work = self.trees.frustum_cull_blocks(frustum, tops);
        (work.reported, work.taken_whole) = (0, 0);
        for PolygonId(top) in tops.ids() {
            walk.push((top, false));
            while let Some((number, is_above_inside)) = walk.pop() {
                let node = &self.nodes[number as usize];
                work.nodes += 1;
                if node.bounds.is_empty() {
                    continue;
                }
                let containment = match is_above_inside {
                    true => Containment::Inside,
                    false => {
                        work.boxes += 1;
                        frustum.classify_volume(&node.bounds)
                    }
                };
                if containment == Containment::Outside {
                    continue;
                }
                let is_inside = containment == Containment::Inside;
                if let Some((mesh, shown)) = self.shown(node, is_inside, frustum, polygons, &mut work) {
                    found(Found {
                        node: NodeId(number),
                        mesh: MeshId(mesh),
                        world_from_mesh: &node.world,
                        polygons: shown,
                    });
                }
                walk.extend(node.children.iter().rev().map(|&child| (child, is_inside)));
            }
        }
        work
    }

    /// The polygons of a node's own mesh that are in view.
    fn shown<'a>(
        &self,
        node: &Node,
        is_inside: bool,
        frustum: &Frustum,
        polygons: &'a mut VisibleBlocks,
        work: &mut WorkCounts,
    ) -> Option<(u32, Polygons<'a>)> {
        let number = node.mesh?;
        let mesh = &self.meshes[number as usize].mesh;
        let all = mesh.index().len() as u64;
        if all == 0 {
            return None;
        }
        // The mesh's box is tested in the mesh's space, because it is tighter there than in the world.
        let local = (!is_inside).then(|| in_space_of(frustum, &node.world, mesh.bounds()));
        let Some(local) = local.filter(|local| {
            work.boxes += 1;
            local.classify_volume(mesh.bounds()) != Containment::Inside
        }) else {
            work.taken_whole += all;
            work.reported += all;
            return Some((number, Polygons::All));
        };
        polygons.clear();
        *work += mesh.index().frustum_cull_blocks(&local, polygons);
        (!polygons.is_empty()).then_some((number, Polygons::Some(polygons)))
    }
}

/// The frustum in the space of a mesh, widened so that boxes within `bounds` can be tested there.
fn in_space_of(frustum: &Frustum, world_from_mesh: &Affine3A, bounds: &Aabb) -> Frustum {
    frustum.in_space(world_from_mesh).widened_for(bounds)
}
