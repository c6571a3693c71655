//! Checks the rounding margins at exact borders, against whole numbers or `f64`.

use glam::{DVec2, DVec3, Vec3};

use super::{
    facet::{Facet, Outline},
    fill::{Fill, is_hidden},
    picture::{MARGIN, Picture, STEPS},
    slope::{ROWS, SIDE, Slope},
    table::NONE,
    tests::{Polygons, Random, built, window},
    tiles::{Part, Tiles},
};
use crate::{
    index::{
        Backend,
        simd::{Kernel, WithKernel},
    },
    math::{Aabb, Sphere},
    occlusion::{OcclusionCuller, Verdict, raster::Raster},
    polygon::ConvexPolygon,
    view::ViewWindow,
};

/// Tiles and pixels of the test's picture, each way.
const TILES: usize = 3;
const PIXELS: usize = TILES * SIDE;

impl Random {
    fn below(&mut self, end: usize) -> i32 {
        ((self.next() * end as f32) as usize).min(end - 1) as i32
    }

    /// A coordinate in steps, mostly within a step of a pixel's border.
    fn step(&mut self) -> i32 {
        let off = if self.below(4) == 0 { self.below(64) } else { self.below(3) - 1 };
        64 * (self.below(PIXELS + 16) - 8) + off
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.next())
    }
}

/// A facet without neighbours; `None` unless its corners are counterclockwise.
fn facet(corners: &[[i32; 2]], nearness: f64) -> Option<Facet> {
    let mut outline = Outline::default();
    corners.iter().for_each(|&at| outline.push(at, nearness, NONE));
    let mut facet = Facet::NONE;
    facet.set_outline(&outline);
    (facet.len > 0 && !facet.is_turned).then_some(facet)
}

/// Whether a convex outline, or an edge, comes within 3/4 step of a pixel. That is less than half a step and the error of
/// the projection.
fn reaches(corners: &[[i32; 2]], pixel: [usize; 2]) -> bool {
    let corners: Vec<[i64; 2]> = corners.iter().map(|at| at.map(|v| 4 * i64::from(v))).collect();
    let [x, y] = pixel.map(|v| [256 * v as i64 - 3, 256 * v as i64 + 259]);
    let square = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    let sides = (0..corners.len()).map(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        [a[1] - b[1], b[0] - a[0]]
    });
    sides.filter(|side| *side != [0, 0]).chain([[1, 0], [0, 1]]).all(|[a, b]| {
        let along = |points: &[[i64; 2]]| {
            let values = points.iter().map(|p| a * p[0] + b * p[1]);
            [values.clone().min(), values.max()]
        };
        let ([low, high], [least, most]) = (along(&corners), along(&square));
        low < most && least < high
    })
}

/// A needle that points at a sample. Both long sides, when extended, miss the sample by half a square step.
fn needle(random: &mut Random) -> Option<Vec<[i32; 2]>> {
    let sample = [0; 2].map(|_| 64 * random.below(PIXELS) + 32);
    // Twice the way from the tip to the sample.
    let [m, n] = [0; 2].map(|_| 2 * (150 + random.below(600)) + 1);
    let x = (0..m).find(|x| (x * n - 1) % m == 0)?;
    let (y, far) = ((x * n - 1) / m, 40 + random.below(80));
    let tip = [sample[0] - m / 2, sample[1] - n / 2];
    let ends = [[far * m + x, far * n + y], [(far + 1) * m - x, (far + 1) * n - y]];
    let [a, b] = ends.map(|[x, y]| [tip[0] - x, tip[1] - y]);
    let [left, right] = [vec![tip, a, b], vec![tip, b, a]];
    Some(if facet(&left, 1.0).is_some() { left } else { right })
}

