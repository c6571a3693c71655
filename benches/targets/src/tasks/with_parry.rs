use std::collections::HashMap;

use parry3d::{
    bounding_volume::Aabb,
    math::Vector,
    partitioning::{Bvh, TraversalAction},
    query::{Ray, RayCast},
};

use crate::{Bounds, Tasks, planes};

#[derive(Default)]
pub(crate) struct World {
    tree: Bvh,
    leaves: HashMap<u64, u32>,
    objects: Vec<(u64, Aabb)>,
    free: Vec<u32>,
}

fn vector([x, y, z]: [f32; 3]) -> Vector {
    Vector::new(x, y, z)
}

impl Tasks for World {
    fn come(&mut self, objects: &[(u64, Bounds)]) {
        for &(key, [min, max]) in objects {
            let object = (key, Aabb::new(vector(min), vector(max)));
            let leaf = self.free.pop().unwrap_or_else(|| {
                self.objects.push(object);
                self.objects.len() as u32 - 1
            });
            self.objects[leaf as usize] = object;
            self.leaves.insert(key, leaf);
            self.tree.insert(object.1, leaf);
        }
    }

    fn shift(&mut self, key: u64, [min, max]: Bounds) {
        let Some(&leaf) = self.leaves.get(&key) else { return };
        let bounds = Aabb::new(vector(min), vector(max));
        self.objects[leaf as usize].1 = bounds;
        self.tree.insert(bounds, leaf);
    }

    fn go(&mut self, key: u64) {
        let Some(leaf) = self.leaves.remove(&key) else { return };
        self.tree.remove(leaf);
        self.free.push(leaf);
    }

    fn draw(&mut self, clip_from_world: &[f32; 16]) -> Vec<u64> {
        let planes = planes::planes(clip_from_world);
        let mut seen = Vec::new();
        self.tree.traverse(|node| {
            if !planes::may_see(&planes, node.mins().to_array(), node.maxs().to_array()) {
                return TraversalAction::Prune;
            }
            seen.extend(node.leaf_data().map(|leaf| self.objects[leaf as usize].0));
            TraversalAction::Continue
        });
        seen
    }

    fn pick(&self, origin: [f32; 3], direction: [f32; 3]) -> Option<(u64, f32)> {
        let ray = Ray::new(vector(origin), vector(direction));
        let enter = |leaf: u32, best: f32| self.objects[leaf as usize].1.cast_local_ray(&ray, best, true);
        let (leaf, t) = self.tree.cast_ray(&ray, f32::MAX, enter)?;
        Some((self.objects[leaf as usize].0, t))
    }
}
