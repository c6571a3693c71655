use glam::Affine3A;
use thiserror::Error;

use super::{MeshId, NodeId};
use osp::{
    index::{IndexConfig, IndexError, Osp, SpatialIndex, kernels::Mesh},
    math::Aabb,
    polygon::{PolygonId, SpacePlace},
};

/// The reason why a [`GroupIndex`] refused a change. The refused change has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum GroupError {
    #[error("mesh {}: no mesh has this number", .0.0)]
    NoMesh(MeshId),
    #[error("node {}: no node has this number", .0.0)]
    NoNode(NodeId),
    #[error("node {}: expected a parent that is not below it", .0.0)]
    Ring(NodeId),
    #[error("node {}: expected a transform of finite numbers", .0.0)]
    NotFinite(NodeId),
    #[error("mesh {}: {}", .0.0, .1)]
    Index(MeshId, IndexError),
}

#[derive(Default)]
pub(super) struct ShownMesh {
    pub(super) mesh: Mesh,
    nodes: Vec<u32>,
    /// Whether the mesh has changed since the last commit.
    has_changed: bool,
}

/// A node, with its transform and its box in the world.
pub(super) struct Node {
    pub(super) parent: Option<u32>,
    pub(super) children: Vec<u32>,
    pub(super) mesh: Option<u32>,
    /// Transform from the node's own space to its parent's.
    to_parent: Affine3A,
    /// Transform from the node's own space to the world, as of the last commit.
    pub(super) world: Affine3A,
    /// Box around the node's mesh and everything below, world space, as of the last commit.
    pub(super) bounds: Aabb,
    /// Whether the transform or the parent has changed since the last commit. `world` and `bounds` of the node and
    /// everything below are then out of date.
    has_moved: bool,
    /// Whether `bounds` is out of date, because the mesh or a node below has changed. The flag is then set in all
    /// ancestors, too.
    is_stale: bool,
}

/// Work counts of all commits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GroupWork {
    pub matrices: u64,
    /// Number of boxes of nodes computed again.
    pub boxes: u64,
    /// Number of entries changed in the index of trees.
    pub entries: u64,
}

/// Polygons in groups that move. See [`crate::groups`].
pub struct GroupIndex {
    pub(super) meshes: Vec<ShownMesh>,
    pub(super) nodes: Vec<Node>,
    /// An index of the nodes without a parent, by their numbers. Nodes with an empty box are not in it.
    pub(super) trees: Osp,
    is_in_trees: Vec<bool>,
    /// Nodes without a parent whose flag `is_stale` was set.
    stale_tops: Vec<u32>,
    changed_meshes: Vec<u32>,
    work: GroupWork,
}

impl std::fmt::Debug for GroupIndex {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GroupIndex")
            .field("meshes", &self.meshes.len())
            .field("nodes", &self.nodes.len())
            .field("work", &self.work)
            .finish_non_exhaustive()
    }
}

impl Default for GroupIndex {
    fn default() -> Self {
        Self::new(&IndexConfig { capacity: 1024, ..IndexConfig::default() })
    }
}

impl GroupIndex {
    /// An empty index; `config` configures the index of trees.
    pub fn new(config: &IndexConfig) -> Self {
        Self {
            meshes: Vec::new(),
            nodes: Vec::new(),
            trees: Osp::new(config),
            is_in_trees: Vec::new(),
            stale_tops: Vec::new(),
            changed_meshes: Vec::new(),
            work: GroupWork::default(),
        }
    }

    pub fn add_mesh(&mut self) -> MeshId {
        self.meshes.push(ShownMesh::default());
        MeshId(self.meshes.len() as u32 - 1)
    }

    /// Inserts a polygon into a mesh by its box in the mesh's space, gives it a new box, or removes it (`None`). Queries
    /// see the change after the next [`GroupIndex::commit`].
    ///
    /// # Errors
    /// The mesh does not exist, or its index refuses the box or the number.
    pub fn set_polygon(
        &mut self,
        mesh: MeshId,
        id: PolygonId,
        bounds: Option<&Aabb>,
    ) -> Result<(), GroupError> {
        let of = self.meshes.get_mut(mesh.0 as usize).ok_or(GroupError::NoMesh(mesh))?;
        of.mesh.set(id, bounds).map_err(|error| GroupError::Index(mesh, error))?;
        if !std::mem::replace(&mut of.has_changed, true) {
            self.changed_meshes.push(mesh.0);
        }
        Ok(())
    }