#[test]
fn a_pixel_is_covered_only_where_no_rounding_of_corners_and_edges_can_uncover_it() {
    let mut random = Random(5);
    let (mut tiles, mut covered, mut scenes) = (Tiles::new(TILES, TILES), 0, 0);
    while scenes < 20_000 {
        let [a, b, c, d] = [0; 4].map(|_| [0; 2].map(|_| random.step()));
        let outlines = match scenes % 4 {
            0 => needle(&mut random).into_iter().collect(),
            1 => vec![vec![a, b, c]],
            _ => vec![vec![a, b, c], vec![b, a, d]],
        };
        let depths = if random.below(2) == 0 { [0.5, 0.25] } else { [0.25, 0.5] };
        let facets = outlines.iter().zip(depths).map(|(outline, depth)| facet(outline, depth));
        let Some(mut facets) = facets.collect::<Option<Vec<Facet>>>().filter(|all| !all.is_empty()) else {
            scenes += usize::from(scenes % 4 == 0);
            continue;
        };
        scenes += 1;
        if let [first, second] = &mut facets[..] {
            (first.mates[0], second.mates[0]) = (1, 0);
        }
        tiles.clear();
        Backend::detect().run(Fill { facets: &facets, tiles: &mut tiles });
        for pixel in (0..PIXELS * PIXELS).map(|i| [i % PIXELS, i / PIXELS]) {
            let Some(near) = [0.4, 0.2].into_iter().find(|&near| tiles.hides_pixel(pixel, near)) else {
                continue;
            };
            covered += 1;
            let mut is_reached = false;
            for (outline, facet) in outlines.iter().zip(&facets) {
                let is_near = reaches(outline, pixel);
                is_reached |= is_near;
                assert!(!is_near || facet.end > f64::from(near), "{pixel:?} is too near: {outlines:?}");
                for side in 0..outline.len() {
                    let edge = [outline[side], outline[(side + 1) % outline.len()]];
                    let is_open = facet.mates[side] == NONE;
                    assert!(!(is_open && reaches(&edge, pixel)), "{pixel:?} at a border: {outlines:?}");
                }
            }
            assert!(is_reached, "{pixel:?} beside {outlines:?}");
        }
    }
    assert!(covered > 100_000, "{covered}");
}

/// Tests a facet against a picture that covers all pixels but one.
struct AllBut<'a> {
    tiles: &'a mut Tiles,
    facet: &'a Facet,
    pixel: [usize; 2],
}

impl WithKernel for AllBut<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> bool {
        let Self { tiles, facet, pixel: [x, y] } = self;
        tiles.clear();
        for at in 0..TILES * TILES {
            let tile = [at % TILES, at / TILES];
            let is_here = tile == [x / SIDE, y / SIDE];
            let covered = if is_here { !(1 << (y % SIDE * SIDE + x % SIDE)) } else { u64::MAX };
            tiles.begin_facet(tile.map(|v| [v, v + 1]));
            tiles.push(
                tile,
                at as u32,
                Part { covered, open: 0, touched: u64::MAX, depth: Slope::level(1.0) },
            );
        }
        tiles.join(kernel, TILES * TILES);
        is_hidden(kernel, facet, tiles)
    }
}

#[test]
fn a_polygon_is_visible_in_each_pixel_that_it_may_touch_before_its_corners_are_rounded() {
    let mut random = Random(6);
    let (mut tiles, mut tested) = (Tiles::new(TILES, TILES), 0);
    while tested < 30_000 {
        let corners = [0; 3].map(|_| [0; 2].map(|_| random.step()));
        let Some(facet) = facet(&corners, 0.5) else { continue };
        for _ in 0..40 {
            let pixel = [0; 2].map(|_| random.below(PIXELS) as usize);
            if reaches(&corners, pixel) {
                tested += 1;
                let is_hidden = Backend::detect().run(AllBut { tiles: &mut tiles, facet: &facet, pixel });
                assert!(!is_hidden, "{pixel:?} {corners:?}");
            }
        }
    }
}

#[test]
fn a_bound_of_depths_holds_after_it_is_rounded() {
    let mut random = Random(7);
    for _ in 0..20_000 {
        let nearness = random.between(0.01, 1.0);
        let corners = [[0, 0], [640, 0], [0, 640]];
        let level = facet(&corners, nearness).expect("an outline").depths([8.0; 2]).farthest_in(0.0, 0.0);
        assert!(f64::from(level.end) <= nearness && f64::from(level.from) <= nearness);
        // A plane whose terms cancel far from the first pixel.
        let [x, y] = [0; 2].map(|_| f64::from(8 * random.below(1024)));
        let [by_x, by_y] = [0; 2].map(|_| random.between(-0.1, 0.1));
        let base = nearness - by_x * x - by_y * y;
        let plane = Facet { plane: [base, by_x, by_y], has_plane: true, ..Facet::NONE };
        let far = plane.depths([x, y]).farthest_in(x, y);
        let near = Facet { end: f64::INFINITY, ..plane }.nearest_in(x, y);
        let far = Slope { end: f32::NEG_INFINITY, ..far };
        for i in 0..SIDE * SIDE {
            let ends = |by: f64, v: usize| [by * v as f64, by * (v + 1) as f64];
            let ([a, b], [c, d]) = (ends(by_x, i % SIDE), ends(by_y, i / SIDE));
            let (least, most) = (nearness + a.min(b) + c.min(d), nearness + a.max(b) + c.max(d));
            let (group, k) = (i / ROWS, i % ROWS);
            assert!(f64::from(far.least_in_pixels(group)[k]) <= least, "{plane:?} {i}");
            assert!(f64::from(near.most_in_pixels(group)[k]) >= most, "{plane:?} {i}");
        }
    }
}

