//! Queries by ray, box, sphere and distance.

use std::{cell::Cell, hash::BuildHasher};

use super::{
    camera::ALL_LAYERS,
    culler::Culler,
    keys::{Key, Places},
};
use crate::{
    FastHash,
    index::SpatialIndex,
    math::{Aabb, Ray, Sphere},
    polygon::PolygonId,
};

thread_local! {
    /// Working memory of this thread's queries.
    static FOUND: Cell<Vec<PolygonId>> = const { Cell::new(Vec::new()) };
    static FOUND_AT: Cell<Vec<(PolygonId, f32)>> = const { Cell::new(Vec::new()) };
}

/// The queries of a [`Culler`] for objects on some layers. Each appends its results to the caller's list, and allocates
/// nothing once this list and those of the thread have grown.
///
/// ```
/// use osp::{Culler, math::Ray};
///
/// let mut culler = Culler::<u32>::new();
/// culler.set(7, [[-1.0, 0.0, -4.0], [1.0, 1.0, -3.0_f32]]);
/// culler.set(8, [[-1.0, 0.0, -9.0], [1.0, 1.0, -8.0_f32]]);
/// culler.set_layers(8, 2);
/// culler.commit();
/// let (mut near, mut first) = (Vec::new(), Vec::new());
/// culler.on_layers(2).nearest([0.0_f32; 3], 5, &mut near);
/// assert_eq!(near, [(8, 8.0)]);
/// let ahead = Ray::new([0.0, 0.5, 0.0_f32], [0.0, 0.0, -1.0]);
/// culler.on_layers(1 | 2).first_on_rays(&[ahead, Ray::new([5.0_f32; 3], [1.0, 0.0, 0.0])], 20.0, &mut first);
/// assert_eq!(first, [Some((7, 3.0)), None]);
/// ```
#[derive(Debug)]
pub struct Query<'a, K: Key, S: BuildHasher = FastHash> {
    culler: &'a Culler<K, S>,
    layers: u32,
    sees_all: bool,
}

impl<K: Key, S: BuildHasher> Copy for Query<'_, K, S> {}

impl<K: Key, S: BuildHasher> Clone for Query<'_, K, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Key, S: BuildHasher> Query<'_, K, S> {
    fn sees(&self, number: PolygonId) -> bool {
        self.sees_all || self.culler.layers.sees(self.culler.keys.slot_of(number), self.layers)
    }

    fn key(&self, number: PolygonId) -> K {
        self.culler.keys.key(number)
    }

    /// The nearest object that a ray meets, and its distance; see [`Culler::pick`].
    pub fn pick(&self, ray: Ray, mut hit: impl FnMut(K, &Ray) -> Option<f32>) -> Option<(K, f32)> {
        let mut meet = |number| if self.sees(number) { hit(self.key(number), &ray) } else { None };
        self.nearest_on(&ray, f32::INFINITY, &mut meet)
    }

    /// For each ray, the first box that it enters within `t_max` lengths of its direction, and the distance of the entry,
    /// 0 from inside.
    pub fn first_on_rays(&self, rays: &[Ray], t_max: f32, out: &mut Vec<Option<(K, f32)>>) {
        let objects = &self.culler.objects;
        out.extend(rays.iter().map(|ray| {
            let mut enter =
                |number| ray.enter_box(&objects.get(number).filter(|_| self.sees(number))?, t_max);
            self.nearest_on(ray, t_max, &mut enter)
        }));
    }

