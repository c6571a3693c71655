//! Every guard of occlusion culling once: a scene in which something visible is hidden, or something that touches counts
//! as hidden, as soon as the guard goes.

use super::{
    judge::{hides, is_blocked},
    random::{Polygon, Random, shadows_of, sound_cullers, straight, window},
    session::{Told, polygon, view},
};
use glam::{DVec3, Vec3};
use osp::{
    math::Aabb,
    occlusion::{
        CoverageBuffer, EDGE_ON_SINE, END_ON_SINE, NotAnOccluder, OccluderPool, OcclusionCuller,
        PreviousFrameOccluders, SelectConfig, Selector, ShadowVolume, Verdict,
        msvbsp::{Msvbsp, MsvbspConfig},
    },
    polygon::{Change, PolygonId, VisibleBlocks},
    view::ViewWindow,
};
use osp_rivals::RivalOcclusion;
use osp_session::{recording::Event, scene::Scene};
use osp_testkit::events::SOLE;

fn at(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// A rectangle that faces the eye.
pub(crate) fn rectangle(z: f32, x: [f32; 2], y: [f32; 2]) -> [Vec3; 4] {
    [at(x[0], y[0], z), at(x[1], y[0], z), at(x[1], y[1], z), at(x[0], y[1], z)]
}

fn point(x: Vec3) -> Aabb {
    Aabb::new(x, x)
}

/// What the pool of a scene chooses for a window.
fn chosen(pool: &OccluderPool, scene: &Scene, window: &ViewWindow) -> Vec<ShadowVolume> {
    let mut selector = Selector::new(SelectConfig { least_share: 1.0e-6, ..SelectConfig::default() });
    selector.select(pool, scene, window);
    selector.chosen().to_vec()
}

/// A quad bent away from the eye: the cap lies behind its farthest corner.
#[test]
fn the_cap_lies_behind_the_farthest_corner_of_a_bent_quad() {
    let window = straight(1.0, 0.01);
    for corner in 0..4 {
        for far in [1.5f32, 1.05, 1.001] {
            let mut quad = rectangle(4.0, [-3.0, 3.0], [-3.0, 3.0]);
            quad[corner] *= far;
            let polygons = [quad.to_vec()];
            let cullers = sound_cullers(&window, &shadows_of(&window, &polygons));
            assert!(ShadowVolume::of_polygon(&quad, &window).is_ok(), "convex as seen");
            // Just before the corner that is farthest, and before the middle of the triangle that it belongs to.
            for inwards in [0.02f32, 0.1, 0.3] {
                let before = (quad[corner].lerp(Vec3::Z * 4.0, inwards)) * (1.0 - 1.0e-4);
                let is_visible = !is_blocked(&window, &polygons, before.as_dvec3());
                for culler in &cullers {
                    assert!(!is_visible || !hides(&**culler, &point(before)), "{} {before}", culler.name());
                    let behind = point(quad[corner].lerp(Vec3::Z * 4.0, 0.1) * 2.0);
                    assert!(hides(&**culler, &behind), "{}", culler.name());
                }
            }
        }
    }
}

/// The corner in the middle of a bowl is not on its border, and it is the farthest.
#[test]
fn the_cap_of_a_patch_lies_behind_the_corners_inside_its_border() {
    for depth in [0.05f32, 0.2, 0.4] {
        let tip = at(0.0, 0.0, -4.0 - depth);
        let rim = [at(-1.0, -1.0, -4.0), at(1.0, -1.0, -4.0), at(1.0, 1.0, -4.0), at(-1.0, 1.0, -4.0)];
        let events: Vec<Event> = (0..4).map(|i| polygon(&[rim[i], rim[(i + 1) % 4], tip], 1.0)).collect();
        let told = Told::of(&events);
        let pool = told.pool();
        assert_eq!(pool.len(), 1, "one patch");
        let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
        let shadows = chosen(&pool, &told.scene, &window);
        assert_eq!(shadows.len(), 1, "one outline");
        for culler in sound_cullers(&window, &shadows) {
            // In the bowl: behind the rim, before the tip.
            for t in [0.3, 0.6, 0.9] {
                let inside = Aabb::cube(at(0.0, 0.0, -4.0 - depth * t), depth * 0.02);
                assert!(!hides(&*culler, &inside), "{} {depth} {t}", culler.name());
            }
            let behind = Aabb::cube(at(0.0, 0.0, -6.0), 0.1);
            assert!(hides(&*culler, &behind), "{} hides what is behind", culler.name());
        }
    }
}

/// A wall of a patch that goes on before the near plane: nothing is drawn there, so nothing is hidden there.
#[test]
fn a_patch_that_reaches_before_the_near_plane_hides_nothing_there() {
    let window = straight(1.0, 1.0);
    // A plane that rises to the right: x = 2 z - 2.2, from z = 0.7 to z = 1.5.
    let rungs = [0.7f32, 1.1, 1.5].map(|z| [at(2.0 * z - 2.2, -0.6, z), at(2.0 * z - 2.2, 0.6, z)]);
    let quads: Vec<[Vec3; 4]> = rungs.windows(2).map(|w| [w[0][0], w[1][0], w[1][1], w[0][1]]).collect();
    let told = Told::of(&quads.iter().map(|quad| polygon(quad, 1.0)).collect::<Vec<_>>());
    let pool = told.pool();
    assert_eq!(pool.len(), 1, "one patch");
    let polygons: Vec<Polygon> = quads.iter().map(|quad| quad.to_vec()).collect();
    let shadows = chosen(&pool, &told.scene, &window);
    assert!(!shadows.is_empty());
    let last = built_last(&told.scene, &window);
    let (mut open, mut hidden) = (0, 0);
    let cullers = sound_cullers(&window, &shadows);
    for culler in cullers.iter().map(|culler| &**culler).chain([last.culler() as &dyn OcclusionCuller]) {
        for i in -18..18 {
            let x = at(i as f32 * 0.05, 0.01, 1.0) * 5.0;
            let bounds = Aabb::cube(x, 0.001);
            if is_blocked(&window, &polygons, x.as_dvec3()) {
                hidden += u32::from(hides(culler, &bounds));
            } else {
                open += 1;
                assert!(!hides(culler, &bounds), "{}: {x}", culler.name());
            }
        }
    }
    assert!(open > 20 && hidden > 20, "{open} {hidden}");
}

/// The picture when everything in view was visible in the last frame.
fn built_last(scene: &Scene, window: &ViewWindow) -> PreviousFrameOccluders {
    let ids: VisibleBlocks = scene.visible_ids().collect();
    let changes: Vec<Change> = ids.ids().map(Change::Insert).collect();
    let mut last = PreviousFrameOccluders::new(PreviousFrameOccluders::PICTURE, 8);
    last.follow(&changes);
    last.build(0, scene, window, &ids);
    last
}

/// What is drawn then.
pub(crate) fn drawn_last(scene: &Scene, window: &ViewWindow) -> Vec<u32> {
    let last = built_last(scene, window);
    let is_drawn = |id: &PolygonId| {
        let polygon = scene.polygon(*id);
        !last.culler().hides_polygon(&polygon) && !hides(last.culler(), &polygon.bounds())
    };
    scene.visible_ids().filter(is_drawn).map(|id| id.0).collect()
}

/// Glass hides nothing, alone or as the neighbour of a wall, however it comes: by itself, first, second or on both sides.
#[test]
fn what_can_be_seen_through_hides_nothing_in_the_next_frame() {
    let window = straight(1.0, 0.01);
    for opacity in [0.0, 0.5, 0.999_999, f32::NAN, 1.0] {
        for glass in [[true, false], [false, true], [true, true]] {
            let of = |is_glass: bool| if is_glass { opacity } else { 1.0 };
            let told = Told::of(&[
                polygon(&rectangle(2.0, [-1.0, 0.0], [-1.0, 1.0]), of(glass[0])),
                polygon(&rectangle(2.0, [0.0, 1.0], [-1.0, 1.0]), of(glass[1])),
                polygon(&rectangle(4.0, [-1.2, -0.8], [-0.2, 0.2]), 1.0),
                polygon(&rectangle(4.0, [0.8, 1.2], [-0.2, 0.2]), 1.0),
                polygon(&rectangle(4.0, [-0.4, 0.4], [-0.2, 0.2]), 1.0),
            ]);
            let drawn = drawn_last(&told.scene, &window);
            let is_clear = opacity != 1.0;
            assert!(drawn.contains(&0) && drawn.contains(&1), "{glass:?} {opacity}");
            assert_eq!(drawn.contains(&2), glass[0] && is_clear, "left, {glass:?} {opacity}");
            assert_eq!(drawn.contains(&3), glass[1] && is_clear, "right, {glass:?} {opacity}");
            assert_eq!(drawn.contains(&4), is_clear, "across both, {glass:?} {opacity}");
        }
    }
}

/// Neighbours in the list that are not neighbours in space are no outline, and a hole between polygons stays open.
#[test]
fn only_what_was_drawn_last_hides() {
    let window = straight(1.0, 0.01);
    let told = Told::of(&[
        polygon(&rectangle(2.0, [-1.0, -0.1], [-1.0, 1.0]), 1.0),
        polygon(&rectangle(2.0, [0.1, 1.0], [-1.0, 1.0]), 1.0),
        polygon(&rectangle(4.0, [-0.05, 0.05], [-0.2, 0.2]), 1.0),
        polygon(&rectangle(4.0, [-1.0, -0.8], [-0.2, 0.2]), 1.0),
    ]);
    assert_eq!(drawn_last(&told.scene, &window), [0, 1, 2]);
    let ids: VisibleBlocks = told.scene.visible_ids().collect();
    let mut last = PreviousFrameOccluders::new(PreviousFrameOccluders::PICTURE, 8);
    let counts = last.build(0, &told.scene, &window, &VisibleBlocks::new());
    assert_eq!((counts.occluders, counts.tiles), (0, 0));
    // Each view has its own memory, and what came into it is taken for visible.
    assert_eq!(last.build(1, &told.scene, &window, &ids).occluders, 4);
    assert_eq!(last.build(0, &told.scene, &window, &ids).occluders, 4);
}

/// A point exactly on the border of a shadow, or exactly on its cap, is in no shadow: [`osp::occlusion::QUERY_SLACK`].
///
/// Corners with few digits, so that sums are exact: `a + b` is seen through the edge from a to b.
#[test]
fn what_touches_a_shadow_from_outside_or_inside_is_not_hidden() {
    let window = straight(1.0, 0.01);
    let mut touching = 0;
    for n in 0..400 {
        let mut random = Random::new(0x70C4 + n);
        let mut digits = |low: f64, high: f64| (random.range(low, high) * 64.0).round() as f32 / 64.0;
        let triangle = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| {
            let z = digits(1.0, 4.0);
            at(x * z * 0.5 + digits(-0.25, 0.25), y * z * 0.5 + digits(-0.25, 0.25), z)
        });
        let Ok(shadow) = ShadowVolume::of_polygon(&triangle, &window) else { continue };
        for culler in sound_cullers(&window, &[shadow]) {
            for i in 0..3 {
                let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                // On the side plane, on an edge of the shadow, and on the polygon itself.
                for x in [a + b, (a + b) * 2.0, a * 2.0, a * 4.0, a, (a + b) * 0.5] {
                    touching += 1;
                    assert!(!hides(&*culler, &point(x)), "{} {n}: {x} of {triangle:?}", culler.name());
                }
            }
        }
    }
    assert!(touching > 10_000, "{touching}");
}