#[test]
fn a_common_bound_is_below_both_bounds() {
    let mut random = Random(8);
    let mut sloped = 0;
    for _ in 0..20_000 {
        // The differences have one sign, and half of the first bound is left.
        let [from, across] = [random.between(1.0, 2.0), random.between(0.0, 0.1)].map(|v| v as f32);
        let other = Slope { from: 0.3 + 0.15 * random.next(), across: [0.0; 2], end: 0.0 };
        let common = Slope { from, across: [across; 2], end: 0.0 }.farther_of(&other);
        sloped += usize::from(common.across != [0.0; 2]);
        let most = f64::from(common.from) + 2.0 * f64::from(common.across[0]);
        assert!(most <= f64::from(other.from), "{common:?} {other:?}");
    }
    assert!(sloped > 10_000, "{sloped}");
}

/// A square across the direction of view.
fn square(x: f32, half: f32, z: f32) -> ConvexPolygon {
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    ConvexPolygon::quad(corners.map(|[dx, y]| Vec3::new(x + dx, y, z)))
}

#[test]
fn corners_are_projected_as_exactly_as_their_margin_says_and_only_beyond_the_near_plane() {
    let window = window(Vec3::ZERO);
    let buffer = built(&Polygons(vec![square(3.0, 2.0, -50.0)]), &window);
    let (raster, picture, _) = buffer.parts().expect("a picture");
    assert_eq!(picture.project(DVec3::Z * window.near_m()).1, 0.0);
    for picture in [*picture, Picture::new(&window, &Raster::new(&window, 32.0, 18.0), 1.0)] {
        let (pixels, most) = (picture.raster.pixels_a_unit().max_element(), picture.most_tangent);
        let error = 96.0 * (1.0 + most).powi(2) * 0.5 * f64::EPSILON * pixels;
        assert!(error + 0.5 / STEPS < MARGIN && most * pixels * STEPS < f64::from(1 << 30));
    }
    let mut random = Random(10);
    for _ in 0..1000 {
        let eye = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(1.0, 1.1));
        let seen @ (at, nearness) = picture.project(eye);
        let off =
            raster.flat_in_pixels(eye.x / eye.z, eye.y / eye.z) * STEPS - DVec2::from(at.map(f64::from));
        assert!(off.abs().max_element() < 0.5 + 1.0e-6, "{eye}");
        let corners = [seen, ([at[0] + 64, at[1]], nearness), ([at[0], at[1] + 64], nearness)];
        let tested = Facet::of_tested(&[eye; 3], &corners, picture).expect("an outline");
        assert!(f64::from(tested.nearest_in(0.0, 0.0).end) >= nearness, "{eye}");
    }
    // The picture shows a part of the window.
    let middle = [6400; 2];
    assert!(picture.shows_corners([middle; 2]));
    for border in [[[0; 2], middle], [middle, [0; 2]], [[320 * 64; 2], middle], [middle, [184 * 64; 2]]] {
        assert!(!picture.shows_corners(border), "{border:?} may lie outside");
    }
}

#[test]
fn a_wide_box_is_visible_past_the_border_of_a_wall_by_less_than_its_rounding() {
    let mut random = Random(9);
    let mut hidden = 0;
    for _ in 0..40 {
        // The border lies a little past the border of a pixel, so the pixel before it is covered.
        let raster = Raster::new(&window(Vec3::ZERO), 320.0, 184.0);
        let pixel = f64::from(165 + random.below(100)) + 0.015;
        let x = (raster.tangents()[0].x + pixel / raster.pixels_a_unit().x) as f32;
        let [a, b] = [-3.0, 3.0].map(|y| Vec3::new(x, y, -1.0));
        let wall = ConvexPolygon::quad([a - Vec3::X * 9.0, a, b, b - Vec3::X * 9.0]);
        // The square at the other border keeps the picture as wide as the window.
        let buffer = built(&Polygons(vec![wall, square(1.1, 0.05, -1.0)]), &window(Vec3::ZERO));
        for past in (0..100).map(|i| 2.0e-6 * f64::from(i - 50)) {
            let right = ((f64::from(x) + past) * 1.5) as f32;
            let left = -12_000.0 * random.next();
            let bounds = Aabb::new(Vec3::new(left, -0.1, -1.6), Vec3::new(right, 0.1, -1.5));
            let is_behind = f64::from(right) / 1.5 <= f64::from(x);
            assert!(is_behind || buffer.test_box(&bounds).verdict != Verdict::Hidden, "{bounds:?} {x}");
            let narrow = Aabb::cube(Vec3::new(right - 0.2, 0.0, -1.6), 0.1);
            hidden += usize::from(buffer.test_box(&narrow).verdict == Verdict::Hidden);
        }
    }
    assert_eq!(hidden, 4000);
}

