//! The culler with an engine's keys against plain lists.

use std::collections::{BTreeMap, BTreeSet};

use osp::{
    Camera, Culler, Dense, Depth, Key, Occluder, OccluderError, Refusal,
    glam::{DMat4, Vec3},
    math::{Aabb, Ray},
    view::{Projection, View},
};

use osp_testkit::boxes::Rng;

/// An engine's handle: sparse, with a generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Handle {
    generation: u32,
    index: u64,
}

/// What the engine knows of an object.
#[derive(Clone, Copy)]
struct Object {
    bounds: Aabb,
    layers: u32,
}

fn camera(rng: &mut Rng, world_m: f32) -> Camera {
    let eye = Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * world_m;
    let projection = Projection::symmetric(rng.range(20.0, 100.0), 1.6, 0.1, world_m * 2.0);
    Camera::from(&View::look_at(eye, rng.direction() * world_m, projection))
}

fn arrays(bounds: Aabb) -> [[f32; 3]; 2] {
    [bounds.min.into(), bounds.max.into()]
}

/// Random changes of two cullers whose objects are the same, one with handles and one with numbers.
struct Pair {
    handles: Culler<Handle>,
    numbers: Culler<Dense>,
    objects: BTreeMap<u32, Object>,
    generations: Vec<u32>,
    refused: Vec<(u32, Refusal)>,
}

impl Pair {
    fn new(most: u32) -> Self {
        let generations = vec![0; most as usize];
        Self {
            handles: Culler::new(),
            numbers: Culler::new(),
            objects: BTreeMap::new(),
            generations,
            refused: Vec::new(),
        }
    }

    fn handle(&self, number: u32) -> Handle {
        Handle { generation: self.generations[number as usize], index: u64::from(number) << 33 }
    }

    fn set(&mut self, number: u32, bounds: Aabb) {
        self.handles.set(self.handle(number), arrays(bounds));
        self.numbers.set(Dense(number), [bounds.min, bounds.max]);
        if bounds.is_valid() {
            let layers = self.objects.get(&number).map_or(1, |object| object.layers);
            self.objects.insert(number, Object { bounds, layers });
        } else {
            self.refused.push((number, Refusal::Bounds(arrays(bounds))));
            self.remove(number);
        }
    }

    fn set_layers(&mut self, number: u32, layers: u32) {
        let handle = self.handle(number);
        if let Some(object) = self.objects.get_mut(&number) {
            object.layers = layers;
            self.handles.set_layers(handle, layers);
            self.numbers.set_layers(Dense(number), layers);
        }
    }

    fn remove(&mut self, number: u32) {
        self.handles.remove(self.handle(number));
        self.numbers.remove(Dense(number));
        self.objects.remove(&number);
        self.generations[number as usize] += 1;
    }

    /// The objects that something is true of.
    fn where_all(&self, is_it: impl Fn(&Object) -> bool) -> BTreeSet<u32> {
        self.objects.iter().filter(|(_, object)| is_it(object)).map(|(number, _)| *number).collect()
    }

    /// Whether both cullers have found these, each once.
    fn assert_found(
        &self,
        expected: &BTreeSet<u32>,
        handles: impl Iterator<Item = Handle>,
        numbers: impl Iterator<Item = Dense>,
    ) {
        let numbers: Vec<u32> = numbers.map(|Dense(number)| number).collect();
        assert_eq!(numbers.len(), expected.len());
        assert_eq!(numbers.into_iter().collect::<BTreeSet<_>>(), *expected);
        let handles: Vec<Handle> = handles.collect();
        assert_eq!(handles.len(), expected.len());
        let expected: BTreeSet<_> = expected.iter().map(|&number| self.handle(number)).collect();
        assert_eq!(handles.into_iter().collect::<BTreeSet<_>>(), expected);
    }

    /// A frame of many changes, in a world of this size.
    fn change(&mut self, rng: &mut Rng, world_m: f32) {
        self.refused.clear();
        let most = self.generations.len();
        for _ in 0..most / 4 {
            let number = rng.below(most) as u32;
            let center =
                Vec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * world_m;
            match rng.below(40) {
                0..8 => self.remove(number),
                8 => self.set(number, Aabb::new(center, Vec3::new(1.0, f32::NAN, 1.0))),
                9 => self.set(number, Aabb::EMPTY),
                10 => self.set_layers(number, 1 << rng.below(4)),
                11 => self.set_layers(number, 0),
                12 => self.set(number, Aabb::new(center, center)),
                13 => self.set(number, Aabb::cube(center, world_m)),
                // A neighbourhood that moves together.
                14 => {
                    let last = (number + 40).min(most as u32);
                    (number..last).for_each(|n| self.set(n, Aabb::cube(center + n as f32 * 0.01, 0.2)));
                }
                _ => self.set(number, Aabb::cube(center, rng.range(0.0, 0.1) * world_m)),
            }
        }
    }

