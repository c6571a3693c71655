//! Walls that are cut small: few occluders hide what is behind them, and nothing that shows through a hole.

use glam::{DVec3, Vec3};
use osp::{
    math::Aabb,
    occlusion::{OccluderPool, PoolConfig, SelectConfig, Selector, ShadowVolume},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId},
    view::ViewWindow,
};

use super::{
    connected::{Polygons, convex},
    judge::is_blocked,
    random::{Polygon, Random, window},
};

/// A wall of triangles.
struct Model(Polygons);

impl Model {
    /// A wall 8 m wide and 6 m high before an eye in the origin that looks along +z, in columns and rows of two triangles each that
    /// stick out by up to so much, some of them turned round.
    fn wall(columns: usize, rows: usize, rough_m: f64, hole: f64, random: &mut Random) -> Self {
        let points: Vec<Vec3> = (0..(columns + 1) * (rows + 1))
            .map(|i| {
                let (x, y) = ((i % (columns + 1)) as f64, (i / (columns + 1)) as f64);
                let mut out = || random.range(-rough_m, rough_m);
                let at = DVec3::new(x / columns as f64 * 8.0 - 4.0, y / rows as f64 * 6.0 - 3.0, 5.0);
                (at + DVec3::new(out(), out(), out())).as_vec3()
            })
            .collect();
        let mut triangles = Vec::new();
        for y in 0..rows {
            for x in 0..columns {
                let at = |dx: usize, dy: usize| points[(y + dy) * (columns + 1) + x + dx];
                for mut triangle in [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]] {
                    if random.chance(0.3) {
                        triangle.reverse();
                    }
                    triangles.push((!random.chance(hole)).then(|| convex(&triangle)));
                }
            }
        }
        // In no order.
        for i in (1..triangles.len()).rev() {
            triangles.swap(i, random.below(i + 1));
        }
        Self(Polygons(triangles))
    }

    fn polygons(&self) -> Vec<Polygon> {
        self.0.0.iter().flatten().map(|triangle| triangle.vertices().to_vec()).collect()
    }

    fn loaded(&self) -> OccluderPool {
        let changes: Vec<_> = (0..self.0.0.len() as u32).map(|id| Change::Insert(PolygonId(id))).collect();
        let mut pool = OccluderPool::new(PoolConfig::default());
        pool.follow(&self.0, &changes);
        pool.join_walls(&self.0);
        pool
    }

    fn chosen(&self, pool: &OccluderPool, window: &ViewWindow, occluders: usize) -> Vec<ShadowVolume> {
        let mut selector = Selector::new(SelectConfig { occluders, ..SelectConfig::default() });
        selector.select(pool, &self.0, window);
        selector.chosen().to_vec()
    }
}

/// A window 90 degrees wide.
fn ahead(eye: DVec3) -> ViewWindow {
    window(eye, DVec3::Z, DVec3::Y, [1.0, 1.0], [0.0, 0.0], 0.05)
}

#[test]
fn few_occluders_stand_for_a_wall_of_thousands_of_triangles_in_no_order() {
    let mut random = Random::new(3);
    let model = Model::wall(60, 40, 0.01, 0.0, &mut random);
    let pool = model.loaded();
    let window = ahead(DVec3::ZERO);
    let chosen = model.chosen(&pool, &window, 16);
    let found: f64 = chosen.iter().map(|shadow| shadow.solid_angle_in(&window)).sum();
    // 8 m by 6 m at 5 m.
    assert!(found > 0.7, "16 occluders fill {found} sr");
}

#[test]
fn what_is_said_to_be_behind_a_wall_is_behind_one_of_its_triangles() {
    let mut rays = 0;
    for n in 0..12 {
        let mut random = Random::new(40 + n);
        let rough_m = [0.0, 0.02, 0.1, 0.4][n as usize % 4];
        let hole = [0.0, 0.01, 0.05][n as usize % 3];
        let model = Model::wall(60, 40, rough_m, hole, &mut random);
        let (pool, polygons) = (model.loaded(), model.polygons());
        for _ in 0..4 {
            let eye = DVec3::new(random.range(-4.0, 4.0), random.range(-3.0, 3.0), random.range(-3.0, 4.0));
            let window = ahead(eye);
            for shadow in model.chosen(&pool, &window, 16) {
                for _ in 0..6 {
                    let mix = shadow.corners().iter().map(|v| *v * random.unit()).sum::<DVec3>();
                    let at_cap = mix * (shadow.cap_distance_m() / shadow.cap_normal().dot(mix));
                    assert!(is_blocked(&window, &polygons, at_cap * (1.0 + 1.0e-6)), "{n}: {at_cap}");
                    rays += 1;
                }
            }
        }
    }
    assert!(rays > 500, "{rays}");
}

#[test]
fn a_wall_goes_with_the_first_of_its_triangles() {
    let mut random = Random::new(9);
    let mut model = Model::wall(60, 40, 0.01, 0.0, &mut random);
    let mut pool = model.loaded();
    let largest = |pool: &OccluderPool| pool.candidates().map(<[PolygonId]>::len).max();
    assert!(largest(&pool) > Some(100), "{:?}", largest(&pool));
    for id in 0..model.0.0.len() as u32 {
        model.0.0[id as usize] = None;
        pool.follow(&model.0, &[Change::Remove(PolygonId(id))]);
        if id % 64 == 0 {
            assert!(pool.candidates().flatten().all(|id| model.0.is_present(*id)), "{id}");
        }
    }
    assert!(pool.is_empty());
}

/// A wall of which one triangle was painted see-through.
struct WithPane<'a>(&'a Polygons, PolygonId);

impl Geometry for WithPane<'_> {
    fn id_end(&self) -> usize {
        self.0.id_end()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        self.0.is_present(id)
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.0.bounds(id)
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        self.0.polygon(id)
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        id != self.1
    }
}

#[test]
fn a_wall_ends_when_one_of_its_triangles_is_painted_see_through() {
    let model = Model::wall(60, 40, 0.01, 0.0, &mut Random::new(3));
    // So few candidates that most triangles of the wall are in no other.
    let config = PoolConfig { capacity: 16, ..PoolConfig::default() };
    let all: Vec<_> = (0..model.0.0.len() as u32).map(|id| Change::Insert(PolygonId(id))).collect();
    let mut in_walls = 0;
    for (number, roughly) in [(0, false), (700, true), (1800, false), (3100, true)] {
        let mut pool = OccluderPool::new(config);
        pool.follow(&model.0, &all);
        pool.join_walls(&model.0);
        let id = PolygonId(number);
        let holds = |pool: &OccluderPool| pool.candidates().any(|ids| ids.contains(&id));
        in_walls += usize::from(holds(&pool));
        let (painted, change) = (WithPane(&model.0, id), [Change::Repaint(id)]);
        match roughly {
            true => _ = pool.follow_roughly(&painted, &change, 16),
            false => pool.follow(&painted, &change),
        }
        assert!(!holds(&pool), "polygon {number} hides nothing any more");
    }
    assert!(in_walls > 0, "a wall holds some of them");
}

#[test]
fn a_pool_of_any_size_can_be_asked_for() {
    let pool = OccluderPool::new(PoolConfig { capacity: 1 << 19, ..PoolConfig::default() });
    assert!(pool.is_empty());
}