#[test]
fn a_sphere_is_visible_whose_cube_is_rounded_into_a_wall() {
    // The difference of neighbouring numbers in `f32`. The wall recedes by it from its left to its right border.
    let (z, ulp) = (10_000.0, 2.0_f32.powi(-10));
    let [a, b] = [[-13.0, z], [7.0, z - ulp]].map(|[x, z]| [-10.0, 10.0].map(|y| Vec3::new(x, y, z)));
    let wall = ConvexPolygon::quad([a[0], b[0], b[1], a[1]]);
    let buffer = built(&Polygons(vec![wall]), &window(Vec3::new(0.0, 0.0, z + 5.0)));
    // In front of the sphere, the wall is at `z - 0.65 ulp`; the sphere begins at `z - 0.625 ulp`.
    for (middle, radius_m) in [(z - 2.0 * ulp, 1.375 * ulp), (1001.0 - 0.625 * ulp, 8999.0)] {
        let test = |z: f32| buffer.test_sphere(&Sphere { center: Vec3::Z * z, radius_m }).verdict;
        assert_ne!(test(middle), Verdict::Hidden, "{middle}");
        assert_eq!(test(middle - 4.0 * ulp), Verdict::Hidden, "{middle}");
    }
}

/// A square window from the origin along -z, with tangents up to 1.
fn square_window(near_m: f64) -> ViewWindow {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, -1.0));
    ViewWindow::new(DVec3::ZERO, DVec3::NEG_Z, corners, near_m).expect("a window")
}

#[test]
fn a_long_box_is_not_hidden_whose_nearest_distance_is_rounded_past_a_wall() {
    let buffer = built(&Polygons(vec![square(0.0, 1.0e-11, -1.4e-12)]), &square_window(0.0));
    let is_hidden = |half: f32, far: f32, near: f32| {
        let bounds = Aabb::new(Vec3::new(-half, -half, -far), Vec3::new(half, half, -near));
        buffer.test_box(&bounds).verdict == Verdict::Hidden
    };
    assert!(is_hidden(1.0e-12, 3.0e-12, 2.0e-12));
    // Half of the length and the middle are rounded to multiples of 0.9e-12, and their difference to 1.8e-12.
    assert!(!is_hidden(1.0, 1.0e4, 1.0e-12));
}

#[test]
fn a_triangle_is_cut_at_the_near_plane_only_if_rounding_moves_its_sides_by_less_than_their_margin() {
    let window = square_window(1.0);
    let mut random = Random(11);
    let mut covered = 0;
    for scene in 0..100 {
        // The sides from the far corners meet the near plane in or next to the window.
        let far = if scene % 2 == 0 { 1.0 } else { 2.0_f64.powi(36) };
        let mut place = |across: i32, from: i32, to: i32| {
            let mut within = |low: i32, high: i32| f64::from(low + random.below((high - low + 1) as usize));
            DVec3::new(within(-across, across), within(-across, across), within(from, to))
        };
        let corners = [place(1000, -1000, -500) * far, place(1000, -1000, -500) * far, place(4, 1, 3)];
        let [a, b, c] = corners.map(|corner| corner.as_vec3());
        let buffer = built(&Polygons(vec![ConvexPolygon::triangle(a, b, c)]), &window);
        let (raster, _, tiles) = buffer.parts().expect("a picture");
        let [right, up, forward] = raster.axes();
        for pixel in (0..320 * 184).map(|i| [i % 320, i / 320]) {
            if !tiles.hides_pixel(pixel, 1.0e-30) {
                continue;
            }
            covered += 1;
            for i in 0..12 {
                let at = DVec2::new((pixel[0] + i % 2) as f64, (pixel[1] + i / 2 % 2) as f64);
                let tangents = raster.tangents()[0] + at / raster.pixels_a_unit();
                let direction = forward + right * tangents.x + up * tangents.y;
                let [a, b, c] = [0, 1, 2].map(|k| corners[(i / 4 + k) % 3]);
                let plane = a.cross(b);
                assert!(plane.dot(direction) * plane.dot(c) >= 0.0, "{pixel:?} {corners:?}");
            }
        }
    }
    assert!(covered > 10_000, "{covered}");
}
