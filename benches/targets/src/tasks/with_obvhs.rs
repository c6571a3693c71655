use std::collections::HashMap;

use obvhs::{
    aabb::Aabb,
    bvh2::Bvh2,
    ray::{Ray, RayHit},
};

use crate::{Bounds, Tasks, planes};

#[derive(Default)]
pub(crate) struct World {
    tree: Bvh2,
    primitives: HashMap<u64, u32>,
    objects: Vec<(u64, Aabb)>,
    free: Vec<u32>,
}

impl Tasks for World {
    fn come(&mut self, objects: &[(u64, Bounds)]) {
        for &(key, [min, max]) in objects {
            let object = (key, Aabb::new(min.into(), max.into()));
            let primitive = self.free.pop().unwrap_or_else(|| {
                self.objects.push(object);
                self.objects.len() as u32 - 1
            });
            self.objects[primitive as usize] = object;
            self.primitives.insert(key, primitive);
            self.tree.insert_primitive(object.1, primitive);
        }
    }

    fn shift(&mut self, key: u64, [min, max]: Bounds) {
        let Some(&primitive) = self.primitives.get(&key) else { return };
        let bounds = Aabb::new(min.into(), max.into());
        self.objects[primitive as usize].1 = bounds;
        self.tree.move_primitive(bounds, primitive);
    }

    fn go(&mut self, key: u64) {
        let Some(primitive) = self.primitives.remove(&key) else { return };
        self.tree.remove_primitive(primitive);
        self.free.push(primitive);
    }

    fn draw(&mut self, clip_from_world: &[f32; 16]) -> Vec<u64> {
        let planes = planes::planes(clip_from_world);
        let mut seen = Vec::new();
        let mut stack = Vec::from_iter((!self.tree.nodes.is_empty()).then_some(0));
        while let Some(node) = stack.pop() {
            let node = &self.tree.nodes[node as usize];
            if !planes::may_see(&planes, node.aabb().min.into(), node.aabb().max.into()) {
                continue;
            }
            if node.is_leaf() {
                let first = node.first_index as usize;
                let primitives = &self.tree.primitive_indices[first..first + node.prim_count as usize];
                seen.extend(primitives.iter().map(|&primitive| self.objects[primitive as usize].0));
            } else {
                stack.extend([node.first_index, node.first_index + 1]);
            }
        }
        seen
    }

    fn pick(&self, origin: [f32; 3], direction: [f32; 3]) -> Option<(u64, f32)> {
        let mut hit = RayHit::none();
        let ray = Ray::new_inf(origin.into(), direction.into());
        let object = |at: usize| &self.objects[self.tree.primitive_indices[at] as usize];
        self.tree.ray_traverse(ray, &mut hit, |ray, at| object(at).1.intersect_ray(ray));
        (hit.t < f32::INFINITY).then(|| (object(hit.primitive_id as usize).0, hit.t))
    }
}
