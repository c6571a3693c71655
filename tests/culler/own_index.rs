//! An engine's own index, with no more than the documented methods.

use std::collections::BTreeMap;

use crate::engine::{Thing, World, square};
use glam::Vec3;
use osp::{
    frame::{PassConfig, Pipeline},
    index::{BruteForce, IndexError, SpatialIndex, WorkCounts},
    math::{Aabb, Frustum, Ray, Sphere},
    occlusion::Occlusion,
    polygon::{ConvexPolygon, PolygonId},
    view::{Projection, View},
};
use osp_testkit::boxes::{Rng, drawn};

/// The boxes by their ids.
#[derive(Default)]
struct Plain(BTreeMap<PolygonId, Aabb>);

impl SpatialIndex for Plain {
    fn name(&self) -> &'static str {
        "plain"
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        if !bounds.is_valid() {
            return Err(IndexError::InvalidBounds(id));
        }
        self.0.insert(id, *bounds).map_or(Ok(()), |_| Err(IndexError::Duplicate(id)))
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.0.remove(&id).map(|_| ()).ok_or(IndexError::Unknown(id))
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.remove(id)?;
        self.insert(id, bounds)
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        draw_list.extend(self.0.iter().filter(|(_, bounds)| frustum.may_see(bounds)).map(|(&id, _)| id));
        WorkCounts::default()
    }

    fn validate(&self) -> Result<(), String> {
        Ok(())
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.0)
    }

    fn clear(&mut self) {
        self.0.clear();
    }
}

#[test]
fn its_queries_find_what_the_reference_finds() {
    let boxes = drawn(500, 9);
    let mut indexes: [Box<dyn SpatialIndex>; 2] = [Box::<Plain>::default(), Box::<BruteForce>::default()];
    for (id, bounds) in (0..).map(PolygonId).zip(&boxes) {
        indexes.iter_mut().for_each(|index| index.insert(id, bounds).expect("a good box"));
    }
    let around = Aabb::cube(Vec3::ZERO, 10.0);
    let mut rng = Rng(21);
    let (mut hits, mut touched) = (0, 0);
    for _ in 0..100 {
        let (origin, at) = (rng.point(&around), boxes[rng.below(boxes.len())].center());
        let ray = Ray::new(origin, at - origin);
        let sphere = Sphere { center: rng.point(&around), radius_m: 1.0 };
        let found = indexes.each_ref().map(|index| {
            let mut enter = |id: PolygonId| ray.enter_box(&boxes[id.index()], 9.0);
            let first = index.ray_nearest(&ray, 9.0, &mut enter);
            let any = index.ray_any(&ray, 9.0, &mut enter).is_some();
            let (mut within, mut near) = (Vec::new(), Vec::new());
            let distance_m = |id: PolygonId| boxes[id.index()].distance_squared(sphere.center).sqrt();
            index.sphere_query(&sphere, &mut |id| distance_m(id) <= sphere.radius_m, &mut within);
            index.nearest(sphere.center, 5, &mut |id| distance_m(id), &mut near);
            (first, any, within, near)
        });
        let [own, reference] = &found;
        assert_eq!(own, reference);
        (hits, touched) = (hits + usize::from(own.1), touched + own.2.len());
    }
    assert!(hits > 0 && touched > 0, "{hits} rays hit, {touched} boxes in spheres");
}

#[test]
fn a_wall_hides_what_is_behind_it() {
    let meshes = [-3.0, -8.0].map(|z| Some(Thing::Mesh(Aabb::cube(Vec3::Z * z, 0.5))));
    let mut room = World::of([ConvexPolygon::quad(square(5.0, 3.0))]);
    room.0.extend(meshes);
    let view = View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 1.0, 0.1, 100.0));
    for choice in [Occlusion::Msvbsp, Occlusion::Depth] {
        let pipeline = Pipeline::new(Box::<Plain>::default(), 16);
        let mut pipeline = pipeline.with_occlusion(PassConfig::new(choice));
        pipeline.load(&room);
        let record = pipeline.frame(&room, &[], &view);
        assert_eq!((record.visible, record.hidden(), record.drawn()), (3, 1, 2), "{}", choice.name());
        assert_eq!(pipeline.draw_list().to_vec(), [0, 1].map(PolygonId), "{}", choice.name());
    }
}