/// A gap between two walls too narrow for any screen, and wider than rounding: it stays open, in the trees too, where a
/// plane is left out if the cell lies before it.
#[test]
fn a_gap_of_a_hundred_millionth_stays_open() {
    let window = straight(1.0, 0.01);
    for gap in [1.0e-6f32, 1.0e-7, 1.0e-8, 4.0e-9] {
        let walls = [
            rectangle(2.0, [-1.0, -gap], [-1.0, 1.0]).to_vec(),
            rectangle(2.0, [gap, 1.0], [-1.0, 1.0]).to_vec(),
        ];
        for culler in sound_cullers(&window, &shadows_of(&window, &walls)) {
            assert!(!hides(&*culler, &point(at(0.0, 0.1, 6.0))), "{} {gap}", culler.name());
            assert!(!hides(&*culler, &Aabb::cube(at(0.0, 0.1, 6.0), 0.1)), "{} {gap}", culler.name());
        }
    }
}

/// Where two polygons meet, the tree cuts once: the second one's plane is left out where the first has it, and no piece
/// is carried to the wrong side by rounding.
#[test]
fn shared_planes_cut_once() {
    let mut random = Random::new(31);
    for _ in 0..200 {
        let u = random.direction();
        let v = u.cross(random.direction()).normalize();
        let center = u.cross(v) * random.range(2.0, 4.0);
        let window = window(DVec3::ZERO, center, v, [2.0, 2.0], [0.0, 0.0], 0.01);
        let corner = |x: f64, y: f64| (center + u * x + v * y).as_vec3();
        let [a, b, c, d] = [corner(-1.0, -0.5), corner(0.0, -0.5), corner(0.0, 0.5), corner(-1.0, 0.5)];
        let shadows =
            [vec![a, b, c, d], vec![b, corner(1.0, 0.0), c]].map(|p| ShadowVolume::of_polygon(&p, &window));
        let shadows = shadows.map(|shadow| shadow.expect("an occluder"));
        let mut tree = Msvbsp::new(MsvbspConfig::default());
        let counts = tree.build(&window, &shadows);
        assert_eq!(counts.nodes, 6, "{counts:?}");
        assert!(counts.pieces <= 4, "{counts:?}");
    }
}

