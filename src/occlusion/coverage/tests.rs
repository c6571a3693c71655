//! Checks that the short cuts of the picture give the results of the full tests, on every kernel.

use glam::{DVec3, Quat, Vec3};

use super::{
    buffer::CoverageBuffer,
    facet::Facet,
    fill::is_hidden,
    slope::Slope,
    surfaces::Surfaces,
    tiles::{Part, Tiles},
};
use crate::{
    index::{
        Backend,
        simd::{Kernel, WithKernel},
    },
    math::Aabb,
    occlusion::{Cell, Needed, OcclusionCuller, Verdict, raster::Raster},
    polygon::{BLOCK, ConvexPolygon, Geometry, PolygonId},
    view::{Projection, View, ViewWindow},
};

/// Pseudo-random numbers from 0 to 1 (Knuth).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn within(&mut self, size: f32) -> f32 {
        (self.next() * 2.0 - 1.0) * size
    }

    /// Before the eye, in or next to the window.
    fn place(&mut self, away: f32) -> Vec3 {
        Vec3::new(self.within(1.1 * away), self.within(0.7 * away), -away)
    }

    fn near(&mut self, p: Vec3, size: f32) -> Vec3 {
        p + Vec3::new(self.within(size), self.within(size), self.within(size))
    }
}

pub(super) struct Polygons(pub(super) Vec<ConvexPolygon>);

impl Geometry for Polygons {
    fn id_end(&self) -> usize {
        self.0.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.0.len()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.0[id.index()].bounds()
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        self.0.get(id.index()).copied()
    }

    fn may_occlude(&self, _: PolygonId) -> bool {
        true
    }
}

/// A bumpy wall of triangles, with holes, and triangles by themselves.
fn occluders(random: &mut Random) -> Polygons {
    const CELLS: usize = 12;
    let mut corners = Vec::new();
    for i in 0..(CELLS + 1) * (CELLS + 1) {
        let (x, y) = ((i % (CELLS + 1)) as f32, (i / (CELLS + 1)) as f32);
        corners.push(Vec3::new(x - 6.0 + random.within(0.2), (y - 6.0) * 0.6, -5.0 + random.within(0.3)));
    }
    let mut all = Vec::new();
    for cell in 0..CELLS * CELLS {
        let at = cell / CELLS * (CELLS + 1) + cell % CELLS;
        let [a, b, c, d] = [at, at + 1, at + CELLS + 2, at + CELLS + 1].map(|i| corners[i]);
        if random.next() < 0.9 {
            all.extend([ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(a, c, d)]);
        }
    }
    for _ in 0..60 {
        let away = 1.0 + 8.0 * random.next();
        let p = random.place(away);
        let [a, b, c] = [0; 3].map(|_| random.near(p, 0.2 * away));
        all.push(ConvexPolygon::triangle(a, b, c));
    }
    Polygons(all)
}

pub(super) fn window(eye_in_world: Vec3) -> ViewWindow {
    let projection = Projection::symmetric(60.0, 16.0 / 9.0, 0.01, 100.0);
    let view = View { eye_in_world, world_from_view: Quat::IDENTITY, projection };
    view.window().expect("a pointed cone")
}

pub(super) fn built(polygons: &Polygons, window: &ViewWindow) -> CoverageBuffer {
    let mut surfaces = Surfaces::default();
    let ids = || (0..polygons.0.len() as u32).map(PolygonId);
    ids().for_each(|id| _ = surfaces.set(polygons, id));
    let mut buffer = CoverageBuffer::new(320, 184);
    buffer.build_of(window, &surfaces, ids());
    buffer
}

/// Whether a picture shows only a part of the window.
fn is_zoomed(buffer: &CoverageBuffer, window: &ViewWindow) -> bool {
    let (raster, ..) = buffer.parts().expect("a picture");
    raster.tangents() != Raster::new(window, 320.0, 184.0).tangents()
}

/// Whether a polygon is hidden, by the whole test.
fn is_hidden_by_all_pixels(buffer: &CoverageBuffer, polygon: &ConvexPolygon) -> bool {
    let (raster, picture, tiles) = buffer.parts().expect("a picture");
    let in_axes = |p: &Vec3| raster.in_axes(p.as_dvec3() - raster.eye_in_world);
    let eyes: Vec<DVec3> = polygon.vertices().iter().map(in_axes).collect();
    let seen: Vec<_> = eyes.iter().map(|eye| picture.project(*eye)).collect();
    let steps = |axis: usize| seen.iter().map(move |(at, _)| at[axis]);
    let ends = [0, 1].map(|axis| [steps(axis).min().unwrap_or(0), steps(axis).max().unwrap_or(0)]);
    seen.iter().all(|(_, nearness)| *nearness > 0.0)
        && picture.shows_corners(ends)
        && Backend::detect().run(AllPixels {
            facet: Facet::of_tested(&eyes, &seen, picture),
            ends,
            near: (seen.iter().fold(0.0_f64, |near, seen| near.max(seen.1)) * (1.0 + 1.0e-6)) as f32,
            tiles,
        })
}