    fn check_views(&mut self, rng: &mut Rng, world_m: f32) {
        let views: Vec<_> = (0..1 + rng.below(10))
            .map(|_| {
                let mask = if rng.below(3) == 0 { rng.next() as u32 & 0b1111 } else { osp::ALL_LAYERS };
                (camera(rng, world_m).on_layers(mask), mask)
            })
            .collect();
        let cameras: Vec<_> = views.iter().map(|(camera, _)| *camera).collect();
        let count = self.handles.cull(&cameras).len();
        assert_eq!((count, self.numbers.cull(&cameras).len()), (cameras.len(), cameras.len()));
        let (handles, numbers) = (self.handles.frame(), self.numbers.frame());
        for (i, (camera, mask)) in views.iter().enumerate() {
            let is_seen = |o: &Object| camera.frustum().may_see(&o.bounds) && o.layers & mask != 0;
            let expected = self.where_all(is_seen);
            self.assert_found(&expected, handles[i].iter(), numbers[i].iter());
            assert_eq!((handles[i].len(), handles[i].hidden()), (expected.len(), 0));
            for number in 0..self.generations.len() as u32 {
                assert_eq!(handles[i].contains(self.handle(number)), expected.contains(&number));
            }
        }
        assert!(handles.get(count).is_none());
    }

    fn check_queries(&self, rng: &mut Rng, world_m: f32) {
        let world = Aabb::cube(Vec3::ZERO, 2.0 * world_m);
        for _ in 0..4 {
            let probe = Aabb::cube(rng.point(&world), world_m * rng.unit());
            let expected = self.where_all(|o| o.bounds.intersects(&probe));
            let [min, max] = arrays(probe);
            self.assert_found(&expected, self.handles.in_box([min, max]), self.numbers.in_box([min, max]));

            let (center, radius_m) = (rng.point(&world), world_m * rng.unit());
            let expected = self.where_all(|o| o.bounds.distance_squared(center) <= radius_m * radius_m);
            let handles = self.handles.in_sphere(center, radius_m);
            self.assert_found(&expected, handles, self.numbers.in_sphere(center, radius_m));

            let count = rng.below(12);
            let mut expected: Vec<f32> =
                self.objects.values().map(|o| o.bounds.distance_squared(center).sqrt()).collect();
            expected.sort_by(f32::total_cmp);
            expected.truncate(count);
            let nearest: Vec<_> = self.handles.nearest(center, count).collect();
            assert_eq!(nearest.iter().map(|(_, distance_m)| *distance_m).collect::<Vec<_>>(), expected);
            for (handle, distance_m) in nearest {
                let bounds = self.objects[&((handle.index >> 33) as u32)].bounds;
                assert_eq!(bounds.distance_squared(center).sqrt(), distance_m);
            }
            assert!(self.numbers.nearest(center, count).map(|(_, distance_m)| distance_m).eq(expected));

            let ray = Ray::new(rng.point(&world), rng.direction());
            let enter = |number: u32, ray: &Ray| ray.enter_box(&self.objects[&number].bounds, f32::INFINITY);
            let nearest =
                self.objects.keys().filter_map(|&number| enter(number, &ray)).min_by(f32::total_cmp);
            let hit = self.numbers.pick(ray, |Dense(number), ray| enter(number, ray));
            assert_eq!(hit.map(|(_, t)| t), nearest);
            let hit = self.handles.pick(ray, |handle, ray| enter((handle.index >> 33) as u32, ray));
            assert_eq!(hit.map(|(_, t)| t), nearest);
            let t_max = if rng.below(2) == 0 { f32::INFINITY } else { world_m * rng.unit() };
            let expected = self.where_all(|o| ray.enter_box(&o.bounds, t_max).is_some());
            let (handles, numbers) = (self.handles.on_ray(ray, t_max), self.numbers.on_ray(ray, t_max));
            let (keys, ts): (Vec<_>, Vec<_>) = handles.unzip();
            assert!(ts.is_sorted() && ts.first().copied() == nearest.filter(|&t| t <= t_max));
            self.assert_found(&expected, keys.into_iter(), numbers.map(|(key, _)| key));
        }
    }
}

