//! Test scenes for the comparison of occlusion culling methods. Tests, benchmarks and `osp verify` share them.
//!
//! Each scene is a session of events: first the model, then head poses, which are the views.

use glam::{DVec3, Quat, Vec3};

use osp_session::recording::{Author, Event, NormalRule, StrokeId, Tool};

/// Number of head poses of a scene.
const VIEWS: usize = 24;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestScene {
    /// Nine furnished rooms with doors, seen from inside: a few large walls hide nearly everything.
    Rooms,
    /// Upright panels in a hall full of small objects: each panel hides a part, and several together hide more.
    Panels,
    /// Ribbons 4 cm wide in a 4 m cube, seen from outside: hardly any ribbon is large enough to hide another.
    NarrowRibbons,
    WideRibbons,
}

impl TestScene {
    pub const ALL: &'static [Self] = &[Self::Rooms, Self::Panels, Self::NarrowRibbons, Self::WideRibbons];

    /// The scene's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rooms => "rooms",
            Self::Panels => "panels",
            Self::NarrowRibbons => "ribbons-narrow",
            Self::WideRibbons => "ribbons-wide",
        }
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|scene| scene.name() == name)
    }

    /// The scene's events: about 5,000 to 20,000 polygons, then the head poses. They are always the same.
    pub fn events(self) -> Vec<Event> {
        let mut scene = Builder { events: Vec::new(), random: Random(1), strokes: 0 };
        match self {
            Self::Rooms => rooms(&mut scene),
            Self::Panels => panels(&mut scene),
            Self::NarrowRibbons => ribbons(&mut scene, 0.04),
            Self::WideRibbons => ribbons(&mut scene, 0.2),
        }
        scene.events
    }
}

/// The SplitMix64 generator: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014.
pub(super) struct Random(u64);

