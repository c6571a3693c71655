//! Draws the triangles of one batch into tiles.

use glam::DVec3;

use super::{
    super::{
        facet::{Pushed, plane_of, turn},
        image::{Image, pixels_within},
        picture::{KNOWN, MARGIN, Picture, STEPS, pixels_between},
        slope::SIDE,
        table::NONE,
    },
    contour::Contour,
    prepare::{Batch, LANES, MOST_CORNERS, OccluderMesh},
    registry::Mate,
};
use crate::{index::simd::Kernel, math::Aabb, occlusion::raster::Raster};

/// Position of the sample in a pixel.
const SAMPLE: f64 = 0.5;

/// Largest distance of a sample from an edge that comes within [`MARGIN`] of the sample's pixel, with the rounding of
/// `f32`.
const TOUCH: f64 = SAMPLE + MARGIN + 0.002;

/// A surface is drawn only if it lies before what covers them in at least one of this number of its tiles. Most undersides
/// of an open mesh do not.
const LEAST_USEFUL: usize = 4;

/// Work of a tile of a surface, of an edge of its contour, and of a tile that a triangle or an edge may reach.
const TILE: u64 = 30;
const EDGE: u64 = 60;
const VISIT: u64 = 2;

/// Largest tangent of a corner's direction. A larger one would cut more of large meshes near the eye.
const MOST_TANGENT: f64 = 1.0e4;

/// A triangle up to this size, pixels, has the depth of its farthest corner everywhere.
const SMALL_PX: i32 = 12;

/// Bound of the relative error of depths in `f32` from rounding, with a margin.
const DEPTH_SLACK: f64 = 1.0e-6;

/// Sides of a triangle in the picture that faces the eye counterclockwise or clockwise, or is not drawn.
pub(super) const NOT_DRAWN: u8 = 2;
const NO_AREA: u8 = 3;

/// The transform from a mesh's own space to the axes of the view, relative to the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    rows: [[f64; 4]; 3],
    /// Nearest depth that is drawn.
    near: f64,
    /// Largest tangent of a corner's direction, across and up together.
    most_tangent: f64,
}

impl Placed {
    /// `columns` are the images of the axes, and the origin. Parts too near for exact positions are cut off. `bounds` is a
    /// box around the mesh, and around all meshes that it is linked to, so that linked meshes are cut alike.
    pub(super) fn new(columns: &[DVec3; 4], bounds: &Aabb, picture: &Picture) -> Self {
        let Picture { raster, near, most_tangent, .. } = picture;
        let own = [columns[0], columns[1], columns[2], columns[3] - raster.eye_in_world];
        let axes = own.map(|column| raster.in_axes(column));
        let rows = std::array::from_fn(|row| axes.map(|column| column[row]));
        // With `u = 2^-53`, a coordinate errs by less than `12 u` times this sum. So a quotient with the depth `z` errs by
        // `12 u (1 + t) size / z`, where `t` is its tangent. Half of [`KNOWN`] is left for it, and half for the other errors
        // in [`Picture::new`], which grow with the square of `t`.
        const U: f64 = 0.5 * f64::EPSILON;
        let most = bounds.min.abs().max(bounds.max.abs()).as_dvec3();
        let sum = |column: DVec3| column.abs().element_sum();
        let size = sum(own[0]) * most.x + sum(own[1]) * most.y + sum(own[2]) * most.z + sum(own[3]);
        let most_tangent = (most_tangent * std::f64::consts::FRAC_1_SQRT_2 - 1.0).min(MOST_TANGENT);
        let errors = 12.0 * U * raster.pixels_a_unit().max_element() * (1.0 + most_tangent);
        Self { rows, near: near.max(size * errors / (0.5 * KNOWN)), most_tangent }
    }
}

/// The part of a surface in a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Part {
    /// Number of the surface, and the part's record, if it has one.
    pub(super) surface: u32,
    pub(super) record: u32,
    /// Pixels that it reaches.
    pub(super) reached: u64,
    /// Pixels through which an open edge passes.
    pub(super) open: u64,
    /// Pixels through which a border to another batch passes.
    pub(super) border: u64,
    /// A lower bound of the reciprocal depth of all its triangles that touch the tile.
    pub(super) far: f32,
}

/// Pixels near the border of a batch in a tile, and the triangle on the other side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub(super) tile: u32,
    pub(super) instance: u32,
    pub(super) batch: u32,
    pub(super) triangle: u16,
    pub(super) pixels: u64,
}

