//! The same job done by other crates, each in its best form: their trees, walked with the planes that are still to be
//! tested, what is inside every plane taken without a test. Where a crate keeps its nodes to itself, its own walk is
//! used with the plane test at each node.

use std::cell::RefCell;

use bvh::bounding_hierarchy::BHShape;
use obvhs::bvh2::Bvh2;
use osp::{
    index::{DrawList, FoundPages, IndexConfig, IndexKind, Osp, SpatialIndex},
    math::{Aabb, Containment, Frustum, PlaneMask},
    scene::PolygonId,
};
use parry3d::partitioning::{Bvh as ParryBvh, BvhBuildStrategy, TraversalAction};

/// Something that is filled and asked.
pub trait Subject {
    fn insert(&mut self, id: u32, bounds: &Aabb);
    /// Ends a frame's inserts.
    fn commit(&mut self);
    fn cull(&self, frustum: &Frustum, out: &mut DrawList);
    /// Completes `out` where `cull` has answered with something shorter.
    fn list(&self, _out: &mut DrawList) {}
    fn bytes(&self) -> usize;
}

/// How a subject is made, and whether each frame builds it anew.
pub struct Kind {
    pub name: &'static str,
    pub rebuilds: bool,
    pub peer: bool,
    pub make: fn(&IndexConfig) -> Box<dyn Subject>,
}

pub const KINDS: &[Kind] = &[
    Kind { name: "osp", rebuilds: false, peer: false, make: |c| own(IndexKind::Osp, c) },
    Kind { name: "osp, as pages", rebuilds: false, peer: false, make: |c| Box::new(Pages::new(c)) },
    Kind { name: "brute-simd", rebuilds: false, peer: false, make: |c| own(IndexKind::BruteSimd, c) },
    Kind { name: "time-order", rebuilds: false, peer: false, make: |c| own(IndexKind::TimeOrder, c) },
    Kind { name: "octree-rebuild", rebuilds: true, peer: false, make: |c| own(IndexKind::OctreeRebuild, c) },
    Kind { name: "lbvh", rebuilds: true, peer: false, make: |c| own(IndexKind::Lbvh, c) },
    Kind { name: "parry3d insert", rebuilds: false, peer: true, make: |_| Box::new(Parry::default()) },
    Kind { name: "parry3d binned", rebuilds: true, peer: true, make: |_| Box::new(ParryBuilt::default()) },
    Kind { name: "obvhs insert", rebuilds: false, peer: true, make: |_| Box::new(Obvhs::default()) },
    Kind { name: "obvhs PLOC", rebuilds: true, peer: true, make: |_| Box::new(ObvhsBuilt::default()) },
    Kind { name: "rstar insert", rebuilds: false, peer: true, make: |_| Box::new(Rstar::default()) },
    Kind { name: "bvh insert", rebuilds: false, peer: true, make: |_| Box::new(BvhCrate::default()) },
];

struct Own(Box<dyn SpatialIndex>);

fn own(kind: IndexKind, config: &IndexConfig) -> Box<dyn Subject> {
    Box::new(Own(kind.create(config)))
}

impl Subject for Own {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.0.insert(PolygonId(id), bounds).expect("finite boxes, each id once");
    }

    fn commit(&mut self) {
        self.0.commit();
    }

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        self.0.frustum_cull(frustum, out);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

/// The fast tree answering with handles; they are turned into ids only where answers are compared.
struct Pages {
    tree: Osp,
    found: RefCell<FoundPages>,
}

impl Pages {
    fn new(config: &IndexConfig) -> Self {
        Self { tree: Osp::new(config), found: RefCell::default() }
    }
}

impl Subject for Pages {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.tree.insert(PolygonId(id), bounds).expect("finite boxes, each id once");
    }

    fn commit(&mut self) {
        self.tree.commit();
    }

    fn cull(&self, frustum: &Frustum, _out: &mut DrawList) {
        let mut found = self.found.borrow_mut();
        found.clear();
        self.tree.find_pages(frustum, &mut found);
    }

    fn list(&self, out: &mut DrawList) {
        self.tree.list_found(&self.found.borrow(), out);
    }

    fn bytes(&self) -> usize {
        self.tree.bytes()
    }
}

#[derive(Default)]
struct Parry(ParryBvh);