impl Random {
    #[cfg(feature = "bench")]
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(super) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = self.0;
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(super) fn within(&mut self, low: DVec3, high: DVec3) -> DVec3 {
        DVec3::new(self.range(low.x, high.x), self.range(low.y, high.y), self.range(low.z, high.z))
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.within(DVec3::NEG_ONE, DVec3::ONE);
            if (0.01..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

struct Builder {
    events: Vec<Event>,
    random: Random,
    strokes: u32,
}

impl Builder {
    fn quad(&mut self, corners: [DVec3; 4]) {
        let color = (0.7, 0.6, 0.5, 1.0);
        let vertices = corners.iter().map(|p| p.as_vec3()).collect();
        self.events.push(Event::Polygon {
            author: Author::SOLE,
            t: 0.0,
            stroke: None,
            vertices,
            shading: None,
            color,
        });
    }

    /// A rectangle, from one corner along two edges.
    fn sheet(&mut self, corner: DVec3, u: DVec3, v: DVec3) {
        self.quad([corner, corner + u, corner + u + v, corner + v]);
    }

    fn solid(&mut self, low: DVec3, high: DVec3) {
        let size = high - low;
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        for (corner, u, v) in
            [(low, x, y), (low, y, z), (low, z, x), (high, -x, -y), (high, -y, -z), (high, -z, -x)]
        {
            self.sheet(corner, u, v);
        }
    }

    /// Adds a head pose at `eye` that looks in a direction, +y up.
    fn look(&mut self, eye: DVec3, direction: DVec3) {
        let back = -direction.normalize().as_vec3();
        let right = Vec3::Y.cross(back).normalize();
        let q = Quat::from_rotation_axes(right, back.cross(right), back).normalize();
        self.events.push(Event::Head { author: Author::SOLE, t: 0.0, p: eye.as_vec3(), q });
    }
}

fn rooms(scene: &mut Builder) {
    const ROOMS: i32 = 3;
    const SIZE: f64 = 4.0;
    const HEIGHT: f64 = 2.8;
    const DOOR: f64 = 1.0;
    let span = f64::from(ROOMS) * SIZE;
    for i in 0..=ROOMS {
        let across = f64::from(i) * SIZE;
        for k in 0..ROOMS {
            let along = f64::from(k) * SIZE;
            let has_door = i > 0 && i < ROOMS;
            for (corner, u) in
                [(DVec3::new(across, 0.0, along), DVec3::Z), (DVec3::new(along, 0.0, across), DVec3::X)]
            {
                let up = DVec3::Y * HEIGHT;
                if has_door {
                    let side = (SIZE - DOOR) * 0.5;
                    scene.sheet(corner, u * side, up);
                    scene.sheet(corner + u * (side + DOOR), u * side, up);
                    scene.sheet(corner + u * side + DVec3::Y * 2.1, u * DOOR, DVec3::Y * (HEIGHT - 2.1));
                } else {
                    scene.sheet(corner, u * SIZE, up);
                }
            }
        }
    }
    for i in 0..ROOMS {
        for k in 0..ROOMS {
            let corner = DVec3::new(f64::from(i), 0.0, f64::from(k)) * SIZE;
            for height in [0.0, HEIGHT] {
                scene.sheet(corner + DVec3::Y * height, DVec3::X * SIZE, DVec3::Z * SIZE);
            }
            let high = corner + DVec3::new(SIZE, HEIGHT, SIZE);
            for _ in 0..8 {
                let size = scene.random.within(DVec3::splat(0.1), DVec3::new(0.8, 0.9, 0.8));
                let low = scene.random.within(corner + DVec3::splat(0.02), high - size - DVec3::splat(0.02));
                let low = DVec3::new(low.x, 0.0, low.z);
                scene.solid(low, low + size);
            }
            for _ in 0..700 {
                let at = scene.random.within(corner + DVec3::splat(0.1), high - DVec3::splat(0.1));
                small_thing(scene, at, 0.05);
            }
        }
    }
    for _ in 0..VIEWS {
        let eye = scene.random.within(DVec3::new(0.3, 1.5, 0.3), DVec3::new(span - 0.3, 1.75, span - 0.3));
        let direction = scene.random.direction();
        scene.look(eye, DVec3::new(direction.x, 0.2 * direction.y, direction.z));
    }
}

fn small_thing(scene: &mut Builder, at: DVec3, size: f64) {
    let u = scene.random.direction();
    let v = u.cross(scene.random.direction()).normalize_or(u.any_orthonormal_vector());
    let (u, v) = (u * size * scene.random.range(0.3, 1.0), v * size * scene.random.range(0.3, 1.0));
    scene.sheet(at, u, v);
}

fn panels(scene: &mut Builder) {
    const HALF: f64 = 10.0;
    for _ in 0..90 {
        let along = scene.random.direction();
        let along = DVec3::new(along.x, 0.0, along.z).normalize_or(DVec3::X) * scene.random.range(1.0, 3.5);
        let corner = scene.random.within(DVec3::new(-HALF, 0.0, -HALF), DVec3::new(HALF, 0.4, HALF));
        let height = scene.random.range(1.5, 3.0);
        scene.sheet(corner, along, DVec3::Y * height);
    }
    for _ in 0..8000 {
        let at = scene.random.within(DVec3::new(-HALF, 0.0, -HALF), DVec3::new(HALF, 2.2, HALF));
        small_thing(scene, at, 0.1);
    }
    for _ in 0..VIEWS {
        let eye = scene.random.within(DVec3::new(-HALF, 1.4, -HALF), DVec3::new(HALF, 1.8, HALF));
        let target = scene.random.within(DVec3::new(-3.0, 1.0, -3.0), DVec3::new(3.0, 1.6, 3.0));
        scene.look(eye, target - eye);
    }
}

fn ribbons(scene: &mut Builder, width_m: f64) {
    const POINTS: usize = 40;
    let low = DVec3::new(-2.0, -0.5, -2.0);
    let high = DVec3::new(2.0, 3.5, 2.0);
    for _ in 0..500 {
        let stroke = StrokeId(scene.strokes);
        scene.strokes += 1;
        scene.events.push(Event::Begin {
            author: Author::SOLE,
            t: 0.0,
            stroke,
            tool: Tool::Ribbon,
            width: width_m as f32,
            color: (0.5, 0.6, 0.8, 1.0),
            normal: NormalRule::Transport,
            thinnest: 1.0,
            paint: None,
        });
        let mut at = scene.random.within(low, high);
        let mut travel = scene.random.direction();
        let mut turn = scene.random.direction();
        for _ in 0..POINTS {
            scene.events.push(Event::Point {
                t: 0.0,
                stroke,
                p: at.as_vec3(),
                q: Quat::IDENTITY,
                pressure: 1.0,
            });
            turn = (turn + scene.random.direction() * 0.4).normalize_or(turn);
            travel = (travel + turn * 0.12).normalize_or(travel);
            at += travel * 0.03;
            for axis in 0..3 {
                if at[axis] < low[axis] || at[axis] > high[axis] {
                    travel[axis] = -travel[axis];
                    at[axis] = at[axis].clamp(low[axis], high[axis]);
                }
            }
        }
        scene.events.push(Event::End { t: 0.0, stroke });
    }
    for _ in 0..VIEWS {
        let direction = scene.random.direction();
        let direction = DVec3::new(direction.x, 0.4 * direction.y, direction.z).normalize_or(DVec3::X);
        let eye = DVec3::new(0.0, 1.5, 0.0) + direction * scene.random.range(3.5, 4.5);
        scene.look(eye, -direction);
    }
}