/// A triangle at the near plane: its part beyond, as three or four corners.
#[derive(Clone, Copy, Debug)]
struct Cut {
    triangle: u16,
    corners: [[i32; 2]; 4],
    len: u8,
    /// The ends of the side at the near plane.
    side: [[i32; 2]; 2],
    far: f32,
}

/// The projected corners and the tiles of one batch.
#[derive(Clone, Debug)]
pub(super) struct Drawer {
    /// The corners relative to the eye, by axis.
    eye: [Vec<f64>; 3],
    /// Positions in steps; reciprocal depths, 0 for a corner that has no position.
    at: Box<[[i32; 2]; MOST_CORNERS]>,
    nearness: Box<[f32; MOST_CORNERS]>,
    /// For each triangle, 0 if it is counterclockwise in the picture, 1 if clockwise, or [`NOT_DRAWN`].
    pub(super) sides: Vec<u8>,
    cuts: Vec<Cut>,
    /// The inner edges of triangles that show different sides.
    silhouette: Vec<u32>,
    pub(super) parts: Vec<Part>,
    /// The tiles of the surface.
    pub(super) tiles: Vec<u32>,
    pub(super) touches: Vec<Touch>,
    surface: u32,
    /// Number of edges of the contour, and of tiles that triangles and edges may reach.
    edges: u64,
    visits: u64,
    columns: i32,
    rows: i32,
    contour: Contour,
}

impl Drawer {
    pub(super) fn new(image: &Image) -> Self {
        Self {
            eye: std::array::from_fn(|_| vec![0.0; MOST_CORNERS]),
            at: Box::new([[0; 2]; MOST_CORNERS]),
            nearness: Box::new([0.0; MOST_CORNERS]),
            sides: Vec::new(),
            cuts: Vec::new(),
            silhouette: Vec::new(),
            parts: vec![Part::default(); image.columns * image.rows],
            tiles: Vec::new(),
            touches: Vec::new(),
            surface: 0,
            edges: 0,
            visits: 0,
            columns: image.columns as i32,
            rows: image.rows as i32,
            contour: Contour::new(image.columns, image.rows),
        }
    }

    /// Forgets all surfaces.
    pub(super) fn clear(&mut self) {
        self.surface = 0;
        self.parts.iter_mut().for_each(|part| part.surface = 0);
    }

    /// Work of the last surface, drawn or not, in units of about a nanosecond: its tiles and its contour.
    pub(super) fn work(&self) -> u64 {
        self.tiles.len() as u64 * TILE + self.edges * EDGE + self.visits * VISIT
    }

    /// The number of the surface drawn last.
    pub(super) fn surface(&self) -> u32 {
        self.surface
    }

    /// Projects the corners of a batch, and finds which side of each triangle the eye sees. Returns for both sides whether
    /// any triangle shows it.
    #[inline(always)]
    pub(super) fn project(
        &mut self,
        mesh: &OccluderMesh,
        batch: &Batch,
        placed: &Placed,
        picture: &Picture,
    ) -> [bool; 2] {
        let is_whole = self.project_corners(mesh, batch, placed, picture);
        let triangles = &mesh.triangles[batch.triangles.start as usize..batch.triangles.end as usize];
        self.sides.clear();
        self.cuts.clear();
        let (at, mut seen) = (&*self.at, [false; 4]);
        if is_whole {
            for t in triangles {
                let [a, b, c] = t.map(|corner| at[usize::from(corner) % MOST_CORNERS].map(i64::from));
                let area = turn(a, b, c);
                let side = if area == 0 { NO_AREA } else { u8::from(area < 0) };
                seen[usize::from(side)] = true;
                self.sides.push(side);
            }
        } else {
            for (t, number) in triangles.iter().zip(0..) {
                let side = self.side_of(*t, number, placed, picture);
                seen[usize::from(side)] = true;
                self.sides.push(side);
            }
        }
        if seen[usize::from(NO_AREA)] {
            // A triangle without area may face either side, so it faces that of a neighbour.
            let sides = &mut self.sides[..];
            for inner in &mesh.inner[batch.inner.start as usize..batch.inner.end as usize] {
                let [a, b] = inner.triangles.map(usize::from);
                if sides[a] == NO_AREA {
                    sides[a] = sides[b];
                } else if sides[b] == NO_AREA {
                    sides[b] = sides[a];
                }
            }
            for side in sides.iter_mut().filter(|side| **side == NO_AREA) {
                *side = u8::from(!seen[0]);
            }
        }
        self.silhouette.clear();
        if seen.iter().filter(|&&seen| seen).count() > 1 {
            for number in batch.inner.clone() {
                let [a, b] = mesh.inner[number as usize].triangles;
                if self.sides[usize::from(a)] != self.sides[usize::from(b)] {
                    self.silhouette.push(number);
                }
            }
        }
        [seen[0], seen[1]]
    }

