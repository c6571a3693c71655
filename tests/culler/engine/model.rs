//! The culler against a plain map, whatever the order of its calls.
//!
//! Objects lie in four cells of the screen, before or behind the place of an occluder, at any scale, or behind the eye. An
//! occluder covers one cell, and no other occluder covers it, because useless occluders rest. So the map alone says what
//! each camera sees and what is hidden.

use std::collections::{BTreeMap, BTreeSet};

use osp::{
    ALL_LAYERS, Camera, Culler, Dense, Depth, Handle, Key, Occluder, Refusal, ViewState,
    glam::{Mat4, Vec3},
    math::{Aabb, Ray},
};
use osp_testkit::boxes::Rng;

const CELLS: usize = 4;
/// Distance of the occluders, metres. Objects at [`FRONT_M`] are before them.
const WALL_M: f32 = 3.0;
const FRONT_M: f32 = 2.0;
/// Half the width of what an occluder covers, at distance 1.
const HALF: f32 = 0.18;
/// Only these may have an occluder, so that all occluders are used.
const OWNERS: usize = 6;

/// The middle of a cell at distance 1.
fn middle(cell: usize) -> Vec3 {
    Vec3::new((cell as f32 - 1.5) * 0.4, 0.0, -1.0)
}

fn cell_of(bounds: &Aabb) -> usize {
    let center = bounds.center();
    (center.x / center.z.abs() / 0.4 + 1.5).round() as usize
}

fn arrays(bounds: &Aabb) -> [[f32; 3]; 2] {
    [bounds.min.into(), bounds.max.into()]
}

/// A square, or a box behind it.
fn occluder(cell: usize, is_box: bool) -> Occluder {
    let corners = [[-HALF, -HALF], [HALF, -HALF], [HALF, HALF], [-HALF, HALF]]
        .map(|[x, y]| (middle(cell) + Vec3::new(x, y, 0.0)) * WALL_M);
    let made = match is_box {
        true => Occluder::cuboid([corners[0] - Vec3::Z * 0.2, corners[2]]),
        false => Occluder::quad(corners),
    };
    made.expect("a surface")
}

fn any_box(rng: &mut Rng) -> Aabb {
    let distance_m = [FRONT_M, 6.0, 6.0, 6.0e3, 6.0e6, -6.0][rng.below(6)];
    let aside = Vec3::new(rng.range(-0.05, 0.05), rng.range(-0.05, 0.05), 0.0);
    let center = (middle(rng.below(CELLS)) + aside) * distance_m;
    Aabb::cube(center, distance_m.abs() * rng.range(0.01, 0.04))
}

/// A camera from the origin, 90 degrees wide, without a far plane.
fn camera(is_turned: bool) -> Camera {
    let mut clip = Mat4::ZERO;
    (clip.x_axis.x, clip.y_axis.y, clip.z_axis.w, clip.w_axis.z) = (1.0, 1.0, -1.0, 0.1);
    let turn = if is_turned { Mat4::from_rotation_y(std::f32::consts::PI) } else { Mat4::IDENTITY };
    Camera::from_matrix((clip * turn).to_cols_array(), Depth::OneToZero).expect("a camera")
}

#[derive(Clone, Copy, Debug)]
struct Object {
    bounds: Option<Aabb>,
    layers: u32,
    /// The cell that its occluder covers.
    occluder: Option<usize>,
}

/// What a camera saw.
#[derive(Clone, Debug)]
struct Sight {
    in_view: BTreeSet<u32>,
    drawn: BTreeSet<u32>,
    /// The cells that occluders covered.
    covered: BTreeSet<usize>,
}

/// A culler, and the map.
struct Model<K: Key> {
    culler: Culler<K>,
    key: fn(u32) -> K,
    most: usize,
    /// The cells that its occluders leave out.
    taken: BTreeSet<usize>,
    objects: BTreeMap<u32, Object>,
    /// What queries find: a new object from the next commit on, every other change at once.
    committed: BTreeMap<u32, Aabb>,
    has_changes: bool,
    /// Handles of objects, some of which have been removed since.
    handles: Vec<(u32, Handle)>,
    /// The handle of each object that has been asked for.
    named: BTreeMap<u32, Handle>,
    frame: Vec<Sight>,
    refused: Vec<u32>,
    refused_since: Vec<u32>,
}

