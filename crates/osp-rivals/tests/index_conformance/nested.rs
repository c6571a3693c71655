//! The shipped session of nested groups in an index of groups. Each group is a node with a mesh of its own.

use std::collections::HashMap;

use osp::{
    glam::{Affine3A, Vec3},
    math::Aabb,
    polygon::PolygonId,
    view::{Projection, View},
};
use osp_rivals::groups::{CullScratch, GroupIndex, MeshId, NodeId, Polygons};
use osp_session::{
    recording::{Event, GroupId, StrokeId},
    scene::Scene,
};
use osp_testkit::events::events_in;

/// The groups of a scene as it grows. A mesh contains the strokes of its group in the form that they had when the group was
/// made.
#[derive(Default)]
struct Followed {
    index: GroupIndex,
    nodes: HashMap<GroupId, (NodeId, MeshId)>,
    /// For each node, the polygons of its mesh, by their numbers in the mesh.
    polygons: HashMap<NodeId, Vec<PolygonId>>,
}

impl Followed {
    /// Applies an event before the scene does, while strokes are still where they were drawn, in the space of their group.
    fn take(&mut self, scene: &Scene, event: &Event) {
        match event {
            Event::Group { group, strokes, parent, .. } => {
                let parent = parent.map(|parent| self.nodes[&parent].0);
                let Some(&(node, _)) = self.nodes.get(group) else {
                    self.add(scene, *group, strokes, parent);
                    return;
                };
                assert!(strokes.is_empty(), "this session puts strokes into new groups only");
                self.index.set_parent(node, parent).expect("a tree");
            }
            Event::Place { group, to, .. } => {
                let to = Affine3A::from_scale_rotation_translation(Vec3::splat(to.s), to.q.normalize(), to.p);
                self.index.place(self.nodes[group].0, to).expect("a sound transform");
            }
            _ => {}
        }
    }

    fn add(&mut self, scene: &Scene, group: GroupId, strokes: &[StrokeId], parent: Option<NodeId>) {
        let mesh = self.index.add_mesh();
        let node = self.index.add_node(parent, Affine3A::IDENTITY, Some(mesh)).expect("a node");
        let ids: Vec<PolygonId> =
            strokes.iter().flat_map(|id| scene.stroke(*id).expect("drawn").polygon_ids()).collect();
        for (&id, number) in ids.iter().zip(0..) {
            self.index.set_polygon(mesh, PolygonId(number), Some(&scene.bounds(id))).expect("a sound box");
        }
        self.nodes.insert(group, (node, mesh));
        self.polygons.insert(node, ids);
    }
}

#[test]
fn groups_that_move_within_groups_are_found_where_the_scene_has_them() {
    let events = events_in(osp_testkit::at("recordings/nested.ron"));
    let mut followed = Followed::default();
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    let mut scratch = CullScratch::default();
    let (mut places, mut seen, mut missed, mut matrices) = (0u64, 0u64, 0u64, 0u64);
    for event in &events {
        followed.take(&scene, event);
        scene.apply(event, &mut changes);
        let Event::Place { .. } = event else { continue };
        places += 1;
        followed.index.commit();
        if places % 60 != 0 {
            continue;
        }
        let angle = places as f32 * 0.37;
        let eye = Vec3::new(2.0 * angle.sin(), 1.5, 2.0 * angle.cos());
        let view = View::look_at(eye, Vec3::new(0.6, 1.4, 0.2), Projection::symmetric(35.0, 1.4, 0.05, 50.0));
        let frustum = view.frustum();
        let mut visible = vec![false; scene.polygon_count()];
        followed.index.frustum_cull(&frustum, &mut scratch, |found| {
            let ids = &followed.polygons[&found.node];
            match found.polygons {
                Polygons::All => ids.iter().for_each(|id| visible[id.index()] = true),
                Polygons::Some(set) => set.ids().for_each(|at| visible[ids[at.index()].index()] = true),
            }
        });
        for id in scene.visible_ids().filter(|&id| !scene.groups_of(scene.stroke_of(id)).is_empty()) {
            let corners = scene.polygon(id);
            // The margin is for the scene, which rounds its corners after every group.
            let is_well_in =
                |p: &Vec3| frustum.planes().iter().all(|plane| plane.signed_distance(*p) > 1.0e-5);
            let is_seen = visible[id.index()];
            assert!(is_seen || !corners.vertices().iter().any(is_well_in), "polygon {} is in view", id.0);
            let box_may = frustum
                .may_see(&Aabb { min: scene.bounds(id).min - 1.0e-4, max: scene.bounds(id).max + 1.0e-4 });
            // The index has boxes in the mesh's space around boxes that were drawn there, which are larger than those of
            // the corners alone.
            seen += u64::from(is_seen);
            missed += u64::from(is_seen && !box_may);
        }
        matrices = followed.index.work().matrices;
    }
    assert_eq!((places, followed.nodes.len()), (1_799, 7));
    assert!(seen > 20_000 && missed * 20 < seen, "{missed} of {seen} reported beyond their boxes");
    // Each placing multiplies the matrices of the node and the nodes below: 1 to 4 of 7.
    assert!(matrices < 3 * places, "{matrices} matrices for {places} placings");
}