#[test]
fn a_culler_finds_what_plain_lists_find_however_things_come_move_grow_and_go() {
    let mut rng = Rng(3);
    let mut refused = 0;
    for most in [20, 700, 6000] {
        let mut pair = Pair::new(most);
        // The world outgrows whatever was expected, and shrinks again.
        for world_m in [1.0, 1.0, 100.0, 1.0e4, 1.0e7, 0.01, 30.0, 30.0] {
            pair.change(&mut rng, world_m);
            pair.check_views(&mut rng, world_m);
            pair.check_queries(&mut rng, world_m);
            assert_eq!(pair.handles.len(), pair.objects.len());
            let why: Vec<_> = pair.numbers.refused().map(|(Dense(number), why)| (number, why)).collect();
            assert_eq!(format!("{why:?}"), format!("{:?}", pair.refused));
            assert_eq!(pair.handles.refused().count(), why.len());
            refused += why.len();
            for (&number, object) in &pair.objects {
                assert_eq!(pair.handles.bounds(pair.handle(number)), Some(arrays(object.bounds)));
            }
        }
        pair.numbers.cull(&[]);
        assert_eq!(pair.numbers.refused().count(), 0, "it is told of once");
        for number in 0..most {
            pair.remove(number);
        }
        pair.change(&mut rng, 2.0);
        pair.check_views(&mut rng, 2.0);
    }
    assert!(refused > 100, "{refused}");
}

/// A few objects first, then many at once, then a level that is unloaded and another one, in no order.
#[test]
fn many_objects_that_come_at_once_are_found_beside_those_that_there_were() {
    let mut rng = Rng(9);
    let mut pair = Pair::new(9000);
    for (numbers, world_m) in [(0..40_u32, 2.0), (40..3000, 500.0), (3000..9000, 500.0), (100..3000, 9.0e5)] {
        let world = Aabb::cube(Vec3::ZERO, 2.0 * world_m);
        if numbers.start == 100 {
            (0..9000).filter(|number| number % 50 > 0).for_each(|number| pair.remove(number));
        }
        for number in numbers {
            pair.set(number, Aabb::cube(rng.point(&world), 0.01 * world_m));
        }
        pair.check_views(&mut rng, world_m);
        pair.check_queries(&mut rng, world_m);
        assert_eq!(pair.numbers.len(), pair.objects.len());
    }
}

#[test]
fn what_has_gone_is_found_by_no_query_and_what_came_by_the_next_commit() {
    let mut culler = Culler::<&str>::new();
    let unit = [[0.0_f32; 3], [1.0; 3]];
    culler.set("old", unit);
    assert_eq!(culler.in_box(unit).count(), 0);
    culler.commit();
    assert!(culler.in_box(unit).eq(["old"]));
    culler.remove("old");
    culler.set("new", [[5.0_f32; 3], [6.0; 3]]);
    let ray = Ray::new(Vec3::new(0.5, 0.5, -1.0), Vec3::Z);
    assert_eq!(culler.in_box(unit).count(), 0);
    assert_eq!(culler.pick(ray, |key, _| panic!("{key}")), None);
    assert_eq!(culler.on_ray(ray, f32::INFINITY).count(), 0);
    assert_eq!(culler.nearest([0.0_f32; 3], 9).count(), 0);
    culler.commit();
    assert_eq!(
        culler.on_ray(Ray::new([5.5_f32, 5.5, 9.0], [0.0_f32, 0.0, -2.0]), 2.0).next(),
        Some(("new", 1.5))
    );
    let nowhere = Ray::new([f32::NAN; 3], Vec3::Z);
    assert_eq!(culler.on_ray(nowhere, f32::INFINITY).count(), 0);
    assert_eq!(culler.pick(nowhere, |key, _| panic!("{key}")), None);
    assert!(culler.in_sphere([5.5_f32; 3], 0.1).eq(["new"]));
    assert_eq!((culler.bounds("old"), culler.len()), (None, 1));
}

#[test]
fn refusals_name_the_object_and_what_was_expected() {
    let mut culler = Culler::<Dense>::new();
    culler.set(Dense(4), [[0.0_f32; 3], [1.0; 3]]);
    culler.set_layers(Dense(4), 2);
    culler.set(Dense(4), [[0.0_f32, 0.0, 2.0], [1.0; 3]]);
    culler.set(Dense(u32::MAX), [[0.0_f32; 3], [1.0; 3]]);
    culler.set_layers(Dense(1 << 27), 2);
    culler.remove(Dense(u32::MAX));
    culler.cull(&[]);
    let why: Vec<_> = culler.refused().map(|(Dense(number), why)| format!("{number}: {why}")).collect();
    assert_eq!(
        why,
        [
            "4: bounds: expected finite corners with min <= max, found [[0.0, 0.0, 2.0], [1.0, 1.0, 1.0]]",
            "4294967295: key: expected a number below 134217728, and at most as many objects",
            "134217728: key: expected a number below 134217728, and at most as many objects",
        ]
    );
    assert!(culler.is_empty(), "where it was, it is no more");
    assert_eq!(culler.bounds(Dense(4)), None);
    culler.set(Dense(4), [[0.0_f32; 3], [1.0; 3]]);
    let camera = Camera::from_matrix(DMat4::IDENTITY.to_cols_array(), Depth::ZeroToOne).expect("a camera");
    let frame = culler.cull(&[camera.on_layers(1), camera.on_layers(2)]);
    assert_eq!((frame[0].len(), frame[1].len()), (0, 1), "it keeps its layers");
}