    /// Returns whether every corner has a position.
    #[inline(always)]
    fn project_corners(
        &mut self,
        mesh: &OccluderMesh,
        batch: &Batch,
        placed: &Placed,
        picture: &Picture,
    ) -> bool {
        /// 1.5 x 2^52: added to a smaller number, it leaves the nearest whole number in the lower bits.
        const WHOLE: f64 = 6_755_399_441_055_744.0;
        let range = batch.corners.start as usize..batch.corners.end as usize;
        let count = range.len();
        let [xs, ys, zs] = [0, 1, 2].map(|axis| mesh.corners[axis][range.clone()].as_chunks::<LANES>().0);
        let [right, up, forward] = &mut self.eye;
        let [right, up, forward] =
            [right, up, forward].map(|axis| axis[..count].as_chunks_mut::<LANES>().0.iter_mut());
        let at = self.at[..count].as_chunks_mut::<LANES>().0.iter_mut();
        let nearness = self.nearness[..count].as_chunks_mut::<LANES>().0.iter_mut();
        let scale = picture.raster.pixels_a_unit() * STEPS;
        let origin = picture.raster.flat_in_pixels(0.0, 0.0) * STEPS;
        let Placed { rows, near, most_tangent } = placed;
        let mut is_whole = true;
        let eyes = right.zip(up).zip(forward);
        for ((((x, y), z), ((right, up), forward)), (at, nearness)) in
            xs.iter().zip(ys).zip(zs).zip(eyes).zip(at.zip(nearness))
        {
            let own = [x, y, z].map(|axis| axis.map(f64::from));
            for (row, out) in rows.iter().zip([&mut *right, up, forward]) {
                for lane in 0..LANES {
                    out[lane] =
                        row[0] * own[0][lane] + row[1] * own[1][lane] + row[2] * own[2][lane] + row[3];
                }
            }
            let mut is_known = [false; LANES];
            for lane in 0..LANES {
                let near_by = 1.0 / forward[lane];
                let (u, v) = (right[lane] * near_by, up[lane] * near_by);
                // So far away that its reciprocal is 0 in `f32`, a corner is unknown, too.
                let near_by_f32 = (near_by * (1.0 - DEPTH_SLACK)) as f32;
                is_known[lane] =
                    forward[lane] >= *near && u.abs() + v.abs() <= *most_tangent && near_by_f32 > 0.0;
                let (px, py) = (u * scale.x + origin.x, v * scale.y + origin.y);
                at[lane] = [px, py].map(|v| (v + WHOLE).to_bits() as u32 as i32);
                nearness[lane] = if is_known[lane] { near_by_f32 } else { 0.0 };
            }
            is_whole &= is_known.iter().all(|&is_known| is_known);
        }
        is_whole
    }

    #[inline(always)]
    fn eye_at(&self, corner: u16) -> DVec3 {
        let corner = usize::from(corner);
        DVec3::new(self.eye[0][corner], self.eye[1][corner], self.eye[2][corner])
    }

    /// The place of a point, and its reciprocal depth; `None` if it is too imprecise.
    fn place(&self, eye: DVec3, picture: &Picture) -> Option<[i32; 2]> {
        let (at, nearness) = picture.project(eye);
        (nearness > 0.0).then_some(at)
    }