/// Just below and just above each limit for occluders.
#[test]
fn occluders_are_refused_exactly_below_their_limits() {
    let window = straight(1.0, 0.01);
    // Seen at this sine: a floor that begins at distance 10 and ends at 40, this far below the eye.
    let floor = |sine: f64| {
        let down = (-sine * 40.0) as f32;
        [at(-4.0, down, 10.0), at(4.0, down, 10.0), at(4.0, down, 39.0), at(-4.0, down, 39.0)]
    };
    let refused = |corners: &[Vec3]| ShadowVolume::of_polygon(corners, &window).err();
    assert_eq!(refused(&floor(0.5 * EDGE_ON_SINE)), Some(NotAnOccluder::EdgeOn));
    assert_eq!(refused(&floor(0.9 * EDGE_ON_SINE)), Some(NotAnOccluder::EdgeOn));
    assert_eq!(refused(&floor(1.5 * EDGE_ON_SINE)), None);
    // An edge that all but points at the eye makes a needle of the opposite corner: the product of both sines counts.
    let end_on = |sine: f32| [at(0.0, 0.0, 2.0), at(4.0 * sine, 0.0, 4.0), at(0.0, 1.0, 2.0)];
    assert_eq!(refused(&end_on(1.0e-4)), Some(NotAnOccluder::IllConditioned));
    assert_eq!(refused(&end_on(2.0e-3)), None);
    // A needle whose tip has this angle.
    let needle =
        |angle: f64| [at(0.0, -1.0, 2.0), at((2.0 * angle) as f32, -1.0, 2.0), at(angle as f32, 1.0, 2.0)];
    assert_eq!(refused(&needle(0.3 * END_ON_SINE)), Some(NotAnOccluder::IllConditioned));
    assert_eq!(refused(&needle(20.0 * END_ON_SINE)), None);
    // A corner dented by a millionth is not convex; one that is straight is.
    let dented =
        |dent: f32| [at(-1.0, -1.0, 2.0), at(1.0, -1.0, 2.0), at(1.0, 1.0, 2.0), at(dent, -dent, 2.0)];
    assert_eq!(refused(&dented(1.0e-6)), Some(NotAnOccluder::NotConvex));
    assert_eq!(refused(&dented(1.0e-8)), Some(NotAnOccluder::NotConvex));
    assert_eq!(refused(&dented(0.0)), None);
    assert_eq!(refused(&dented(-1.0e-6)), None);
    // Dented on a side: what shows through the dent is not hidden.
    for dent in [1.0e-2f32, 1.0e-4, 1.0e-6, 1.0e-8] {
        // Drawn around the dent; around another corner, a triangle would cover it.
        let mut polygons = [dented(dent).to_vec()];
        polygons[0].rotate_right(1);
        for culler in sound_cullers(&window, &shadows_of(&window, &polygons)) {
            let through = at(dent * 0.25, dent * -0.25, 2.0) * 3.0;
            assert!(!hides(&*culler, &point(through)), "{} {dent}", culler.name());
        }
    }
}

