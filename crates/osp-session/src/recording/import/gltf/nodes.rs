//! Converts the tree of nodes to nested groups.

use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};
use gltf_json::scene::Node;

use super::{Damage, container::File};
use crate::recording::{
    Author, Event, GroupId, StrokeId, Transform,
    error::{Mismatch, Result},
    import::axes,
};

/// Largest depth of nested groups. The mesh of a deeper node belongs to the group of an ancestor.
const MOST_DEPTH: usize = 60;
/// The scales of the axes count as equal up to this relative difference.
const SAME_SCALE: f64 = 1.0e-5;

/// A node that becomes a group.
pub(super) struct Planned {
    pub(super) group: GroupId,
    parent: Option<GroupId>,
    name: Option<String>,
    /// The group's transform. `None` for the identity, or for a node that belongs to the group of an ancestor.
    pub(super) to: Option<Transform>,
    pub(super) mesh: Option<usize>,
    /// Transform of the vertices: the part of the node's transform that the group's transform cannot represent.
    pub(super) residual: DAffine3,
}

impl Planned {
    pub(super) fn group_event(&self, strokes: Vec<StrokeId>) -> Event {
        let name = self.name.clone().filter(|_| strokes.is_empty());
        Event::Group { author: Author::SOLE, t: 0.0, group: self.group, strokes, parent: self.parent, name }
    }
}

/// A node with a camera or a light, and its world transform.
pub(super) struct Seen {
    pub(super) world: DAffine3,
    pub(super) camera: Option<usize>,
    pub(super) light: Option<usize>,
}

/// The groups, cameras and lights of the tree of nodes.
pub(super) struct Nodes {
    pub(super) planned: Vec<Planned>,
    pub(super) seen: Vec<Seen>,
}

#[derive(Clone, Copy)]
struct Visit {
    node: usize,
    /// Index in `Nodes::planned` of the parent.
    above: Option<usize>,
    depth: usize,
    residual: DAffine3,
    world: DAffine3,
}

/// Plans the nodes of the file's default scene, parents first.
pub(super) fn plan(file: &File, damage: &mut Damage) -> Result<Nodes> {
    let nodes = &file.root.nodes;
    let has_mesh = having_meshes(nodes);
    let mut out = Nodes { planned: Vec::new(), seen: Vec::new() };
    let mut is_visited = vec![false; nodes.len()];
    let (residual, world) = (DAffine3::IDENTITY, DAffine3::IDENTITY);
    let visit = |node| Visit { node, above: None, depth: 0, residual, world };
    let mut stack: Vec<Visit> = roots(file).into_iter().rev().map(visit).collect();
    while let Some(visit) = stack.pop() {
        let node = visit.node;
        let fault = match (nodes.get(node), is_visited.get(node)) {
            (None, _) => Some(Mismatch::new(format!("node {node}"), format!("{} of them", nodes.len()))),
            (_, Some(true)) => Some(Mismatch::new("a tree of nodes", format!("node {node} in it twice"))),
            _ => None,
        };
        if let Some(fault) = fault {
            damage.note(&file.path, fault)?;
            continue;
        }
        is_visited[node] = true;
        let described = &nodes[node];
        let local = local_transform(described);
        let world = visit.world * local;
        out.note_seen(described, world);
        let mut below = Visit { depth: visit.depth + 1, residual: visit.residual * local, world, ..visit };
        if has_mesh[node] {
            below = out.plan_group(file, described, visit, below, damage)?;
        }
        let children = described.children.iter().flatten().rev();
        stack.extend(children.map(|child| Visit { node: child.value(), ..below }));
    }
    Ok(out)
}

impl Nodes {
    fn note_seen(&mut self, node: &Node, world: DAffine3) {
        let camera = node.camera.map(|camera| camera.value());
        let lights = node.extensions.as_ref().and_then(|of| of.khr_lights_punctual.as_ref());
        let light = lights.map(|of| of.light.value());
        if camera.is_some() || light.is_some() {
            self.seen.push(Seen { world, camera, light });
        }
    }

    /// Plans the group of a node. Returns the visit for the node's children, with the transform that remains for their
    /// vertices.
    fn plan_group(
        &mut self,
        file: &File,
        described: &Node,
        at: Visit,
        mut below: Visit,
        damage: &mut Damage,
    ) -> Result<Visit> {
        let mesh = described.mesh.map(|mesh| mesh.value());
        let above = at.above.and_then(|above| self.planned.get(above));
        if let Some(above) = above.filter(|_| at.depth >= MOST_DEPTH) {
            // A recording would refuse a group at this depth. The node's mesh is therefore added to the ancestor's
            // group, and the node's transform is applied to the mesh.
            let (group, parent, name) = (above.group, above.parent, above.name.clone());
            self.planned.push(Planned { group, parent, name, to: None, mesh, residual: below.residual });
            return Ok(below);
        }
        let parent = above.map(|above| above.group);
        let group = GroupId(at.node as u32);
        let (transform, rest) = split(described, at.residual, local_transform(described));
        let place = Event::Place { author: Author::SOLE, t: 0.0, group, to: transform };
        let mut to = None;
        below.residual = match place.check() {
            Ok(()) => {
                to = Some(transform).filter(|to| !is_identity(to));
                rest
            }
            Err(expected) => {
                let found = format!("another transform of node {}", at.node);
                damage.note(&file.path, Mismatch::new(expected, found))?;
                DAffine3::IDENTITY
            }
        };
        below.above = Some(self.planned.len());
        let (name, residual) = (name_of(file, described), below.residual);
        self.planned.push(Planned { group, parent, name, to, mesh, residual });
        Ok(below)
    }
}