    /// The side of a triangle that the near plane may cut. The part beyond it is stored.
    fn side_of(&mut self, t: [u16; 3], number: u16, placed: &Placed, picture: &Picture) -> u8 {
        let side = |area: i64| if area == 0 { NO_AREA } else { u8::from(area < 0) };
        let nearness = t.map(|corner| self.nearness[usize::from(corner)]);
        if nearness.iter().all(|&nearness| nearness > 0.0) {
            let [a, b, c] = t.map(|corner| self.at[usize::from(corner)].map(i64::from));
            return side(turn(a, b, c));
        }
        let mut cut =
            Cut { triangle: number, corners: [[0; 2]; 4], len: 0, side: [[0; 2]; 2], far: f32::MAX };
        for i in 0..3 {
            let (from, to) = (t[i], t[(i + 1) % 3]);
            let is_in = [from, to].map(|corner| self.eye_at(corner).z >= placed.near);
            if is_in[0] {
                if nearness[i] == 0.0 {
                    return NOT_DRAWN;
                }
                cut.far = cut.far.min(nearness[i]);
                cut.corners[usize::from(cut.len)] = self.at[usize::from(from)];
                cut.len += 1;
            }
            if is_in[0] != is_in[1] {
                let Some(at) = self.cut(from, to, placed, picture) else { return NOT_DRAWN };
                cut.corners[usize::from(cut.len)] = at;
                cut.len += 1;
                // The side goes from where the outline leaves to where it comes back.
                cut.side[usize::from(is_in[1])] = at;
            }
        }
        if cut.len < 3 {
            return NOT_DRAWN;
        }
        let [a, b, c, d] = cut.corners.map(|at| at.map(i64::from));
        let areas = [turn(a, b, c), if cut.len == 4 { turn(a, c, d) } else { 0 }];
        if areas[0].signum() * areas[1].signum() < 0 {
            return NOT_DRAWN;
        }
        self.cuts.push(cut);
        side(areas[0] + areas[1])
    }

    /// The place at which the near plane cuts an edge. It is the same for both triangles of the edge.
    fn cut(&self, from: u16, to: u16, placed: &Placed, picture: &Picture) -> Option<[i32; 2]> {
        let (a, b) = (self.eye_at(from), self.eye_at(to));
        let (low, high) = if a.to_array() < b.to_array() { (a, b) } else { (b, a) };
        let along = (placed.near - low.z) / (high.z - low.z);
        let mut eye = low + (high - low) * along;
        eye.z = placed.near;
        let size = low.abs().element_sum() + high.abs().element_sum();
        if size > picture.most_tangent * placed.near {
            return None;
        }
        self.place(eye, picture)
    }

    /// The ends of an edge in the picture; `None` if it lies before the near plane.
    #[inline(always)]
    fn ends(&self, ends: [u16; 2], placed: &Placed, picture: &Picture) -> Option<[[i32; 2]; 2]> {
        let [a, b] = ends.map(usize::from);
        if self.nearness[a] > 0.0 && self.nearness[b] > 0.0 {
            return Some([self.at[a], self.at[b]]);
        }
        let is_in = ends.map(|corner| self.eye_at(corner).z >= placed.near);
        if is_in[0] == is_in[1] {
            return None;
        }
        let cut = self.cut(ends[0], ends[1], placed, picture)?;
        Some(if is_in[0] { [self.at[a], cut] } else { [cut, self.at[b]] })
    }