/// The buffer counts a row or column of pixels only if the polygon reaches beyond it, looks at every pixel that a box
/// touches, and takes what is as far as the polygon for visible.
#[test]
fn the_buffer_is_strict_about_borders_of_pixels_and_about_depth() {
    let window = straight(1.0, 0.01);
    let mut depth = CoverageBuffer::new(64, 64);
    let mut build = |x: [f32; 2], y: [f32; 2], z: f32| {
        let occluder = rectangle(1.0, x, y).map(|p| p * z);
        depth.build(&window, &[ShadowVolume::of_polygon(&occluder, &window).expect("an occluder")]);
        depth.clone()
    };
    // Pixels are 1/32 wide; the middle ones begin at 0. At twice the distance, everything is twice as large.
    let within = |low: [f32; 2], high: [f32; 2]| {
        Aabb::new(at(low[0], low[1], 1.0) * 2.0, at(high[0], high[1], 1.0) * 2.0)
    };
    let pixel = |x: f32, y: f32| within([x + 0.01, y + 0.01], [x + 0.02, y + 0.02]);
    let is_hidden = |depth: &CoverageBuffer, bounds: &Aabb| depth.test_box(bounds).verdict == Verdict::Hidden;
    let (step, more) = (1.0 / 32.0, 2.0e-3);
    let wide = build([-more, step + more], [-more, step + more], 1.0);
    assert!(is_hidden(&wide, &pixel(0.0, 0.0)));
    for (x, y) in [(-step, 0.0), (step, 0.0), (0.0, -step), (0.0, step)] {
        assert!(!is_hidden(&wide, &pixel(x, y)), "{x} {y}");
    }
    // Exactly as large as the pixel on one of its four sides.
    for side in 0..4 {
        let by = |k: usize| if k == side { 0.0 } else { more };
        let exact = build([-by(0), step + by(1)], [-by(2), step + by(3)], 1.0);
        assert!(!is_hidden(&exact, &pixel(0.0, 0.0)), "{side}");
    }
    // A box that ends exactly where the covered pixel does touches its neighbour.
    assert!(is_hidden(&wide, &within([more, more], [step - more, step - more])));
    for bounds in [
        within([0.0, more], [step - more, step - more]),
        within([more, 0.0], [step - more, step - more]),
        within([more, more], [step, step - more]),
        within([more, more], [step - more, step]),
    ] {
        assert!(!is_hidden(&wide, &bounds), "{bounds:?}");
    }
    // As far as the polygon, or behind it by less than depths are known.
    let all = build([-2.0, 2.0], [-2.0, 2.0], 3.0);
    for z in [2.9, 3.0f32.next_down(), 3.0, 3.0f32.next_up(), 3.000_001] {
        assert!(!is_hidden(&all, &point(at(0.1, 0.1, z))), "{z}");
    }
    assert!(is_hidden(&all, &point(at(0.1, 0.1, 3.000_1))));
    // A tilted polygon counts as far as its farthest point in a block of pixels.
    let tilted = [at(-2.0, -2.0, 2.0), at(2.0, -2.0, 2.0), at(4.0, 4.0, 4.0), at(-4.0, 4.0, 4.0)];
    depth.build(&window, &[ShadowVolume::of_polygon(&tilted, &window).expect("an occluder")]);
    for i in -30..30 {
        let y = i as f32 / 32.0;
        // On the polygon: z = 8 / (3 - y).
        let z = 8.0 / (3.0 - y);
        let before = point(at(0.1, y, 1.0) * (z * (1.0 - 1.0e-6)));
        assert!(!is_hidden(&depth, &before), "{y}");
        assert!(is_hidden(&depth, &point(at(0.1, y, 1.0) * (z * 1.15))), "{y}");
    }
}

