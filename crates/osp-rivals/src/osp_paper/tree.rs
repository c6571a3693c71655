use super::{
    grid::{Cell, OspGrid},
    node::{NONE, OspNode},
    placement::OspPlace,
};
use crate::{
    as_printed::{CutNodes, InsertionCounts},
    by_id::{ById, InsertedBoxes},
};
use osp::{
    index::{IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts},
    math::{Aabb, Frustum},
    polygon::PolygonId,
};

/// Stands in place of a node's number for a polygon outside the cube.
pub(super) const OUTSIDE: u32 = u32::MAX - 1;

/// The location of a polygon: its node, and its position in the node's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Location {
    node: u32,
    slot: u32,
}

impl Location {
    const NOWHERE: Self = Self { node: NONE, slot: 0 };
}

/// The paper's tree. See [the module](super).
#[derive(Debug)]
pub struct OspPaper {
    grid: OspGrid,
    /// The nodes, level by level; the children of node `i` are `2 i + 1` (back) and `2 i + 2` (front).
    pub(super) nodes: Vec<OspNode>,
    /// Polygons that are not wholly inside the cube.
    pub(super) outside: Vec<PolygonId>,
    pub(super) boxes: InsertedBoxes,
    pub(super) cut_nodes: CutNodes,
    insertions: InsertionCounts,
    location: ById<Location>,
}

impl OspPaper {
    /// Makes all nodes of the tree (Fig. 2), and room for `capacity` polygons.
    pub fn new(grid: OspGrid, capacity: usize) -> Self {
        let inner = (1usize << grid.max_depth()) - 1;
        let mut nodes = Vec::with_capacity(2 * inner + 1);
        let mut cells = Vec::with_capacity(inner + 1);
        cells.push(Cell::ROOT);
        for depth in 0..=grid.max_depth() {
            // Step ② for every cell of this depth: the cell's plane and eight points. Step ③: the cells of the next state.
            let mut halves = Vec::with_capacity(2 * cells.len());
            for cell in &cells {
                let i = nodes.len() as u32;
                let children = (depth < grid.max_depth()).then_some((2 * i + 2, 2 * i + 1));
                let node = OspNode::new(&grid, cell, depth, children);
                halves.extend([0, 1].map(|front| cell.half(node.axis, front)));
                nodes.push(node);
            }
            cells = halves;
        }
        let mut location = ById::new(Location::NOWHERE);
        location.reserve(capacity);
        Self {
            grid,
            nodes,
            outside: Vec::new(),
            boxes: InsertedBoxes::with_capacity(capacity),
            cut_nodes: CutNodes::default(),
            insertions: InsertionCounts::default(),
            location,
        }
    }

    /// Changes the treatment of nodes that the frustum cuts.
    #[must_use]
    pub fn with_cut_nodes(self, cut_nodes: CutNodes) -> Self {
        Self { cut_nodes, ..self }
    }

    /// Work counts of all insertions: one plane for each visited node except leaves.
    pub fn insertions(&self) -> InsertionCounts {
        self.insertions
    }

    pub fn grid(&self) -> &OspGrid {
        &self.grid
    }

    /// The node of a polygon; [`None`] if the polygon is not in the tree, or outside the cube.
    pub fn place_of(&self, id: PolygonId) -> Option<OspPlace> {
        let node = self.location.get(id).node;
        (node < OUTSIDE).then(|| OspPlace::of_node(node))
    }

    /// A node by its number: 0 is the root; behind the plane of node `i` is node `2 i + 1`, in front of it `2 i + 2`. `None`
    /// beyond the deepest level.
    pub fn node(&self, number: usize) -> Option<&OspNode> {
        self.nodes.get(number)
    }

    /// The polygons that are not wholly inside the cube, and their common box.
    pub fn outside(&self) -> (&[PolygonId], Aabb) {
        let bounds = self.outside.iter().fold(Aabb::EMPTY, |all, &id| all.union(&self.boxes.get(id)));
        (&self.outside, bounds)
    }

    /// Inserts a polygon by the descent of Fig. 5, from the root.
    fn insert_polygon(&mut self, id: PolygonId, bounds: &Aabb) {
        self.insertions.polygons += 1;
        if !self.grid.root_box().contains(bounds) {
            self.location.set(id, Location { node: OUTSIDE, slot: self.outside.len() as u32 });
            self.outside.push(id);
            return;
        }
        let mut at = 0;
        loop {
            let node = &mut self.nodes[at as usize];
            node.polygons += 1;
            self.insertions.planes += u64::from(!node.is_leaf);
            // The normal is an axis, so the smallest corner of the box has the smallest distance of all vertices.
            let in_front = node.splitter.signed_distance(bounds.min) > 0.0;
            let behind = node.splitter.signed_distance(bounds.max) < 0.0;
            if node.is_leaf || !(in_front || behind) {
                // The node is a leaf, or its plane cuts or contains the polygon.
                node.is_polygon = true;
                self.location.set(id, Location { node: at, slot: node.tri_names.len() as u32 });
                node.tri_names.push(id);
                return;
            }
            node.is_subnode = true;
            at = if in_front { node.front } else { node.back };
        }
    }

    /// Removes a polygon from its list, and updates the flags above.
    fn take_out(&mut self, id: PolygonId) {
        let Location { node: at, slot } = self.location.get(id);
        self.location.set(id, Location::NOWHERE);
        let list = if at == OUTSIDE { &mut self.outside } else { &mut self.nodes[at as usize].tri_names };
        list.swap_remove(slot as usize);
        if let Some(&moved) = list.get(slot as usize) {
            self.location.set(moved, Location { node: at, slot });
        }
        if at == OUTSIDE {
            return;
        }
        let mut at = at as usize;
        loop {
            let node = &mut self.nodes[at];
            node.polygons -= 1;
            node.is_polygon = !node.tri_names.is_empty();
            node.is_subnode = node.polygons as usize > node.tri_names.len();
            if at == 0 {
                return;
            }
            at = (at - 1) / 2;
        }
    }
}

impl SpatialIndex for OspPaper {
    fn name(&self) -> &'static str {
        "osp-paper"
    }

    fn len(&self) -> usize {
        self.boxes.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.boxes.insert(id, bounds)?;
        self.insert_polygon(id, bounds);
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.boxes.remove(id)?;
        self.take_out(id);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.boxes.update(id, bounds)?;
        self.take_out(id);
        self.insert_polygon(id, bounds);
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.cull(frustum, draw_list)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.visit(frustum, visitor)
    }

    /// The cells are fixed, so only insertions count.
    fn upkeep(&self) -> Option<Upkeep> {
        Some(Upkeep { inserted: self.insertions.polygons, ..Upkeep::default() })
    }

    fn bytes(&self) -> usize {
        let lists: usize = self.nodes.iter().map(|node| node.tri_names.capacity()).sum();
        self.nodes.capacity() * size_of::<OspNode>()
            + (lists + self.outside.capacity()) * size_of::<PolygonId>()
            + self.boxes.bytes()
            + self.location.bytes()
    }

    fn clear(&mut self) {
        for node in self.nodes.iter_mut().filter(|node| node.polygons > 0) {
            node.tri_names.clear();
            (node.is_polygon, node.is_subnode, node.polygons) = (false, false, 0);
        }
        self.outside.clear();
        self.boxes.clear();
        self.location.clear();
    }
}
