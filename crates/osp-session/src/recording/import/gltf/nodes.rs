//! Converts the tree of nodes to nested groups.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Quat, Vec3};
use gltf_json::{mesh::Semantic, scene::Node, validation::Checked};

use super::{
    Damage,
    accessor::Elements,
    container::{File, NodePlace},
    extensions,
};
use crate::recording::{
    Author, Event, GroupId, Limits, StrokeId, Transform,
    error::{Mismatch, Result},
    import::{FAR_M, axes, group_name, origin_of},
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
    /// The point that becomes the origin, metres.
    pub(super) origin: DVec3,
    /// The number of the next group that is no node of the file.
    next_group: u32,
    most_instances: usize,
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
pub(super) fn plan(file: &File, limits: &Limits, damage: &mut Damage) -> Result<Nodes> {
    let planned = plan_at(file, DVec3::ZERO, limits, damage)?;
    let [min, max] = planned.bounds(file);
    let origin = origin_of(min, max);
    if origin == DVec3::ZERO { Ok(planned) } else { plan_at(file, origin, limits, damage) }
}

fn plan_at(file: &File, origin: DVec3, limits: &Limits, damage: &mut Damage) -> Result<Nodes> {
    let nodes = &file.root.nodes;
    let has_mesh = having_meshes(nodes);
    let (next_group, most_instances) = (nodes.len() as u32, limits.strokes() as usize);
    let mut out = Nodes { planned: Vec::new(), seen: Vec::new(), origin, next_group, most_instances };
    let mut is_visited = vec![false; nodes.len()];
    let world = DAffine3::from_translation(-origin);
    let residual = world;
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
        let extensions = described.extensions.as_ref().map(|of| &of.others);
        let visible = extensions.and_then(|of| of.get(extensions::VISIBLE)?.get("visible")?.as_bool());
        if visible == Some(false) {
            continue;
        }
        let local = local_transform(file, node);
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
        let (transform, rest) = split(described, at.residual, local_transform(file, at.node));
        let place = Event::Place { author: Author::SOLE, t: 0.0, group, to: transform };
        let mut to = None;
        below.residual = match place.check() {
            // A group's transform is `f32` and would round a far place. So the vertices take the place.
            Ok(()) if below.residual.translation.abs().max_element() >= FAR_M => below.residual,
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
        let instances = match self.instances(file, described) {
            Ok(instances) => instances,
            Err(fault) => {
                let found = format!("{} in the instances of node {}", fault.found, at.node);
                damage.note(&file.path, Mismatch { found, ..fault })?;
                None
            }
        };
        let own = mesh.filter(|_| instances.is_none());
        self.planned.push(Planned { group, parent, name, to, mesh: own, residual });
        for instance in instances.into_iter().flatten() {
            let copy = GroupId(self.next_group);
            self.next_group += 1;
            let residual = residual * instance;
            self.planned.push(Planned {
                group: copy,
                parent: Some(group),
                name: None,
                to: None,
                mesh,
                residual,
            });
        }
        Ok(below)
    }

    /// The transforms of a node's copies; `None` for a node without the extension.
    fn instances(&self, file: &File, node: &Node) -> Result<Option<Vec<DAffine3>>, Mismatch> {
        let extension = node.extensions.as_ref().and_then(|of| of.others.get(extensions::INSTANCES));
        let Some(attributes) = extension.and_then(|of| of.get("attributes")) else { return Ok(None) };
        let elements = |name: &str, width: usize| {
            let accessor = attributes.get(name).and_then(|of| usize::try_from(of.as_u64()?).ok());
            let elements = accessor.map(|accessor| Elements::new(file, accessor)).transpose()?;
            match elements {
                Some(elements) if elements.width != width => {
                    Err(Mismatch::new(format!("{name} of {width} numbers"), elements.width.to_string()))
                }
                elements => Ok(elements),
            }
        };
        let places = elements("TRANSLATION", 3)?;
        let turns = elements("ROTATION", 4)?;
        let scales = elements("SCALE", 3)?;
        let count =
            [&places, &turns, &scales].into_iter().flatten().map(Elements::len).min().unwrap_or_default();
        if count > self.most_instances {
            return Err(Mismatch::new(format!("at most {} copies", self.most_instances), count.to_string()));
        }
        let of = |elements: &Option<Elements<'_>>, at: usize, usual: [f32; 4]| {
            elements.as_ref().map_or(usual, |elements| elements.vector(at, usual)).map(f64::from)
        };
        let instance = |at: usize| {
            let [x, y, z, _] = of(&places, at, [0.0; 4]);
            let [sx, sy, sz, _] = of(&scales, at, [1.0; 4]);
            let turn = DQuat::from_array(of(&turns, at, [0.0, 0.0, 0.0, 1.0]));
            let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
            DAffine3::from_scale_rotation_translation(DVec3::new(sx, sy, sz), turn, DVec3::new(x, y, z))
        };
        Ok(Some((0..count).map(instance).collect()))
    }

    /// The box of all meshes in world space, by the bounds that the accessors state.
    fn bounds(&self, file: &File) -> [DVec3; 2] {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut worlds: HashMap<GroupId, DAffine3> = HashMap::new();
        for node in &self.planned {
            let above = node.parent.and_then(|parent| worlds.get(&parent)).copied().unwrap_or_default();
            let own = node.to.map_or(DAffine3::IDENTITY, |Transform { p, q, s }| {
                DAffine3::from_scale_rotation_translation(DVec3::splat(s.into()), q.as_dquat(), p.as_dvec3())
            });
            let world = above * own;
            worlds.entry(node.group).or_insert(world);
            let mesh = node.mesh.and_then(|mesh| file.root.meshes.get(mesh));
            for primitive in mesh.iter().flat_map(|mesh| &mesh.primitives) {
                let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
                let accessor = positions.and_then(|of| file.root.accessors.get(of.value()));
                let ends = accessor.map(|of| [&of.min, &of.max].map(|end| corner(end.as_ref())));
                let Some([Some(low), Some(high)]) = ends else { continue };
                for i in 0..8 {
                    let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
                    let p = (world * node.residual).transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
                    (min, max) = (min.min(p), max.max(p));
                }
            }
        }
        [min, max]
    }
}

