use std::collections::HashMap;

use glam::{Vec3, Vec4};
use rstar::{
    AABB, RTree, SelectionFunction,
    primitives::{GeomWithData, Rectangle},
};

use crate::{Bounds, Tasks, planes};

type Object = GeomWithData<Rectangle<[f32; 3]>, u64>;

#[derive(Default)]
pub(crate) struct World {
    tree: RTree<Object>,
    boxes: HashMap<u64, Bounds>,
}

fn object(key: u64, [min, max]: Bounds) -> Object {
    Object::new(Rectangle::from_corners(min, max), key)
}

struct InView([Vec4; 6]);

impl SelectionFunction<Object> for InView {
    fn should_unpack_parent(&self, envelope: &AABB<[f32; 3]>) -> bool {
        planes::may_see(&self.0, envelope.lower(), envelope.upper())
    }

    fn should_unpack_leaf(&self, leaf: &Object) -> bool {
        planes::may_see(&self.0, leaf.geom().lower(), leaf.geom().upper())
    }
}

struct OnRay(Vec3, Vec3);

impl OnRay {
    fn enter(&self, min: [f32; 3], max: [f32; 3]) -> Option<f32> {
        let (a, b) = ((Vec3::from(min) - self.0) / self.1, (Vec3::from(max) - self.0) / self.1);
        let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
        (near <= far).then_some(near)
    }
}

impl SelectionFunction<Object> for OnRay {
    fn should_unpack_parent(&self, envelope: &AABB<[f32; 3]>) -> bool {
        self.enter(envelope.lower(), envelope.upper()).is_some()
    }
}

impl Tasks for World {
    fn come(&mut self, objects: &[(u64, Bounds)]) {
        for &(key, bounds) in objects {
            self.boxes.insert(key, bounds);
            self.tree.insert(object(key, bounds));
        }
    }

    fn shift(&mut self, key: u64, bounds: Bounds) {
        self.go(key);
        self.come(&[(key, bounds)]);
    }

    fn go(&mut self, key: u64) {
        let Some(bounds) = self.boxes.remove(&key) else { return };
        self.tree.remove(&object(key, bounds));
    }

    fn draw(&mut self, clip_from_world: &[f32; 16]) -> Vec<u64> {
        let in_view = InView(planes::planes(clip_from_world));
        self.tree.locate_with_selection_function(in_view).map(|object| object.data).collect()
    }

    fn pick(&self, origin: [f32; 3], direction: [f32; 3]) -> Option<(u64, f32)> {
        let on_ray = |object: &Object| {
            let t =
                OnRay(origin.into(), direction.into()).enter(object.geom().lower(), object.geom().upper())?;
            Some((object.data, t))
        };
        let found = self.tree.locate_with_selection_function(OnRay(origin.into(), direction.into()));
        found.filter_map(on_ray).min_by(|a, b| a.1.total_cmp(&b.1))
    }
}