    /// Adds a node that shows `mesh`, or nothing of its own. Several nodes may show one mesh.
    ///
    /// # Errors
    /// The parent or the mesh does not exist, or a number is not finite.
    pub fn add_node(
        &mut self,
        parent: Option<NodeId>,
        parent_from_node: Affine3A,
        mesh: Option<MeshId>,
    ) -> Result<NodeId, GroupError> {
        let id = NodeId(self.nodes.len() as u32);
        if let Some(mesh) = mesh.filter(|mesh| mesh.0 as usize >= self.meshes.len()) {
            return Err(GroupError::NoMesh(mesh));
        }
        if let Some(parent) = parent {
            self.node(parent)?;
        }
        if !parent_from_node.is_finite() {
            return Err(GroupError::NotFinite(id));
        }
        self.nodes.push(Node {
            parent: None,
            children: Vec::new(),
            mesh: mesh.map(|mesh| mesh.0),
            to_parent: parent_from_node,
            world: Affine3A::IDENTITY,
            bounds: Aabb::EMPTY,
            has_moved: false,
            is_stale: false,
        });
        self.is_in_trees.push(false);
        if let Some(mesh) = mesh {
            self.meshes[mesh.0 as usize].nodes.push(id.0);
        }
        self.attach(id.0, parent.map(|parent| parent.0));
        self.note_moved(id.0);
        Ok(id)
    }

    /// Replaces a node's transform. Takes time proportional to the node's depth; the next [`GroupIndex::commit`] takes time
    /// proportional to the number of nodes below.
    ///
    /// # Errors
    /// The node does not exist, or a number is not finite.
    pub fn place(&mut self, node: NodeId, parent_from_node: Affine3A) -> Result<(), GroupError> {
        self.node(node)?;
        if !parent_from_node.is_finite() {
            return Err(GroupError::NotFinite(node));
        }
        self.nodes[node.0 as usize].to_parent = parent_from_node;
        self.note_moved(node.0);
        Ok(())
    }

    /// Moves a node, with everything below, under another parent, or makes it a root. The node's transform does not
    /// change, but then leads to the space of the new parent.
    ///
    /// # Errors
    /// A node does not exist, or the parent is the node itself or below it.
    pub fn set_parent(&mut self, node: NodeId, parent: Option<NodeId>) -> Result<(), GroupError> {
        self.node(node)?;
        if let Some(parent) = parent {
            self.node(parent)?;
            let mut above = Some(parent.0);
            while let Some(at) = above {
                if at == node.0 {
                    return Err(GroupError::Ring(node));
                }
                above = self.nodes[at as usize].parent;
            }
        }
        self.note_stale(node.0);
        if let Some(before) = self.nodes[node.0 as usize].parent {
            self.nodes[before as usize].children.retain(|&child| child != node.0);
        }
        self.attach(node.0, parent.map(|parent| parent.0));
        self.note_moved(node.0);
        Ok(())
    }

    fn node(&self, node: NodeId) -> Result<&Node, GroupError> {
        self.nodes.get(node.0 as usize).ok_or(GroupError::NoNode(node))
    }

    fn attach(&mut self, node: u32, parent: Option<u32>) {
        self.nodes[node as usize].parent = parent;
        if let Some(parent) = parent {
            self.nodes[parent as usize].children.push(node);
            // The node may have been the top of a tree.
            if std::mem::take(&mut self.is_in_trees[node as usize]) {
                let _ = self.trees.remove(PolygonId(node));
            }
        }
    }

    fn note_moved(&mut self, node: u32) {
        let of = &mut self.nodes[node as usize];
        // Clears the flag first, because [`Self::note_stale`] stops at a marked node, and the new ancestors may not be
        // marked yet.
        (of.has_moved, of.is_stale) = (true, false);
        self.note_stale(node);
    }

    /// Marks the node and its ancestors as out of date, up to one that is marked already.
    fn note_stale(&mut self, mut node: u32) {
        loop {
            let of = &mut self.nodes[node as usize];
            if std::mem::replace(&mut of.is_stale, true) && of.parent.is_some() {
                return;
            }
            match of.parent {
                Some(parent) => node = parent,
                None => break,
            }
        }
        self.stale_tops.push(node);
    }