impl<K: Key + Ord + std::fmt::Debug> Model<K> {
    fn new(most: usize, key: fn(u32) -> K) -> Self {
        Self {
            culler: Culler::new(),
            key,
            most,
            taken: BTreeSet::new(),
            objects: BTreeMap::new(),
            committed: BTreeMap::new(),
            has_changes: false,
            handles: Vec::new(),
            named: BTreeMap::new(),
            frame: Vec::new(),
            refused: Vec::new(),
            refused_since: Vec::new(),
        }
    }

    fn object(&mut self, number: u32) -> &mut Object {
        self.objects.entry(number).or_insert(Object { bounds: None, layers: 1, occluder: None })
    }

    fn lose_box(&mut self, number: u32) {
        let object = self.object(number);
        object.occluder = None;
        self.has_changes |= object.bounds.take().is_some();
        self.committed.remove(&number);
        for sight in &mut self.frame {
            sight.in_view.remove(&number);
            sight.drawn.remove(&number);
        }
    }

    fn set(&mut self, number: u32, bounds: Aabb) {
        self.culler.set((self.key)(number), arrays(&bounds));
        self.note_set(number, bounds);
    }

    fn note_set(&mut self, number: u32, bounds: Aabb) {
        if !bounds.is_valid() {
            self.lose_box(number);
            self.refused_since.push(number);
            return;
        }
        let object = self.object(number);
        if object.bounds.is_some_and(|before| !bounds.contains(&before)) {
            object.occluder = None;
        }
        object.bounds = Some(bounds);
        self.committed.entry(number).and_modify(|committed| *committed = bounds);
        self.has_changes = true;
    }

    fn note_remove(&mut self, number: u32) {
        self.lose_box(number);
        self.objects.remove(&number);
        self.named.remove(&number);
    }

    fn note_commit(&mut self) {
        if std::mem::take(&mut self.has_changes) {
            self.frame.clear();
        }
        self.committed = self.boxes().collect();
    }

    fn boxes(&self) -> impl Iterator<Item = (u32, Aabb)> {
        self.objects.iter().filter_map(|(&number, object)| Some((number, object.bounds?)))
    }

    fn append(&mut self, other: Self) {
        // The handles of a culler that is taken over stay valid, and others do not.
        (self.handles, self.named) = Default::default();
        let is_default = |object: &Object| object.layers == 1 && object.occluder.is_none();
        let is_empty = self.objects.values().all(|o| o.bounds.is_none() && is_default(o));
        let refused = [other.refused, other.refused_since].concat();
        self.culler.append(other.culler);
        if is_empty && !self.has_changes {
            self.objects = other.objects;
            self.frame.clear();
            self.note_commit();
        } else {
            for (number, object) in other.objects {
                if object.bounds.is_some() || object.occluder.is_some() {
                    self.note_remove(number);
                }
                if let Some(bounds) = object.bounds {
                    self.note_set(number, bounds);
                }
                let ours = self.object(number);
                ours.occluder = object.occluder.or(ours.occluder);
                ours.layers = if object.layers == 1 { ours.layers } else { object.layers };
            }
        }
        self.refused_since.extend(refused);
    }

    /// The cells that are covered for a camera on some layers that hides by occluders.
    fn covered(&self, layers: u32) -> BTreeSet<usize> {
        let owners = self.objects.values().filter(|object| object.occluder.is_some());
        match owners.clone().all(|owner| owner.layers & layers != 0) {
            true => owners.filter_map(|owner| owner.occluder).collect(),
            false => BTreeSet::new(),
        }
    }