    /// The nearest object that `hit` meets on a ray.
    fn nearest_on(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(K, f32)> {
        let objects = &self.culler.objects;
        let in_index = objects.index().ray_nearest(ray, t_max, hit);
        let endless = objects.endless().filter_map(|number| Some((number, hit(number)?)));
        let nearest = in_index.into_iter().chain(endless.filter(|(_, t)| *t <= t_max));
        let (number, t) = nearest.min_by(|(first, a), (second, b)| a.total_cmp(b).then(first.cmp(second)))?;
        Some((self.key(number), t))
    }

    /// The objects whose boxes a ray enters, the nearest first, with the distances; see [`Culler::on_ray`].
    pub fn on_ray(&self, ray: Ray, t_max: f32, out: &mut Vec<(K, f32)>) {
        let mut entered = FOUND_AT.try_with(Cell::take).unwrap_or_default();
        entered.clear();
        let mut note = |number| {
            let bounds = self.culler.objects.get(number).filter(|_| self.sees(number))?;
            entered.push((number, ray.enter_box(&bounds, t_max)?));
            // Without a hit the traversal continues.
            None
        };
        self.culler.objects.index().ray_nearest(&ray, t_max, &mut note);
        self.culler.objects.endless().for_each(|number| _ = note(number));
        entered.sort_unstable_by(|(first, a), (second, b)| a.total_cmp(b).then(first.cmp(second)));
        out.extend(entered.iter().map(|&(number, t)| (self.key(number), t)));
        let _ = FOUND_AT.try_with(|kept| kept.set(entered));
    }

    /// The objects whose boxes share a point with `bounds`; see [`Culler::in_box`].
    pub fn in_box<P: Into<[f32; 3]>>(&self, bounds: [P; 2], out: &mut Vec<K>) {
        let [min, max] = bounds.map(|corner| corner.into().into());
        let bounds = Aabb::new(min, max);
        self.list(out, |found| {
            self.culler.objects.index().box_query(&bounds, found);
            found.extend(self.culler.objects.endless().filter(|_| !bounds.is_empty()));
        });
    }

    /// The objects whose boxes share a point with a sphere; see [`Culler::in_sphere`].
    pub fn in_sphere<P: Into<[f32; 3]>>(&self, center: P, radius_m: f32, out: &mut Vec<K>) {
        let sphere = Sphere { center: center.into().into(), radius_m };
        let mut is_in = |number| {
            let bounds = self.culler.objects.get(number);
            bounds.is_some_and(|bounds| bounds.distance_squared(sphere.center) <= radius_m * radius_m)
        };
        self.list(out, |found| {
            self.culler.objects.index().sphere_query(&sphere, &mut is_in, found);
            found.extend(self.culler.objects.endless().filter(|&number| is_in(number)));
        });
    }

    fn list(&self, out: &mut Vec<K>, query: impl FnOnce(&mut Vec<PolygonId>)) {
        let mut found = FOUND.try_with(Cell::take).unwrap_or_default();
        found.clear();
        query(&mut found);
        if self.sees_all {
            out.extend(found.iter().map(|&number| self.key(number)));
        } else {
            out.extend(found.iter().filter(|number| self.sees(**number)).map(|&number| self.key(number)));
        }
        let _ = FOUND.try_with(|kept| kept.set(found));
    }

    /// The `count` objects whose boxes are nearest to a point, with the distances; see [`Culler::nearest`].
    pub fn nearest<P: Into<[f32; 3]>>(&self, point: P, count: usize, out: &mut Vec<(K, f32)>) {
        let (point, objects) = (point.into().into(), &self.culler.objects);
        let mut distance_m = |number| {
            let bounds = objects.get(number).filter(|_| self.sees(number));
            // A distance of NaN excludes the object.
            bounds.map_or(f32::NAN, |bounds| bounds.distance_squared(point).sqrt())
        };
        let mut found = FOUND_AT.try_with(Cell::take).unwrap_or_default();
        let index = objects.index();
        index.nearest(point, count.min(index.len()), &mut distance_m, &mut found);
        let of_endless = objects.endless().map(|number| (number, distance_m(number)));
        let in_index = found.len();
        found.extend(of_endless.filter(|(_, distance_m)| !distance_m.is_nan()));
        if found.len() > in_index {
            found.sort_unstable_by(|(first, a), (second, b)| a.total_cmp(b).then(first.cmp(second)));
            found.truncate(count);
        }
        out.extend(found.iter().map(|&(number, distance_m)| (self.key(number), distance_m)));
        let _ = FOUND_AT.try_with(|kept| kept.set(found));
    }
}

impl<K: Key, S: BuildHasher> Culler<K, S> {
    /// The queries for objects on at least one of these layers, a mask with a bit for each layer.
    pub fn on_layers(&self, layers: u32) -> Query<'_, K, S> {
        let sees_all = layers == ALL_LAYERS || self.layers.sees_all(layers);
        Query { culler: self, layers, sees_all }
    }

    /// The nearest object that a ray meets, and its distance. `hit` is the exact test: it returns the distance to the
    /// object itself, in lengths of the ray's direction, or `None` for a miss. It is called for objects whose boxes the ray
    /// enters, in any order, on any layer.
    pub fn pick(&self, ray: Ray, hit: impl FnMut(K, &Ray) -> Option<f32>) -> Option<(K, f32)> {
        self.on_layers(ALL_LAYERS).pick(ray, hit)
    }

    /// The objects whose boxes a ray enters, the nearest first, with the distance of each entry, in lengths of the
    /// ray's direction. The distance is at most `t_max`, and 0 if the ray starts inside. An engine that tests the
    /// objects themselves may stop at the first box behind its nearest hit. Layers have no effect.
    pub fn on_ray(&self, ray: Ray, t_max: f32) -> impl Iterator<Item = (K, f32)> {
        let mut entered = Vec::new();
        self.on_layers(ALL_LAYERS).on_ray(ray, t_max, &mut entered);
        entered.into_iter()
    }

    /// The objects whose boxes share a point with `bounds`, in any order. Boxes that touch share a point.
    pub fn in_box<P: Into<[f32; 3]>>(&self, bounds: [P; 2]) -> impl Iterator<Item = K> {
        let mut found = Vec::new();
        self.on_layers(ALL_LAYERS).in_box(bounds, &mut found);
        found.into_iter()
    }

    /// The objects whose boxes share a point with a sphere, in any order.
    pub fn in_sphere<P: Into<[f32; 3]>>(&self, center: P, radius_m: f32) -> impl Iterator<Item = K> {
        let mut found = Vec::new();
        self.on_layers(ALL_LAYERS).in_sphere(center, radius_m, &mut found);
        found.into_iter()
    }

    /// The `count` objects whose boxes are nearest to a point, the nearest first, with their distances from it, metres. The
    /// distance from a box that contains the point is 0. Layers have no effect.
    pub fn nearest<P: Into<[f32; 3]>>(&self, point: P, count: usize) -> impl Iterator<Item = (K, f32)> {
        let mut found = Vec::new();
        self.on_layers(ALL_LAYERS).nearest(point, count, &mut found);
        found.into_iter()
    }
}