#[test]
fn a_stray_number_and_a_hundred_thousand_refusals_take_little_memory() {
    let mut culler = Culler::<Dense>::new();
    culler.set(Dense((1 << 27) - 1), [[0.0_f32; 3], [1.0; 3]]);
    for _ in 0..100_000 {
        culler.set(Dense(0), [[f32::INFINITY; 3], [1.0; 3]]);
    }
    let camera = Camera::from(&View::look_at(
        Vec3::new(0.0, 0.0, 5.0),
        Vec3::ZERO,
        Projection::symmetric(60.0, 1.0, 0.1, 100.0),
    ));
    assert!(culler.cull(&[camera])[0].iter().eq([Dense((1 << 27) - 1)]));
    assert!(culler.refused().count() <= 5000);
}

#[test]
fn what_is_no_occluder_says_why() {
    let square = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    assert!(Occluder::quad(square).is_ok());
    let with = |at: usize, corner: [f32; 3]| {
        let mut corners = square;
        corners[at] = corner;
        Occluder::quad(corners)
    };
    assert_eq!(with(2, [f32::NAN, 1.0, 0.0]), Err(OccluderError::NotFinite(2)));
    assert_eq!(with(2, [1.0, 1.0, 0.5]), Err(OccluderError::NotFlatAndConvex));
    assert_eq!(with(2, [0.1, 0.1, 0.0]), Err(OccluderError::NotFlatAndConvex));
    assert_eq!(Occluder::quad([[1.0_f32; 3]; 4]), Err(OccluderError::NotFlatAndConvex));
    assert!(Occluder::mesh(&square, &[0, 1, 2, 0, 2, 3]).is_ok());
    assert_eq!(Occluder::mesh(&square, &[0, 1, 2, 0]), Err(OccluderError::NotTriangles(4)));
    let no_vertex = OccluderError::NoVertex { at: 1, found: 4, vertices: 4 };
    assert_eq!(Occluder::mesh(&square, &[0, 4, 2]), Err(no_vertex));
    assert_eq!(no_vertex.to_string(), "indices[1]: expected less than 4, found 4");
    assert_eq!(Occluder::mesh(&square, &[0, 0, 2]), Err(OccluderError::NoArea));
    assert_eq!(Occluder::mesh::<[f32; 3]>(&[], &[]), Err(OccluderError::NoArea));
    assert!(Occluder::cuboid([[0.0_f32; 3], [1.0; 3]]).is_ok());
    assert_eq!(Occluder::cuboid([[0.0_f32; 3]; 2]), Err(OccluderError::NoArea));
    let turned = Occluder::cuboid([[0.0_f32; 3], [-1.0; 3]]).expect_err("max, min");
    assert_eq!(turned.to_string(), "bounds: expected min <= max");
}

#[test]
fn several_threads_ask_one_culler() {
    fn shared<T: Send + Sync>() {}
    shared::<Culler<Handle>>();
    shared::<Camera>();
    fn asked<K: Key + PartialEq + std::fmt::Debug + Send + Sync>(culler: &mut Culler<K>, keys: [K; 2])
    where
        Culler<K>: Sync,
    {
        let boxes = [[[0.0_f32; 3], [1.0; 3]], [[4.0; 3], [5.0; 3]]];
        keys.iter().zip(boxes).for_each(|(&key, bounds)| culler.set(key, bounds));
        culler.commit();
        let culler = &*culler;
        std::thread::scope(|scope| {
            for (key, [min, max]) in keys.into_iter().zip(boxes) {
                scope.spawn(move || {
                    let ray = Ray::new(Vec3::from(max) + 1.0, Vec3::splat(-1.0));
                    assert!(culler.in_box([min, max]).eq([key]));
                    let hit = culler.pick(ray, |asked, _| (asked == key).then_some(1.0));
                    assert_eq!(hit, Some((key, 1.0)));
                });
            }
        });
    }
    asked(&mut Culler::<u64>::new(), [1 << 60, 7]);
    asked(&mut Culler::<Dense>::new(), [Dense(1), Dense(0)]);
}