fn parry_box(bounds: &Aabb) -> parry3d::bounding_volume::Aabb {
    let corner = |v: glam::Vec3| parry3d::math::Vector::new(v.x, v.y, v.z);
    parry3d::bounding_volume::Aabb::new(corner(bounds.min), corner(bounds.max))
}

fn parry_cull(tree: &ParryBvh, frustum: &Frustum, out: &mut DrawList) {
    tree.traverse(|node| {
        let (min, max) = (node.mins(), node.maxs());
        let bounds = Aabb::new([min.x, min.y, min.z].into(), [max.x, max.y, max.z].into());
        if !frustum.may_see(&bounds) {
            return TraversalAction::Prune;
        }
        if let Some(id) = node.leaf_data() {
            out.push(PolygonId(id));
        }
        TraversalAction::Continue
    });
}

impl Subject for Parry {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.0.insert(parry_box(bounds), id);
    }

    fn commit(&mut self) {}

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        parry_cull(&self.0, frustum, out);
    }

    fn bytes(&self) -> usize {
        self.0.heap_memory_size()
    }
}

#[derive(Default)]
struct ParryBuilt {
    boxes: Vec<parry3d::bounding_volume::Aabb>,
    tree: ParryBvh,
}

impl Subject for ParryBuilt {
    fn insert(&mut self, _id: u32, bounds: &Aabb) {
        self.boxes.push(parry_box(bounds));
    }

    fn commit(&mut self) {
        self.tree = ParryBvh::from_leaves(BvhBuildStrategy::Binned, &self.boxes);
    }

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        parry_cull(&self.tree, frustum, out);
    }

    fn bytes(&self) -> usize {
        self.tree.heap_memory_size()
    }
}

#[derive(Default)]
struct Obvhs {
    tree: Bvh2,
    stack: RefCell<Vec<(u32, PlaneMask)>>,
}

fn obvhs_box(bounds: &Aabb) -> obvhs::aabb::Aabb {
    obvhs::aabb::Aabb::new(bounds.min.into(), bounds.max.into())
}

fn obvhs_cull(tree: &Bvh2, stack: &mut Vec<(u32, PlaneMask)>, frustum: &Frustum, out: &mut DrawList) {
    if tree.nodes.is_empty() {
        return;
    }
    stack.push((0, PlaneMask::ALL));
    while let Some((at, mask)) = stack.pop() {
        let node = &tree.nodes[at as usize];
        let bounds = Aabb::new(node.aabb().min.into(), node.aabb().max.into());
        let below = if mask.is_empty() {
            mask
        } else {
            match frustum.classify_masked(&bounds, mask) {
                (Containment::Outside, ..) => continue,
                (_, below, _) => below,
            }
        };
        if node.is_leaf() {
            for i in node.first_index..node.first_index + node.prim_count {
                out.push(PolygonId(tree.primitive_indices[i as usize]));
            }
        } else {
            stack.push((node.first_index, below));
            stack.push((node.first_index + 1, below));
        }
    }
}

fn obvhs_bytes(tree: &Bvh2) -> usize {
    tree.nodes.capacity() * size_of::<obvhs::bvh2::node::Bvh2Node>()
        + (tree.primitive_indices.capacity() + tree.primitives_to_nodes.capacity() + tree.parents.capacity())
            * 4
}

impl Subject for Obvhs {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.tree.insert_primitive(obvhs_box(bounds), id);
    }

    fn commit(&mut self) {}

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        obvhs_cull(&self.tree, &mut self.stack.borrow_mut(), frustum, out);
    }

    fn bytes(&self) -> usize {
        obvhs_bytes(&self.tree)
    }
}

#[derive(Default)]
struct ObvhsBuilt {
    boxes: Vec<obvhs::aabb::Aabb>,
    of: Obvhs,
}

impl Subject for ObvhsBuilt {
    fn insert(&mut self, _id: u32, bounds: &Aabb) {
        self.boxes.push(obvhs_box(bounds));
    }

    fn commit(&mut self) {
        use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
        let indices = (0..self.boxes.len() as u32).collect();
        self.of.tree =
            PlocBuilder::new().build(PlocSearchDistance::Low, &self.boxes, indices, SortPrecision::U64, 0);
        self.of.tree.reorder_in_stack_traversal_order();
    }

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        self.of.cull(frustum, out);
    }

    fn bytes(&self) -> usize {
        self.of.bytes()
    }
}