    /// A call by lot.
    fn change(&mut self, rng: &mut Rng) {
        let number = rng.below(self.most) as u32;
        let key = (self.key)(number);
        match rng.below(24) {
            0..5 => self.set(number, any_box(rng)),
            20 => {
                let bounds = any_box(rng);
                let handle = self.culler.insert(key, arrays(&bounds)).expect("a handle");
                self.note_set(number, bounds);
                assert_eq!(*self.named.entry(number).or_insert(handle), handle, "one handle while it stays");
                self.handles.push((number, handle));
            }
            21 | 22 if !self.handles.is_empty() => {
                let (number, handle) = self.handles[rng.below(self.handles.len())];
                let is_there = self.named.get(&number) == Some(&handle);
                assert_eq!(self.culler.key_of(handle).is_some(), is_there);
                if rng.below(3) == 0 {
                    assert_eq!(self.culler.remove_at(handle).is_some(), is_there);
                    (0..i32::from(is_there)).for_each(|_| self.note_remove(number));
                } else {
                    let bounds = any_box(rng);
                    assert_eq!(self.culler.set_at(handle, arrays(&bounds)), is_there);
                    (0..i32::from(is_there)).for_each(|_| self.note_set(number, bounds));
                }
            }
            23 if rng.below(8) == 0 => {
                let part = rng.below(3) as u32;
                if part == 0 {
                    self.culler.clear();
                    let all: Vec<u32> = self.objects.keys().copied().collect();
                    all.into_iter().for_each(|number| self.note_remove(number));
                } else {
                    let gone: Vec<u32> =
                        self.boxes().map(|(number, _)| number).filter(|n| n % 3 == part).collect();
                    let keys: BTreeSet<K> = gone.iter().map(|&number| (self.key)(number)).collect();
                    self.culler.retain(|key, _| !keys.contains(&key));
                    gone.into_iter().for_each(|number| self.note_remove(number));
                }
            }
            23 => {
                let boxes: Vec<_> =
                    (0..rng.below(9)).map(|_| (rng.below(self.most) as u32, any_box(rng))).collect();
                let of = |&(number, bounds): &(u32, Aabb)| ((self.key)(number), arrays(&bounds));
                self.culler.set_many(&boxes.iter().map(of).collect::<Vec<_>>());
                boxes.into_iter().for_each(|(number, bounds)| self.note_set(number, bounds));
            }
            5 => {
                // It grows, and keeps its occluder.
                let Some(bounds) = self.objects.get(&number).and_then(|object| object.bounds) else { return };
                let by = bounds.extent() * 0.1;
                if bounds.extent().x < 0.12 * bounds.center().z.abs() {
                    self.set(number, Aabb::new(bounds.min - by, bounds.max + by));
                }
            }
            6 => {
                let first = rng.below(self.most);
                for number in first..(first + rng.below(self.most)).min(self.most) {
                    self.set(number as u32, any_box(rng));
                }
            }
            7 => self.set(number, Aabb::new(Vec3::new(0.0, f32::NAN, 0.0), Vec3::ONE)),
            8..11 => {
                self.culler.remove(key);
                self.note_remove(number);
            }
            11 | 12 => {
                let layers = [0, 1, 1, 2, 3][rng.below(5)];
                self.culler.set_layers(key, layers);
                self.object(number).layers = layers;
            }
            13..16 => {
                let (number, cell) = (rng.below(OWNERS.min(self.most)) as u32, rng.below(CELLS));
                let others = self.objects.iter().filter(|&(&other, _)| other != number);
                if self.taken.contains(&cell) || others.into_iter().any(|(_, o)| o.occluder == Some(cell)) {
                    return;
                }
                self.culler.set_occluder((self.key)(number), occluder(cell, rng.below(2) == 0));
                self.object(number).occluder = Some(cell);
            }
            16 => {
                self.culler.remove_occluder(key);
                if let Some(object) = self.objects.get_mut(&number) {
                    object.occluder = None;
                }
            }
            17 => {
                self.culler.commit();
                self.note_commit();
            }
            _ => self.cull(rng),
        }
    }

    fn cull(&mut self, rng: &mut Rng) {
        let mut cameras = Vec::new();
        self.note_commit();
        self.frame.clear();
        for _ in 0..rng.below(4) + rng.below(2) * 7 {
            let (is_turned, hides) = (rng.below(4) == 0, rng.below(3) > 0);
            let layers = [ALL_LAYERS, 1, 2, 3][rng.below(4)];
            let camera = camera(is_turned).on_layers(layers);
            cameras.push(if hides { camera.hide_by_occluders() } else { camera });
            let is_seen = |&(number, bounds): &(u32, Aabb)| {
                camera.frustum().may_see(&bounds) && self.objects[&number].layers & layers != 0
            };
            let in_view: BTreeMap<u32, Aabb> = self.boxes().filter(is_seen).collect();
            let covered = if hides && !is_turned { self.covered(layers) } else { BTreeSet::new() };
            let is_drawn = |&(_, bounds): &(&u32, &Aabb)| {
                bounds.center().z >= -WALL_M || !covered.contains(&cell_of(bounds))
            };
            let drawn = in_view.iter().filter(is_drawn).map(|(number, _)| *number).collect();
            self.frame.push(Sight { in_view: in_view.into_keys().collect(), drawn, covered });
        }
        self.culler.cull(&cameras);
        self.refused = std::mem::take(&mut self.refused_since);
    }