    /// Draws the triangles of the projected batch that show `side`. The mesh is number `own`, and `mates` has the triangle of
    /// another mesh at a border. Returns false, without effect, if the image already covers most of them.
    #[inline(always)]
    pub(super) fn draw<K: Kernel>(
        &mut self,
        kernel: K,
        (mesh, batch): (&OccluderMesh, &Batch),
        (placed, picture): (&Placed, &Picture),
        side: u8,
        (own, mates): (u32, impl Fn(usize) -> Option<Mate>),
        image: &Image,
    ) -> bool {
        self.surface += 1;
        (self.edges, self.visits) = (0, 0);
        self.tiles.clear();
        self.touches.clear();
        self.draw_depths((mesh, batch), placed, picture, side);
        let Self { tiles, parts, .. } = self;
        let useful = tiles.iter().filter(|&&tile| parts[tile as usize].far > image.all[tile as usize]);
        if useful.count() * LEAST_USEFUL < tiles.len() || tiles.is_empty() {
            self.visits += 2 * tiles.len() as u64;
            tiles.clear();
            return false;
        }
        // Clockwise triangles pass their edges the other way round.
        let is_turned = side == 1;
        for i in 0..self.silhouette.len() {
            let inner = &mesh.inner[self.silhouette[i] as usize];
            let [a, b] = inner.triangles.map(|t| self.sides[usize::from(t)]);
            if (a == side || b == side)
                && let Some(ends) = self.ends(inner.ends, placed, picture)
            {
                self.contour.add(ends, is_turned != (b == side));
                self.edge(kernel, ends, |part, _, pixels| part.open |= pixels);
            }
        }
        for i in 0..self.cuts.len() {
            let Cut { triangle, side: ends, .. } = self.cuts[i];
            if self.sides[usize::from(triangle)] == side {
                self.contour.add(ends, is_turned);
                self.edge(kernel, ends, |part, _, pixels| part.open |= pixels);
            }
        }
        let mut open = batch.first_open as usize..;
        for number in batch.borders.clone() {
            let border = &mesh.borders[number as usize];
            let own = || (border.mate_batch != NONE).then_some((own, border.mate_batch, border.mate));
            let other = |mate: Mate| (mate.instance, mate.batch, mate.triangle);
            let mate = own().or_else(|| mates(open.next()?).map(other));
            if self.sides[usize::from(border.triangle)] != side {
                continue;
            }
            let Some(ends) = self.ends(border.ends, placed, picture) else { continue };
            self.contour.add(ends, is_turned);
            let Some((instance, batch, triangle)) = mate else {
                self.edge(kernel, ends, |part, _, pixels| part.open |= pixels);
                continue;
            };
            let mut touches = std::mem::take(&mut self.touches);
            self.edge(kernel, ends, |part, tile, pixels| {
                part.border |= pixels;
                touches.push(Touch { tile, instance, batch, triangle, pixels });
            });
            self.touches = touches;
        }
        let Self { contour, parts, surface, .. } = self;
        contour.fill(|tile, pixels| {
            if parts[tile].surface == *surface {
                parts[tile].reached = pixels;
            }
        });
        true
    }

    /// Draws the depths of the triangles that show `side`.
    #[inline(always)]
    fn draw_depths(
        &mut self,
        (mesh, batch): (&OccluderMesh, &Batch),
        placed: &Placed,
        picture: &Picture,
        side: u8,
    ) {
        let triangles = &mesh.triangles[batch.triangles.start as usize..batch.triangles.end as usize];
        let mut cuts = 0;
        for (number, t) in triangles.iter().enumerate() {
            if self.sides[number] != side {
                continue;
            }
            let [a, b, c] = t.map(|corner| usize::from(corner) % MOST_CORNERS);
            let far = smaller(smaller(self.nearness[a], self.nearness[b]), self.nearness[c]);
            if far > 0.0 {
                let corners = [self.at[a], self.at[b], self.at[c]];
                self.depth(corners, far, t, &picture.raster);
                continue;
            }
            while usize::from(self.cuts[cuts].triangle) != number {
                cuts += 1;
            }
            let Cut { corners: [a, b, c, d], len, far, .. } = self.cuts[cuts];
            let far = far.min((1.0 / placed.near * (1.0 - DEPTH_SLACK)) as f32);
            self.depth([a, b, c], far, t, &picture.raster);
            if len == 4 {
                self.depth([a, c, d], far, t, &picture.raster);
            }
        }
    }

    /// The pixels and the tiles of a range of corners; `None` outside of the picture.
    #[inline(always)]
    fn reach(&self, corners: &[[i32; 2]]) -> Option<[[[i32; 2]; 2]; 2]> {
        let ends = |axis: usize| {
            let (mut low, mut high) = (i32::MAX, i32::MIN);
            for at in corners {
                (low, high) = (low.min(at[axis]), high.max(at[axis]));
            }
            pixels_between([low, high])
        };
        let (x, y) = (ends(0), ends(1));
        let side = SIDE as i32;
        let tiles = |[from, end]: [i32; 2], count: i32| {
            [from.max(0) / side, (end.min(count * side) + side - 1) / side]
        };
        let (columns, rows) = (tiles(x, self.columns), tiles(y, self.rows));
        // Written so that a range that ends before the picture is empty.
        let is_in = x[1] > 0 && y[1] > 0 && columns[0] < columns[1] && rows[0] < rows[1];
        is_in.then_some([[x, y], [columns, rows]])
    }

    #[inline(always)]
    fn part(&mut self, tile: usize, far: f32) -> &mut Part {
        let part = &mut self.parts[tile];
        if part.surface != self.surface {
            *part = Part { surface: self.surface, far: f32::INFINITY, ..Part::default() };
            self.tiles.push(tile as u32);
        }
        part.far = if far < part.far { far } else { part.far };
        part
    }