/// Two layers of a block: what is nearer than one of them, or beside the pixels of the other, is visible.
#[test]
fn the_layers_of_the_buffer_hide_only_their_own_pixels() {
    let window = straight(1.0, 0.01);
    let mut random = Random::new(77);
    let mut hidden = 0;
    for _ in 0..400 {
        let polygons: Vec<Polygon> = (0..2 + random.below(6))
            .map(|_| {
                let (x, y) = (random.range(-1.2, 0.8), random.range(-1.2, 0.8));
                let (w, h) = (random.log_range(0.05, 2.0), random.log_range(0.05, 2.0));
                let z = random.range(1.0, 4.0) as f32;
                rectangle(1.0, [x as f32, (x + w) as f32], [y as f32, (y + h) as f32]).map(|p| p * z).to_vec()
            })
            .collect();
        let mut depth = CoverageBuffer::new(64, 64);
        depth.build(&window, &shadows_of(&window, &polygons));
        for _ in 0..60 {
            let z = random.range(1.0, 5.0) as f32;
            let x = at(random.range(-1.0, 1.0) as f32, random.range(-1.0, 1.0) as f32, 1.0) * z;
            if depth.test_box(&point(x)).verdict == Verdict::Hidden {
                hidden += 1;
                assert!(is_blocked(&window, &polygons, x.as_dvec3()), "{x} {polygons:?}");
            }
        }
    }
    assert!(hidden > 1500, "{hidden}");
}