/// Returns the roots of the file's default scene, or all nodes without a parent.
fn roots(file: &File) -> Vec<usize> {
    let number = file.root.scene.map_or(0, |scene| scene.value());
    if let Some(scene) = file.root.scenes.get(number) {
        return scene.nodes.iter().map(|node| node.value()).collect();
    }
    let mut is_child = vec![false; file.root.nodes.len()];
    for child in file.root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        if let Some(is_child) = is_child.get_mut(child.value()) {
            *is_child = true;
        }
    }
    (0..is_child.len()).filter(|&node| !is_child[node]).collect()
}

fn having_meshes(nodes: &[Node]) -> Vec<bool> {
    let mut parents = vec![None; nodes.len()];
    for (node, number) in nodes.iter().zip(0..) {
        for child in node.children.iter().flatten() {
            if let Some(parent) = parents.get_mut(child.value()) {
                *parent = Some(number);
            }
        }
    }
    let mut has_mesh = vec![false; nodes.len()];
    for (node, number) in nodes.iter().zip(0..) {
        let mut at = node.mesh.map(|_| number);
        // The walk stops at a visited node, so it also ends if parents form a cycle.
        while let Some(number) = at.filter(|&number: &usize| !has_mesh[number]) {
            has_mesh[number] = true;
            at = parents[number];
        }
    }
    has_mesh
}

/// The name of the node, or that of its mesh.
fn name_of(file: &File, node: &Node) -> Option<String> {
    let mesh = || node.mesh.and_then(|mesh| file.root.meshes.get(mesh.value())?.name.as_deref());
    let name = node.name.as_deref().filter(|name| !name.is_empty()).or_else(mesh)?;
    let end =
        (0..=name.len().min(Event::MAX_GROUP_NAME_BYTES)).rev().find(|&end| name.is_char_boundary(end))?;
    Some(name[..end].to_owned())
}

fn local_transform(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        let m = matrix.map(f64::from);
        let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
        return DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        };
    }
    let [p, s] = [node.translation.unwrap_or([0.0; 3]), node.scale.unwrap_or([1.0; 3])].map(Vec3::from);
    DAffine3::from_scale_rotation_translation(
        s.as_dvec3(),
        rotation(node).as_dquat().normalize(),
        p.as_dvec3(),
    )
}

fn rotation(node: &Node) -> Quat {
    Quat::from_array(node.rotation.unwrap_or_default().0)
}

/// Splits a node's transform into a group's transform and the rest, which is applied to the vertices.
fn split(node: &Node, above: DAffine3, local: DAffine3) -> (Transform, DAffine3) {
    let scale = node.scale.unwrap_or([1.0; 3]);
    if above == DAffine3::IDENTITY && node.matrix.is_none() {
        let p = Vec3::from(node.translation.unwrap_or([0.0; 3]));
        let stored = rotation(node);
        let q = if stored == Quat::IDENTITY { stored } else { axes::unit(stored) };
        let is_even = scale[0] == scale[1] && scale[1] == scale[2] && scale[0] > 0.0;
        let rest = DAffine3::from_scale(Vec3::from(scale).as_dvec3());
        return match is_even {
            true => (Transform { p, q, s: scale[0] }, DAffine3::IDENTITY),
            false => (Transform { p, q, s: 1.0 }, rest),
        };
    }
    let whole = above * local;
    let p = whole.translation.as_vec3();
    match similarity(whole.matrix3) {
        Some((q, s)) => (Transform { p, q: q.as_quat(), s: s as f32 }, DAffine3::IDENTITY),
        None => (Transform { p, q: Quat::IDENTITY, s: 1.0 }, DAffine3::from_mat3(whole.matrix3)),
    }
}

/// The rotation and scale of a matrix; `None` if it has a shear, a mirror or non-uniform scale.
pub(super) fn similarity(m: DMat3) -> Option<(DQuat, f64)> {
    let scale = m.x_axis.length();
    let unit = m * (1.0 / scale);
    let is_even = [unit.y_axis, unit.z_axis].iter().all(|axis| (axis.length() - 1.0).abs() <= SAME_SCALE);
    let is_square = unit.x_axis.dot(unit.y_axis).abs() <= SAME_SCALE
        && unit.x_axis.cross(unit.y_axis).distance(unit.z_axis) <= SAME_SCALE;
    (is_even && is_square).then(|| (DQuat::from_mat3(&unit).normalize(), scale))
}

fn is_identity(to: &Transform) -> bool {
    *to == Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0 }
}