    fn check(&mut self, rng: &mut Rng) {
        let key = self.key;
        let keys =
            |numbers: &BTreeSet<u32>| numbers.iter().map(|&number| key(number)).collect::<BTreeSet<K>>();
        let all = |found: Vec<K>| {
            let set: BTreeSet<K> = found.iter().copied().collect();
            assert_eq!(set.len(), found.len(), "each once");
            set
        };
        assert_eq!(self.culler.len(), self.boxes().count());
        assert_eq!(self.culler.is_empty(), self.boxes().next().is_none());
        let refused: Vec<K> = self.culler.refused().map(|(key, _)| key).collect();
        assert_eq!(refused, self.refused.iter().map(|&number| key(number)).collect::<Vec<_>>());
        assert!(self.culler.refused().all(|(_, why)| matches!(why, Refusal::Bounds(_))));

        let frame = self.culler.frame();
        assert_eq!((frame.len(), frame.iter().count()), (self.frame.len(), self.frame.len()));
        for (seen, sight) in frame.iter().zip(&self.frame) {
            assert_eq!(all(seen.iter().collect()), keys(&sight.drawn), "{sight:?}");
            assert_eq!((seen.len(), seen.is_empty()), (sight.drawn.len(), sight.drawn.is_empty()));
            assert_eq!(seen.hidden(), sight.in_view.len() - sight.drawn.len());
            for cell in 0..CELLS {
                let behind = arrays(&Aabb::cube(middle(cell) * 6.0, 0.1));
                assert_eq!(seen.hides_box(behind), sight.covered.contains(&cell), "{sight:?}");
                assert!(!seen.hides_box(arrays(&Aabb::cube(middle(cell) * FRONT_M, 0.1))));
            }
        }
        for number in 0..self.most as u32 {
            let bounds = self.objects.get(&number).and_then(|object| object.bounds);
            assert_eq!(self.culler.bounds(key(number)), bounds.map(|bounds| arrays(&bounds)), "{number}");
            for (seen, sight) in frame.iter().zip(&self.frame) {
                assert_eq!(seen.contains(key(number)), sight.drawn.contains(&number));
                assert_eq!(seen.is_in_view(key(number)), sight.in_view.contains(&number));
            }
        }

        let listed: BTreeMap<K, [[f32; 3]; 2]> = self.culler.iter().collect();
        assert_eq!(listed, self.boxes().map(|(number, bounds)| (key(number), arrays(&bounds))).collect());

        let boxes: BTreeMap<K, Aabb> =
            self.committed.iter().map(|(&number, &bounds)| (key(number), bounds)).collect();
        let where_all = |is_it: &dyn Fn(&Aabb) -> bool| {
            boxes.iter().filter(|(_, bounds)| is_it(bounds)).map(|(key, _)| *key).collect::<BTreeSet<K>>()
        };
        let probe = any_box(rng);
        let probe = if rng.below(2) == 0 { probe } else { Aabb::cube(Vec3::ZERO, 13.0).union(&probe) };
        let found = all(self.culler.in_box(arrays(&probe)).collect());
        assert_eq!(found, where_all(&|bounds| bounds.intersects(&probe)));
        let (center, radius_m) = (any_box(rng).center(), [0.2, 5.0, 1.0e4][rng.below(3)]);
        let found = all(self.culler.in_sphere(center, radius_m).collect());
        assert_eq!(found, where_all(&|bounds| bounds.distance_squared(center) <= radius_m * radius_m));

        let distance_m = |bounds: &Aabb| bounds.distance_squared(center).sqrt();
        let mut nearest: Vec<f32> = boxes.values().map(distance_m).collect();
        nearest.sort_by(f32::total_cmp);
        nearest.truncate(rng.below(8));
        let found: Vec<(K, f32)> = self.culler.nearest(center, nearest.len()).collect();
        assert!(found.iter().all(|(key, found_m)| distance_m(&boxes[key]) == *found_m));
        assert_eq!(found.iter().map(|(_, found_m)| *found_m).collect::<Vec<_>>(), nearest);

        let ray = Ray::new(Vec3::ZERO, any_box(rng).center());
        let t_max = [f32::INFINITY, 1.0][rng.below(2)];
        let (entered, ts): (Vec<K>, Vec<f32>) = self.culler.on_ray(ray, t_max).unzip();
        assert!(ts.is_sorted());
        assert_eq!(all(entered), where_all(&|bounds| ray.enter_box(bounds, t_max).is_some()));
        let first = boxes.values().filter_map(|bounds| ray.enter_box(bounds, f32::INFINITY));
        let hit = self.culler.pick(ray, |key, ray| ray.enter_box(&boxes[&key], f32::INFINITY));
        let first = first.min_by(f32::total_cmp);
        assert_eq!(hit.map(|(_, t)| t), first);

        let layers = [ALL_LAYERS, 1, 2][rng.below(3)];
        let is_on = |number: &u32| layers == ALL_LAYERS || self.objects[number].layers & layers != 0;
        let boxes: BTreeMap<K, Aabb> =
            self.committed.iter().filter(|(number, _)| is_on(number)).map(|(&n, &b)| (key(n), b)).collect();
        let (mut found, query) = (Vec::new(), self.culler.on_layers(layers));
        query.in_box(arrays(&probe), &mut found);
        assert_eq!(
            all(found),
            boxes.iter().filter(|(_, b)| b.intersects(&probe)).map(|(key, _)| *key).collect()
        );
        let (mut on_ray, mut firsts) = (Vec::new(), Vec::new());
        query.on_ray(ray, t_max, &mut on_ray);
        let mut entered: Vec<f32> =
            boxes.values().filter_map(|bounds| ray.enter_box(bounds, t_max)).collect();
        entered.sort_by(f32::total_cmp);
        assert_eq!(on_ray.iter().map(|(_, t)| *t).collect::<Vec<_>>(), entered);
        query.first_on_rays(&[ray, ray], t_max, &mut firsts);
        assert!(firsts.iter().all(|first| first.map(|(_, t)| t) == entered.first().copied()));
        let mut near = Vec::new();
        query.nearest(center, 3, &mut near);
        assert_eq!(near.len(), boxes.len().min(3));

        // Without the culler's own lists, by a copy, too.
        let mut state = ViewState::default();
        for is_turned in [false, true] {
            let camera = camera(is_turned).on_layers(layers);
            let is_seen = |(number, bounds): &(&u32, &Aabb)| {
                self.objects[number].layers & layers != 0 && camera.frustum().may_see(bounds)
            };
            let seen = self.committed.iter().filter(is_seen).map(|(&number, _)| key(number)).collect();
            assert_eq!(all(self.culler.cull_view(&camera, &mut state).iter().collect()), seen);
        }
    }