    /// Draws the depth of a triangle in all tiles that it touches, and perhaps others.
    #[inline(always)]
    fn depth(&mut self, corners: [[i32; 2]; 3], far: f32, t: &[u16; 3], raster: &Raster) {
        let Some([[x, y], [columns, rows]]) = self.reach(&corners) else { return };
        self.visits += ((columns[1] - columns[0]) * (rows[1] - rows[0])) as u64;
        if columns[1] - columns[0] == 1 && rows[1] - rows[0] == 1 {
            self.part((rows[0] * self.columns + columns[0]) as usize, far);
            return;
        }
        if x[1] - x[0] <= SMALL_PX && y[1] - y[0] <= SMALL_PX {
            for row in rows[0]..rows[1] {
                for column in columns[0]..columns[1] {
                    self.part((row * self.columns + column) as usize, far);
                }
            }
            return;
        }
        let plane = plane_of(&t.map(|corner| self.eye_at(corner)), raster, Pushed::Back);
        // For each edge: a value that is positive inside, at the first sample of the picture, and what a tile adds at most.
        let [a, b, c] = corners.map(|at| at.map(|v| f64::from(v) * (1.0 / STEPS)));
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let sign = if area < 0.0 { -1.0 } else { 1.0 };
        let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| {
            let (dx, dy) = ((to[0] - from[0]) * sign, (to[1] - from[1]) * sign);
            let most = SIDE as f64 * ((-dy).max(0.0) + dx.max(0.0)) + dx.abs() + dy.abs();
            (-dy, dx, dy * from[0] - dx * from[1] + most)
        });
        for row in rows[0]..rows[1] {
            for column in columns[0]..columns[1] {
                let (px, py) = (f64::from(column * SIDE as i32), f64::from(row * SIDE as i32));
                if edges.iter().any(|(by_x, by_y, most)| by_x * px + by_y * py + most < 0.0) {
                    continue;
                }
                let mut bound = far;
                if let Some([start, across, up]) = plane {
                    let end = SIDE as f64;
                    let terms = start.abs() + (across * (px + end)).abs() + (up * (py + end)).abs();
                    let least = start + across * px + up * py + (across * end).min(0.0) + (up * end).min(0.0);
                    bound = ((least - DEPTH_SLACK * terms) as f32).max(far);
                }
                self.part((row * self.columns + column) as usize, bound);
            }
        }
    }

    /// Finds the pixels within [`MARGIN`] of an edge, in the tiles of the surface.
    #[inline(always)]
    fn edge<K: Kernel>(&mut self, kernel: K, ends: [[i32; 2]; 2], mut each: impl FnMut(&mut Part, u32, u64)) {
        self.edges += 1;
        let Some([[x, y], [columns, rows]]) = self.reach(&ends) else { return };
        self.visits += ((columns[1] - columns[0]) * (rows[1] - rows[0])) as u64;
        let [from, to] = ends.map(|at| at.map(|v| f64::from(v) * (1.0 / STEPS)));
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = dx.abs() + dy.abs();
        let base = -dy * (SAMPLE - from[0]) + dx * (SAMPLE - from[1]);
        // The pixels of a horizontal or vertical strip are all near.
        let is_strip = x[1] - x[0] == 1 || y[1] - y[0] == 1;
        let (by_x, by_y) = (-dy as f32, dx as f32);
        for row in rows[0]..rows[1] {
            for column in columns[0]..columns[1] {
                let tile = (row * self.columns + column) as usize;
                if self.parts[tile].surface != self.surface {
                    continue;
                }
                let (left, low) = (column * SIDE as i32, row * SIDE as i32);
                let mut pixels = pixels_within(x, y, left, low);
                if !is_strip {
                    let at = base - dy * f64::from(left) + dx * f64::from(low);
                    if at.abs() > (SIDE as f64 + 1.0) * length {
                        continue;
                    }
                    let touch = TOUCH * length;
                    pixels &= kernel.half_planes(
                        [(touch + at) as f32, (touch - at) as f32],
                        [by_x, -by_x],
                        [by_y, -by_y],
                    );
                }
                if pixels != 0 {
                    each(&mut self.parts[tile], tile as u32, pixels);
                }
            }
        }
    }
}

/// The smaller number; unspecified for NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