struct AllPixels<'a> {
    facet: Option<Facet>,
    ends: [[i32; 2]; 2],
    near: f32,
    tiles: &'a Tiles,
}

impl WithKernel for AllPixels<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> bool {
        match &self.facet {
            Some(facet) => is_hidden(kernel, facet, self.tiles),
            // Without an outline, only the nearest depth of all pixels between the corners counts.
            None => self.tiles.hides_between(kernel, self.ends, self.near),
        }
    }
}

#[test]
fn a_short_cut_gives_the_answer_of_the_whole_test() {
    let mut random = Random(1);
    let (mut hidden, mut visible, mut hidden_boxes) = (0, 0, 0);
    for round in 0..6 {
        let polygons = occluders(&mut random);
        // From far away, the picture shows only a part of the window.
        let window = window(if round < 4 { Vec3::ZERO } else { Vec3::new(3.0, 1.0, 30.0) });
        let mut surfaces = Surfaces::default();
        let ids = || (0..polygons.0.len() as u32).map(PolygonId);
        ids().for_each(|id| _ = surfaces.set(&polygons, id));
        let mut tested = polygons.0.clone();
        for i in 0..1600 {
            let (away, size) = (2.0 + 8.0 * random.next(), [0.02, 0.1, 0.5, 2.0][i % 4]);
            let p = random.place(away);
            let [a, b, c] = [0; 3].map(|_| random.near(p, size));
            tested.push(ConvexPolygon::triangle(a, b, c));
        }
        let mut answers = Vec::new();
        for &backend in Backend::ALL.iter().filter(|backend| backend.is_available()) {
            let mut buffer = CoverageBuffer::new(320, 184);
            buffer.set_backend(backend);
            buffer.build_of(&window, &surfaces, ids());
            assert_eq!(is_zoomed(&buffer, &window), round >= 4);
            let mut found = Vec::new();
            for polygon in &tested {
                let is_hidden = buffer.hides_polygon(polygon);
                assert_eq!(is_hidden, is_hidden_by_all_pixels(&buffer, polygon), "{polygon:?}");
                found.push(is_hidden);
            }
            for (block, some) in tested[..polygons.0.len()].chunks_exact(BLOCK).enumerate() {
                let by_block =
                    buffer.hidden_of_block(&surfaces, &polygons, block, [u16::MAX, random.0 as u16]);
                for (i, polygon) in some.iter().enumerate() {
                    assert_eq!(by_block >> i & 1 == 1, buffer.hides_polygon(polygon), "{polygon:?}");
                }
            }
            for some in tested.chunks(16) {
                let boxes: Vec<Aabb> = some.iter().map(ConvexPolygon::bounds).collect();
                let [quick, whole] = [Needed::Hidden, Needed::Verdict]
                    .map(|needed| buffer.test_boxes(&boxes, Cell::ALL, needed).hidden);
                assert_eq!(quick, whole, "{boxes:?}");
                for (lane, bounds) in boxes.iter().enumerate() {
                    let is_hidden = buffer.test_box(bounds).verdict == Verdict::Hidden;
                    assert_eq!(is_hidden, whole >> lane & 1 == 1, "{bounds:?}");
                    found.push(is_hidden);
                }
            }
            answers.push(found);
        }
        assert!(answers.iter().all(|found| *found == answers[0]), "kernels differ");
        let (by_polygon, by_box) = answers[0].split_at(tested.len());
        hidden += by_polygon.iter().filter(|is_hidden| **is_hidden).count();
        visible += by_polygon.iter().filter(|is_hidden| !**is_hidden).count();
        hidden_boxes += by_box.iter().filter(|is_hidden| **is_hidden).count();
    }
    assert!(hidden > 500 && visible > 500 && hidden_boxes > 300, "{hidden}, {visible}, {hidden_boxes}");
}

/// A tile with a facet in each half, at two depths. Each facet touches one row of the other half. The facets may be
/// neighbours. The first has the border `open`.
struct OneTile {
    are_neighbours: bool,
    depths: [f32; 2],
    open: u64,
}