/// Points that were tested against patches.
#[derive(Debug, Default)]
struct Tally {
    asked: usize,
    hidden: usize,
    outlines: usize,
}

impl Tally {
    /// Tests points against the patches of a band of quads: those that are hidden are blocked by it.
    fn ask(
        &mut self,
        rungs: &[[Vec3; 2]],
        window: &ViewWindow,
        points: usize,
        mut any: impl FnMut() -> Vec3,
    ) {
        let quad = |w: &[[Vec3; 2]]| polygon(&[w[0][0], w[1][0], w[1][1], w[0][1]], 1.0);
        let told = Told::of(&rungs.windows(2).map(quad).collect::<Vec<_>>());
        let shadows = chosen(&told.pool(), &told.scene, window);
        // As the scene draws them: bent quads are halved along a diagonal of its choice.
        let drawn = told.polygons();
        let mut culler = RivalOcclusion::Frusta.culler()(64);
        culler.build(window, &shadows);
        self.outlines += shadows.len();
        self.asked += points;
        for x in (0..points).map(|_| any()) {
            if culler.test_box(&point(x)).verdict == Verdict::Hidden {
                self.hidden += 1;
                assert!(is_blocked(window, &drawn, window.from_eye(x)), "{x}: {rungs:?}");
            }
        }
    }

    fn says_something(&self) {
        assert!(self.hidden * 20 > self.asked && self.outlines > 500, "{self:?}");
    }
}

