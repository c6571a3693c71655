use osp::{Camera, Culler, Depth, math::Ray};

use crate::{Bounds, Tasks};

pub(crate) type World = Culler<u64>;

impl Tasks for World {
    fn come(&mut self, objects: &[(u64, Bounds)]) {
        objects.iter().for_each(|&(key, bounds)| self.set(key, bounds));
    }

    fn shift(&mut self, key: u64, bounds: Bounds) {
        self.set(key, bounds);
    }

    fn go(&mut self, key: u64) {
        self.remove(key);
    }

    fn draw(&mut self, clip_from_world: &[f32; 16]) -> Vec<u64> {
        let camera =
            Camera::from_matrix(*clip_from_world, Depth::ZeroToOne).expect("a matrix with an inverse");
        self.cull(&[camera])[0].iter().collect()
    }

    fn pick(&self, origin: [f32; 3], direction: [f32; 3]) -> Option<(u64, f32)> {
        self.on_ray(Ray::new(origin, direction), f32::INFINITY).next()
    }
}