impl WithKernel for &OneTile {
    type Output = (Tiles, [bool; 2]);

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        let mut tiles = Tiles::new(1, 1);
        let halves = [(u64::MAX >> 32, u64::MAX >> 24), (!(u64::MAX >> 32), !(u64::MAX >> 40))];
        for (number, ((covered, touched), depth)) in halves.into_iter().zip(self.depths).enumerate() {
            assert!(tiles.begin_facet([[0, 1], [0, 1]]));
            let open = if number == 0 { self.open } else { 0 };
            tiles.push([0, 0], number as u32, Part { covered, open, touched, depth: Slope::level(depth) });
            if number == 1 && self.are_neighbours {
                tiles.unite([0, 0], 0);
            }
        }
        tiles.join(kernel, 2);
        let useful = [0, 1].map(|facet| tiles.is_useful(facet));
        (tiles, useful)
    }
}

#[test]
fn neighbours_cover_the_pixels_that_both_touch_from_the_farther_depth_on_and_strangers_each_from_their_own() {
    let is_hidden_at = |tiles: &Tiles, pixel: [usize; 2], near: f32| tiles.hides_pixel(pixel, near);
    for &backend in Backend::ALL.iter().filter(|backend| backend.is_available()) {
        let run = |are_neighbours, depths, open| backend.run(&OneTile { are_neighbours, depths, open });
        let (tiles, useful) = run(true, [0.5, 0.25], 0);
        assert_eq!(useful, [true; 2]);
        assert!(tiles.hides_all(0, &Slope::level(0.25)) && !is_hidden_at(&tiles, [0, 4], 0.3));
        assert!(is_hidden_at(&tiles, [0, 2], 0.5) && !is_hidden_at(&tiles, [0, 3], 0.3));
        let (tiles, _) = run(true, [0.25, 0.5], 0);
        assert!(tiles.hides_all(0, &Slope::level(0.25)) && !is_hidden_at(&tiles, [0, 3], 0.3));
        assert!(is_hidden_at(&tiles, [0, 5], 0.5) && !is_hidden_at(&tiles, [0, 4], 0.3));
        let (tiles, useful) = run(false, [0.5, 0.25], 0);
        assert_eq!(useful, [true; 2]);
        assert!(is_hidden_at(&tiles, [0, 0], 0.4) && !is_hidden_at(&tiles, [0, 7], 0.4));
        assert!(is_hidden_at(&tiles, [0, 7], 0.25) && tiles.hides_all(0, &Slope::level(0.25)));
        // A border of one facet takes the pixel from the whole surface, but not from others.
        let border = 1 << 40;
        let [mut joined, mut parted] = [true, false].map(|are| run(are, [0.5, 0.25], border).0);
        assert!(!is_hidden_at(&joined, [0, 5], 0.2) && is_hidden_at(&parted, [0, 5], 0.2));
        for tiles in [&mut joined, &mut parted] {
            tiles.clear();
            assert!(!is_hidden_at(tiles, [0, 0], 0.1) && !tiles.hides_all(0, &Slope::level(0.1)));
        }
    }
}

/// A near facet in the lower half of a tile, and behind it a surface of two facets in the whole tile.
struct HalfHidden;

impl WithKernel for HalfHidden {
    type Output = [bool; 3];

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        let (mut tiles, half) = (Tiles::new(1, 1), u64::MAX >> 32);
        for (number, (pixels, depth)) in
            [(half, 0.5), (half >> 8, 0.25), (!(half >> 8), 0.25)].into_iter().enumerate()
        {
            assert!(tiles.begin_facet([[0, 1], [0, 1]]));
            let depth = Slope { end: depth * 0.5, ..Slope::level(depth * (1.0 + 0.1 * number as f32)) };
            tiles.push([0, 0], number as u32, Part { covered: pixels, open: 0, touched: pixels, depth });
            if number == 2 {
                tiles.unite([0, 0], 1);
            }
        }
        tiles.join(kernel, 3);
        [0, 1, 2].map(|facet| tiles.is_useful(facet))
    }
}

#[test]
fn a_facet_is_useless_if_its_surface_hides_only_other_pixels() {
    for &backend in Backend::ALL.iter().filter(|backend| backend.is_available()) {
        assert_eq!(backend.run(HalfHidden), [true, false, true], "{}", backend.name());
    }
}