    /// Ends a batch of changes: updates the matrices and boxes of everything that has changed.
    pub fn commit(&mut self) {
        let mut changed = std::mem::take(&mut self.changed_meshes);
        for mesh in changed.drain(..) {
            let of = &mut self.meshes[mesh as usize];
            of.has_changed = false;
            of.mesh.commit();
            let nodes = std::mem::take(&mut of.nodes);
            nodes.iter().for_each(|&node| self.note_stale(node));
            self.meshes[mesh as usize].nodes = nodes;
        }
        self.changed_meshes = changed;
        let mut tops = std::mem::take(&mut self.stale_tops);
        for top in tops.drain(..) {
            let of = &self.nodes[top as usize];
            // A root may be listed twice. A former root that now has a parent is refreshed together with its new root,
            // which is listed, too.
            if of.is_stale && of.parent.is_none() {
                self.refresh(top);
            }
        }
        self.stale_tops = tops;
        self.trees.commit();
    }

    /// Updates everything that has changed in a tree.
    fn refresh(&mut self, top: u32) {
        // Parents come before children. Computes the matrices in this order, and the boxes in the opposite order.
        let mut order = vec![top];
        let mut at = 0;
        while let Some(&node) = order.get(at) {
            at += 1;
            let of = &self.nodes[node as usize];
            let has_moved = of.has_moved;
            if has_moved {
                let above = of.parent.map_or(Affine3A::IDENTITY, |parent| self.nodes[parent as usize].world);
                self.nodes[node as usize].world = above * of.to_parent;
                self.work.matrices += 1;
            }
            for i in 0..self.nodes[node as usize].children.len() {
                let child = self.nodes[node as usize].children[i];
                let below = &mut self.nodes[child as usize];
                below.has_moved |= has_moved;
                if below.has_moved || below.is_stale {
                    order.push(child);
                }
            }
        }
        for &node in order.iter().rev() {
            let of = &self.nodes[node as usize];
            let own = of.mesh.map_or(Aabb::EMPTY, |mesh| {
                SpacePlace::from(of.world).world_box(self.meshes[mesh as usize].mesh.bounds())
            });
            let children = of.children.iter().map(|&child| &self.nodes[child as usize].bounds);
            let bounds = children.fold(own, |all, below| all.union(below));
            let of = &mut self.nodes[node as usize];
            (of.bounds, of.has_moved, of.is_stale) = (bounds, false, false);
            self.work.boxes += 1;
        }
        self.file_tree(top);
    }

    fn file_tree(&mut self, top: u32) {
        let bounds = self.nodes[top as usize].bounds;
        let is_in = &mut self.is_in_trees[top as usize];
        let id = PolygonId(top);
        let outcome = match (*is_in, bounds.is_valid()) {
            (true, true) => self.trees.update(id, &bounds),
            (true, false) => self.trees.remove(id),
            (false, true) => self.trees.insert(id, &bounds),
            (false, false) => return,
        };
        debug_assert_eq!(outcome, Ok(()), "a valid box of a number that is counted here");
        *is_in = bounds.is_valid();
        self.work.entries += 1;
    }

    /// The transform from a node's space to the world, as of the last commit.
    ///
    /// # Errors
    /// The node does not exist.
    pub fn world_from_node(&self, node: NodeId) -> Result<Affine3A, GroupError> {
        self.node(node).map(|node| node.world)
    }

    /// The box around a node and everything below, world space, as of the last commit; empty without polygons.
    ///
    /// # Errors
    /// The node does not exist.
    pub fn bounds(&self, node: NodeId) -> Result<Aabb, GroupError> {
        self.node(node).map(|node| node.bounds)
    }

    pub fn polygon_count(&self) -> usize {
        self.meshes.iter().map(|of| of.mesh.index().len()).sum()
    }

    pub fn work(&self) -> GroupWork {
        self.work
    }

    pub fn bytes(&self) -> usize {
        let nodes = self.nodes.iter().map(|node| size_of::<Node>() + node.children.capacity() * 4);
        self.meshes.iter().map(|of| of.mesh.bytes() + of.nodes.capacity() * 4).sum::<usize>()
            + nodes.sum::<usize>()
            + self.trees.bytes()
    }
}