type RstarBox = rstar::primitives::GeomWithData<rstar::primitives::Rectangle<[f32; 3]>, u32>;

struct Wide;

impl rstar::RTreeParams for Wide {
    const MIN_SIZE: usize = 6;
    const MAX_SIZE: usize = 16;
    const REINSERTION_COUNT: usize = 5;
    type DefaultInsertionStrategy = rstar::RStarInsertionStrategy;
}

struct Rstar(rstar::RTree<RstarBox, Wide>);

impl Default for Rstar {
    fn default() -> Self {
        Self(rstar::RTree::new_with_params())
    }
}

fn rstar_cull(node: &rstar::ParentNode<RstarBox>, mask: PlaneMask, frustum: &Frustum, out: &mut DrawList) {
    use rstar::RTreeObject;
    for child in node.children() {
        let envelope = child.envelope();
        let below = if mask.is_empty() {
            mask
        } else {
            let bounds = Aabb::new(envelope.lower().into(), envelope.upper().into());
            match frustum.classify_masked(&bounds, mask) {
                (Containment::Outside, ..) => continue,
                (_, below, _) => below,
            }
        };
        match child {
            rstar::RTreeNode::Leaf(leaf) => out.push(PolygonId(leaf.data)),
            rstar::RTreeNode::Parent(parent) => rstar_cull(parent, below, frustum, out),
        }
    }
}

impl Subject for Rstar {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        let rectangle =
            rstar::primitives::Rectangle::from_corners(bounds.min.to_array(), bounds.max.to_array());
        self.0.insert(RstarBox::new(rectangle, id));
    }

    fn commit(&mut self) {}

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        rstar_cull(self.0.root(), PlaneMask::ALL, frustum, out);
    }

    fn bytes(&self) -> usize {
        0
    }
}

struct Shape {
    bounds: Aabb,
    node: usize,
}

impl bvh::aabb::Bounded<f32, 3> for Shape {
    fn aabb(&self) -> bvh::aabb::Aabb<f32, 3> {
        let corner = |v: glam::Vec3| nalgebra::Point3::new(v.x, v.y, v.z);
        bvh::aabb::Aabb::with_bounds(corner(self.bounds.min), corner(self.bounds.max))
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

#[derive(Default)]
struct BvhCrate {
    shapes: Vec<Shape>,
    tree: Option<bvh::bvh::Bvh<f32, 3>>,
    stack: RefCell<Vec<(usize, PlaneMask)>>,
}

impl Subject for BvhCrate {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.shapes.push(Shape { bounds: *bounds, node: 0 });
        let tree = self.tree.get_or_insert_with(|| bvh::bvh::Bvh { nodes: Vec::new() });
        tree.add_shape(&mut self.shapes, id as usize);
    }

    fn commit(&mut self) {}

    fn cull(&self, frustum: &Frustum, out: &mut DrawList) {
        let Some(tree) = &self.tree else { return };
        let mut stack = self.stack.borrow_mut();
        stack.push((0, PlaneMask::ALL));
        while let Some((at, mask)) = stack.pop() {
            match &tree.nodes[at] {
                bvh::bvh::BvhNode::Leaf { shape_index, .. } => {
                    if frustum.classify_masked(&self.shapes[*shape_index].bounds, mask).0
                        != Containment::Outside
                    {
                        out.push(PolygonId(*shape_index as u32));
                    }
                }
                bvh::bvh::BvhNode::Node {
                    child_l_index, child_l_aabb, child_r_index, child_r_aabb, ..
                } => {
                    for (child, bounds) in [(*child_l_index, child_l_aabb), (*child_r_index, child_r_aabb)] {
                        if mask.is_empty() {
                            stack.push((child, mask));
                            continue;
                        }
                        let (min, max) = (bounds.min, bounds.max);
                        let bounds = Aabb::new([min.x, min.y, min.z].into(), [max.x, max.y, max.z].into());
                        let (containment, below, _) = frustum.classify_masked(&bounds, mask);
                        if containment != Containment::Outside {
                            stack.push((child, below));
                        }
                    }
                }
            }
        }
    }

    fn bytes(&self) -> usize {
        self.tree.as_ref().map_or(0, |t| t.nodes.capacity() * size_of::<bvh::bvh::BvhNode<f32, 3>>())
            + self.shapes.capacity() * size_of::<Shape>()
    }
}