#[test]
fn large_neighbours_leave_no_gap_at_the_edge_that_they_share() {
    // The quad is bent along the diagonal, so that it stays two facets of hundreds of tiles each.
    let [a, c] = [Vec3::new(-6.0, -4.0, -5.0), Vec3::new(6.0, 4.0, -5.0)];
    let [b, d] = [Vec3::new(6.0, -4.0, -6.0), Vec3::new(-6.0, 4.0, -6.0)];
    let polygons = Polygons(vec![ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(a, c, d)]);
    let buffer = built(&polygons, &window(Vec3::ZERO));
    assert_eq!(buffer.facets(), 2);
    for step in -20..=20 {
        let middle = Vec3::new(0.2 * step as f32, 0.2 * step as f32 * 2.0 / 3.0, -8.0);
        let tested = buffer.test_box(&Aabb::cube(middle, 0.3));
        assert_eq!(tested.verdict, Verdict::Hidden, "{middle}");
    }
}

#[test]
fn a_pixel_at_a_fold_is_no_nearer_than_the_receding_side() {
    let side = |x: f32, z: f32| {
        let [low, high] = [-4.0, 4.0].map(|y| Vec3::new(x, y, z));
        [low, high]
    };
    let ([a, b], [c, d], [e, f]) = (side(-4.0, -5.0), side(0.0, -5.0), side(4.0, -45.0));
    let polygons = Polygons(vec![ConvexPolygon::quad([a, c, d, b]), ConvexPolygon::quad([c, e, f, d])]);
    let mut hidden = 0;
    for step in 0..64 {
        // The fold lies at another place in its pixel each time.
        let eye = Vec3::new(0.002 * step as f32, 0.0, 0.0);
        let buffer = built(&polygons, &window(eye));
        assert_eq!(buffer.facets(), 2);
        for x in [0.001, 0.003, 0.006, 0.012] {
            // The receding side lies at -5 - 10 x.
            let at = |past: f32| {
                let p = |dx: f32, y: f32| Vec3::new(x + dx, y, -5.0 - 10.0 * x - past);
                ConvexPolygon::triangle(p(0.0, 0.0), p(0.0005, 0.0), p(0.0, 0.001))
            };
            assert!(!buffer.hides_polygon(&at(-0.003)), "{x} in front of the side, from {eye}");
            hidden += usize::from(buffer.hides_polygon(&at(1.0)));
        }
    }
    assert!(hidden > 150, "{hidden}");
}

/// A flat grid of quads, or of two triangles each.
fn wall(corner: Vec3, cell: Vec3, columns: usize, rows: usize, as_triangles: bool) -> Polygons {
    let mut all = Vec::new();
    for i in 0..columns * rows {
        let at = |x: usize, y: usize| {
            let (x, y) = ((i % columns + x) as f32, (i / columns + y) as f32);
            corner + cell * Vec3::new(x, y, 0.0)
        };
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
        if as_triangles {
            all.extend([ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(a, c, d)]);
        } else {
            all.push(ConvexPolygon::quad([a, b, c, d]));
        }
    }
    Polygons(all)
}

#[test]
fn a_picture_of_a_far_wall_shows_only_its_part_of_the_window_and_hides_nothing_beside_it() {
    let mut random = Random(3);
    let (low, high) = (Vec3::new(-2.0, -1.0, -60.0), Vec3::new(4.0, 2.5, -60.0));
    let window = window(Vec3::ZERO);
    let buffer = built(&wall(low, Vec3::new(0.5, 0.35, 0.0), 12, 10, true), &window);
    assert!(is_zoomed(&buffer, &window));
    let (mut found, mut hidden, mut seen_beside) = (0, 0, 0);
    for _ in 0..20_000 {
        let middle = Vec3::new(random.within(8.0), random.within(6.0), -61.0 - 30.0 * random.next());
        let bounds = Aabb::cube(middle, 0.01 + 0.4 * random.next());
        // The shadow of a rectangle is convex, so the corners of a box decide.
        let is_behind = (0..8).all(|i| {
            let far = |axis: usize| if i >> axis & 1 == 1 { bounds.max[axis] } else { bounds.min[axis] };
            let scale = low.z / far(2);
            let at = [far(0) * scale, far(1) * scale];
            (0..2).all(|axis| at[axis] >= low[axis] && at[axis] <= high[axis])
        });
        let is_hidden = buffer.test_box(&bounds).verdict == Verdict::Hidden;
        assert!(is_behind || !is_hidden, "{bounds:?}");
        hidden += usize::from(is_behind);
        found += usize::from(is_hidden);
        seen_beside += usize::from(!is_behind && middle.x < low.x * middle.z / low.z);
    }
    assert!(hidden > 2000 && seen_beside > 2000, "{hidden}, {seen_beside}");
    // A picture of the whole window would show the wall 20 pixels wide.
    assert!(found * 100 > hidden * 97, "{found} of {hidden}");
}