fn corner(numbers: Option<&gltf_json::Value>) -> Option<DVec3> {
    let numbers: Vec<f64> = numbers?.as_array()?.iter().filter_map(gltf_json::Value::as_f64).collect();
    (numbers.len() == 3).then(|| DVec3::from_slice(&numbers))
}

/// Number of triangles of a mesh, as its accessors state them.
pub(super) fn triangles(file: &File, mesh: usize) -> u64 {
    let primitives = file.root.meshes.get(mesh).into_iter().flat_map(|mesh| &mesh.primitives);
    let corners = primitives.filter_map(|primitive| {
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let accessor = primitive.indices.or(positions.copied())?;
        Some(file.root.accessors.get(accessor.value())?.count.0)
    });
    corners.sum::<u64>() / 3
}

/// Returns the roots of the file's default scene, or all nodes without a parent.
fn roots(file: &File) -> Vec<usize> {
    let number = file.root.scene.map_or(0, |scene| scene.value());
    let scenes = &file.root.scenes;
    // An empty scene stands for the first that has something.
    let other = || scenes.iter().find(|scene| !scene.nodes.is_empty());
    if let Some(scene) = scenes.get(number).filter(|scene| !scene.nodes.is_empty()).or_else(other) {
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
    Some(group_name(name))
}

fn local_transform(file: &File, number: usize) -> DAffine3 {
    let node = &file.root.nodes[number];
    let rounded = NodePlace {
        translation: node.translation.map(|p| Vec3::from(p).as_dvec3()),
        rotation: Some(rotation(node).as_dquat()),
        scale: node.scale.map(|s| Vec3::from(s).as_dvec3()),
        matrix: node.matrix.map(|matrix| DMat4::from_cols_array(&matrix.map(f64::from))),
    };
    let NodePlace { translation, rotation, scale, matrix } =
        file.places.get(number).copied().unwrap_or(rounded);
    match matrix {
        Some(matrix) => DAffine3::from_mat4(matrix),
        None => DAffine3::from_scale_rotation_translation(
            scale.unwrap_or(DVec3::ONE),
            rotation.unwrap_or_default().normalize(),
            translation.unwrap_or_default(),
        ),
    }
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