    /// Boxes of no object. The culler commits.
    fn check_hidden(&mut self, rng: &mut Rng) {
        let (layers, is_turned) = ([ALL_LAYERS, 1, 2][rng.below(3)], rng.below(3) == 0);
        let probes: Vec<Aabb> = (0..8).map(|_| any_box(rng)).chain([Aabb::EMPTY]).collect();
        let camera = camera(is_turned).on_layers(layers).hide_by_occluders();
        let hidden = self.culler.are_hidden(&camera, &probes.iter().map(arrays).collect::<Vec<_>>());
        let covered = if is_turned { BTreeSet::new() } else { self.covered(layers) };
        for (probe, is_hidden) in probes.iter().zip(hidden) {
            let is_behind = probe.center().z < -WALL_M && covered.contains(&cell_of(probe));
            let is_out = !camera.frustum().may_see(probe) || is_behind;
            assert_eq!(is_hidden, probe.is_valid() && is_out, "{probe:?} {covered:?}");
        }
        self.note_commit();
    }
}

fn run<K: Key + Ord + std::fmt::Debug>(key: fn(u32) -> K) {
    for (most, steps, check_every) in [(3, 20_000, 1), (12, 10_000, 1), (60, 3_000, 3), (5000, 200, 5)] {
        let mut rng = Rng(most as u64);
        let mut model = Model::new(most, key);
        for step in 0..steps {
            match rng.below(40) {
                0 => {
                    let mut other = Model::new(most, key);
                    other.taken = model.objects.values().filter_map(|object| object.occluder).collect();
                    (0..rng.below(20)).for_each(|_| other.change(&mut rng));
                    model.append(other);
                }
                1 => model.check_hidden(&mut rng),
                2 if rng.below(4) == 0 => {
                    for number in 0..most as u32 {
                        model.culler.remove(key(number));
                        model.note_remove(number);
                    }
                }
                _ => model.change(&mut rng),
            }
            if step % check_every == 0 {
                model.check(&mut rng);
            }
        }
    }
}

#[test]
fn a_culler_of_hashed_keys_is_a_plain_map_in_every_order_of_calls() {
    run(|number| u64::from(number) << 33 | 5);
}

#[test]
fn a_culler_of_numbers_is_a_plain_map_in_every_order_of_calls() {
    run(Dense);
}