#[test]
fn two_triangles_are_filled_as_the_quad_that_they_make() {
    let mut random = Random(4);
    for round in 0..20 {
        let window = window(Vec3::new(random.within(1.0), random.within(1.0), 3.0 * random.next()));
        let corner = Vec3::new(-4.0 + random.within(0.5), -3.0 + random.within(0.5), -6.0);
        let cell = Vec3::new(0.3 + 0.5 * random.next(), 0.3 + 0.5 * random.next(), 0.0);
        let [by_quads, by_triangles] =
            [false, true].map(|as_triangles| built(&wall(corner, cell, 9, 8, as_triangles), &window));
        let (_, _, quads) = by_quads.parts().expect("a picture");
        let (_, _, triangles) = by_triangles.parts().expect("a picture");
        assert_eq!(triangles.entries(), quads.entries(), "round {round}");
        assert_eq!(by_triangles.facets(), by_quads.facets(), "round {round}");
        for _ in 0..500 {
            let (away, side) = (7.0 + random.next(), 0.5 * random.next());
            let bounds = Aabb::cube(random.place(away), side);
            let [a, b] = [&by_quads, &by_triangles].map(|buffer| buffer.test_box(&bounds).verdict);
            assert_eq!(a == Verdict::Hidden, b == Verdict::Hidden, "{bounds:?}");
        }
    }
}

#[test]
fn two_triangles_stay_two_if_they_make_no_convex_quad_or_lie_far_apart() {
    let [a, b, c] = [[-1.0, -1.0], [1.0, -1.0], [0.0, 0.0]].map(|[x, y]| Vec3::new(x, y, -5.0));
    let facets = |apex: Vec3| {
        let polygons = [ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(c, b, apex)];
        built(&Polygons(polygons.to_vec()), &window(Vec3::ZERO)).facets()
    };
    assert_eq!(facets(Vec3::new(1.0, 1.0, -5.0)), 1, "in one plane");
    assert_eq!(facets(Vec3::new(0.0, 1.0, -5.0)), 2, "a dart");
    assert_eq!(facets(Vec3::new(1.0, 1.0, -5.0) * 1.5), 2, "bent away from the eye");
}

/// The second polygon is solid only in its middle half.
struct Rimmed(Polygons);

impl Geometry for Rimmed {
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

    fn may_occlude(&self, _: PolygonId) -> bool {
        true
    }

    fn occluder(&self, id: PolygonId) -> Option<ConvexPolygon> {
        let polygon = self.polygon(id)?;
        let middle = polygon.bounds().center();
        let [a, b, c] = [0, 1, 2].map(|i| middle + 0.5 * (polygon.vertices()[i] - middle));
        Some(if id.0 == 1 { ConvexPolygon::triangle(a, b, c) } else { polygon })
    }
}

#[test]
fn a_block_is_tested_by_the_drawn_and_current_polygons_not_by_stored_parts_of_them() {
    let square = |half: f32, z: f32| {
        let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        ConvexPolygon::quad([a, b, c, d].map(|[x, y]| Vec3::new(x * half, y * half, z)))
    };
    let triangle = |size: f32, z: f32| {
        let [a, b, c] = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]];
        let [a, b, c] = [a, b, c].map(|[x, y]| Vec3::new(x * size, y * size, z));
        ConvexPolygon::triangle(a, b, c)
    };
    let window = window(Vec3::ZERO);
    let hidden = |polygons: &dyn Geometry, after: &dyn Geometry, read: u16| {
        let mut surfaces = Surfaces::default();
        let whole = [0, 1].map(|id| u16::from(surfaces.set(polygons, PolygonId(id))) << id);
        let mut buffer = CoverageBuffer::new(320, 184);
        buffer.build_of(&window, &surfaces, [PolygonId(0)].into_iter());
        buffer.hidden_of_block(&surfaces, after, 0, [2, (whole[0] | whole[1]) & read])
    };
    let behind = Polygons(vec![square(1.0, -3.0), triangle(0.8, -4.0)]);
    let before = Polygons(vec![square(1.0, -3.0), triangle(0.8, -2.0)]);
    assert_eq!(hidden(&behind, &behind, u16::MAX), 2);
    assert_eq!(hidden(&behind, &before, 0), 0, "moved since it was read");
    // The solid part is behind the square, the rim beside it.
    let rimmed = Rimmed(Polygons(vec![square(1.0, -3.0), triangle(1.8, -4.0)]));
    assert_eq!(hidden(&rimmed, &rimmed, u16::MAX), 0);
    assert_eq!(hidden(&rimmed, &behind, 0), 2, "a smaller one");
}