/// Rows of quads that bend around the eye, fold back over each other, or are seen along their surface: the outline of a
/// patch is taken from a picture, in which not all of it has a place.
#[test]
fn a_patch_around_the_eye_hides_only_what_is_behind_it() {
    let mut tally = Tally::default();
    for n in 0..1500 {
        let mut random = Random::new(0xBE4D + n);
        // A band around the y axis, through a part of the circle, with its middle anywhere from before to behind the eye.
        let (from, turn) = (random.range(0.0, 6.3), random.range(0.3, 4.0));
        let radius = random.range(0.3, 2.0);
        let count = 2 + random.below(10);
        let tilt = random.range(-1.0, 1.0);
        let rungs: Vec<[Vec3; 2]> = (0..=count)
            .map(|i| {
                let angle = from + turn * i as f64 / count as f64;
                let across = DVec3::new(tilt * angle.sin(), 1.0, tilt * angle.cos()) * 0.7;
                let middle = DVec3::new(angle.sin(), 0.0, angle.cos()) * radius;
                [(middle - across).as_vec3(), (middle + across).as_vec3()]
            })
            .collect();
        let eye = random.direction() * random.range(0.0, 2.5) * radius;
        let near_m = random.log_range(1.0e-3, 0.3);
        let tangent = random.range(0.3, 3.0);
        let roll = random.direction();
        let window = window(eye, random.direction(), roll, [tangent, tangent], [0.0, 0.0], near_m);
        tally.ask(&rungs, &window, 40, || {
            let at = |i: usize| window.corners()[i] / window.corners()[i].dot(window.forward());
            let (s, t) = (random.unit(), random.unit());
            let direction = at(0).lerp(at(1), s).lerp(at(3).lerp(at(2), s), t);
            (direction * random.log_range(near_m * 1.1, 6.0) + eye).as_vec3()
        });
    }
    tally.says_something();
}

/// Long walls that the eye all but touches, so that they reach round it to nearly half of all directions; flat, bent at
/// one end towards the eye or away from it, with long and short parts: a picture taken around their middle has no place
/// for their ends.
#[test]
fn a_long_wall_beside_the_eye_hides_only_what_is_behind_it() {
    let mut tally = Tally::default();
    for n in 0..1500 {
        let mut random = Random::new(0x10A6 + n);
        let away_m = random.log_range(0.01, 0.5);
        let bend = if random.chance(0.5) { 0.0 } else { random.range(-0.4, 0.4) };
        let mut x = -random.log_range(0.2, 12.0);
        let mut z = away_m;
        let height = random.log_range(0.1, 2.0);
        let mut rungs = vec![[at(x as f32, -height as f32, z as f32), at(x as f32, height as f32, z as f32)]];
        for _ in 0..2 + random.below(5) {
            let step = random.log_range(0.1, 8.0);
            x += step;
            z = (z + bend * step * random.unit()).max(0.005);
            rungs.push([at(x as f32, -height as f32, z as f32), at(x as f32, height as f32, z as f32)]);
        }
        if random.chance(0.5) {
            rungs.reverse();
        }
        let near_m = 1.0e-3;
        let eye = DVec3::new(random.range(-0.5, 0.5), random.range(-0.2, 0.2), 0.0);
        let wide = random.log_range(1.0, 200.0);
        let window = window(eye, DVec3::Z, DVec3::Y, [wide, 3.0], [0.0, 0.0], near_m);
        tally.ask(&rungs, &window, 60, || {
            let side = if random.chance(0.5) { 1.0 } else { -1.0 };
            let direction = DVec3::new(side * random.log_range(0.01, wide), random.range(-3.0, 3.0), 1.0);
            (direction * random.log_range(0.005, 6.0) + eye).as_vec3()
        });
    }
    tally.says_something();
}

/// After a jump back the scene may have forgotten polygons that are still waiting to be offered.
#[test]
fn orphans_that_the_scene_has_forgotten_are_let_go() {
    let wall = |n: u32| {
        let x = n as f32;
        polygon(&rectangle(-4.0, [x, x + 1.0], [-0.5, 0.5]), 1.0)
    };
    let told = Told::of(&(0..6).map(wall).collect::<Vec<_>>());
    let mut pool = told.pool();
    assert_eq!(pool.len(), 1);
    // Another, shorter scene: all that is told of it is that one polygon has gone.
    let mut shorter = Told::of(&[wall(0)]);
    let first = shorter.scene.visible_ids().next().expect("a polygon");
    shorter.tell(&[SOLE.undo()]);
    pool.follow(&shorter.scene, &[Change::Remove(first)]);
    assert!(pool.is_empty());
}
