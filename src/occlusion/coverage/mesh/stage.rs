//! Draws the meshes of a view, the nearest first, and joins their batches.

use std::{cmp::Reverse, collections::BinaryHeap};

use glam::DVec3;

use super::{
    super::{boxes::TestBoxes, image::Image, picture::Picture, slope::SIDE, table::NONE},
    draw::{Drawer, Placed, Touch},
    prepare::Batch,
    registry::{Columns, Instance, Meshes, UNMOVED, moved},
};
use crate::{
    index::simd::{Backend, Kernel, WithKernel},
    math::{Aabb, Frustum},
    occlusion::{Needed, Tested, TestedBoxes, Verdict, raster::Raster},
    view::ViewWindow,
};

/// Number of boxes that are tested at once.
const TOGETHER: usize = 16;

/// Expected work before the first round of tests; half as much more before each further round. With less, more time goes
/// into joining batches; with more, more hidden batches are drawn.
const FIRST_WAVE: u64 = 2048 * EXPECTED;

/// Work of the steps, in units of about a nanosecond.
const CONSIDER: u64 = 6;
const ENTER: u64 = 30;
const TEST: u64 = 40;
const BATCH: u64 = 400;
const CORNER: u64 = 4;
const TRIANGLE: u64 = 12;
const RECORD: u64 = 4;

/// Work expected for each triangle of a batch, with its edges and tiles.
const EXPECTED: u64 = 40;

/// A mesh or batch with a box of fewer pixels than this hides too little to be drawn.
const LEAST_PX: f32 = 150.0;

/// The box inside of a mesh stands for the mesh if it is smaller by at most this many pixels on each side.
const MOST_GAP_PX: f32 = 1.0;

/// Stands for the box inside of a mesh, in place of a batch.
const INNER_BOX: u32 = NONE - 1;

/// What cameras did with the occluders; see [`Culler::occlusion`](crate::Culler::occlusion).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct OcclusionReport {
    /// Number of occluders in view.
    pub considered: usize,
    /// Number of occluders that were drawn, wholly or in part.
    pub drawn: usize,
    /// Number of occluders that other occluders hide.
    pub hidden: usize,
    /// Number of occluders that are too small on the screen to hide anything.
    pub too_small: usize,
    /// Number of occluders that the budget left out.
    pub over_budget: usize,
    /// Number of triangles drawn.
    pub triangles: usize,
    /// Counted work of the depth buffer, in units of about a nanosecond.
    pub work: u64,
    /// Number of cameras that ask for occlusion culling, but have a parallel projection, an oblique near plane or a
    /// sheared screen.
    pub unsupported: usize,
    /// Number of cameras that use no occluders, because they do not see the layers of an object with an occluder.
    pub unseen: usize,
}

impl OcclusionReport {
    pub(crate) fn add(&mut self, view: &Self) {
        self.considered += view.considered;
        self.drawn += view.drawn;
        self.hidden += view.hidden;
        self.too_small += view.too_small;
        self.over_budget += view.over_budget;
        self.triangles += view.triangles;
        self.work += view.work;
        self.unsupported += view.unsupported;
        self.unseen += view.unseen;
    }
}

/// A part of a surface in a tile that a border to another batch crosses.
#[derive(Clone, Copy, Debug)]
struct Record {
    tile: u32,
    surface: u32,
    /// An earlier record of the tile that belongs to the same surface; itself, if there is none.
    parent: u32,
    /// The previous record of the tile.
    previous: u32,
    reached: u64,
    open: u64,
    /// Pixels at a border whose other side is not drawn yet.
    pending: u64,
    border: u64,
    far: f32,
}

/// A border whose other side is not drawn yet, in a tile.
#[derive(Clone, Copy, Debug)]
struct Pending {
    record: u32,
    /// The mesh of the other side, its batch, and the triangle in it.
    instance: u32,
    batch: u32,
    triangle: u16,
    side: u8,
    pixels: u64,
}

/// A drawn batch.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    /// Where its triangles' sides begin.
    sides: u32,
    /// The surfaces of both sides.
    surfaces: [u32; 2],
}

/// A mesh or a batch: its squared distance, the instance, and the batch; [`NONE`] for the whole mesh.
type Item = Reverse<(u32, u32, u32)>;

/// The depths of the occluder meshes of one view.
#[derive(Clone, Debug)]
pub(crate) struct MeshBuffer {
    image: Image,
    picture: Option<Picture>,
    backend: Backend,
    drawer: Drawer,
    items: BinaryHeap<Item>,
    wave: Vec<(u32, u32)>,
    /// For each mesh, the number of its first batch in `drawn_of`; [`NONE`] if it is not drawn.
    first_batch: Vec<u32>,
    /// For each batch of these meshes, its entry in `drawn`.
    drawn_of: Vec<u32>,
    drawn: Vec<Drawn>,
    sides: Vec<u8>,
    /// For each tile, its last record.
    last: Vec<u32>,
    records: Vec<Record>,
    sums: Vec<Record>,
    pending: Vec<Pending>,
    counts: OcclusionReport,
}

impl MeshBuffer {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let image = Image::new(width.div_ceil(SIDE), height.div_ceil(SIDE));
        Self {
            drawer: Drawer::new(&image),
            last: vec![NONE; image.columns * image.rows],
            image,
            picture: None,
            backend: Backend::detect(),
            items: BinaryHeap::new(),
            wave: Vec::new(),
            first_batch: Vec::new(),
            drawn_of: Vec::new(),
            drawn: Vec::new(),
            sides: Vec::new(),
            records: Vec::new(),
            sums: Vec::new(),
            pending: Vec::new(),
            counts: OcclusionReport::default(),
        }
    }

    pub(crate) fn counts(&self) -> &OcclusionReport {
        &self.counts
    }

    /// Whether nothing is covered.
    pub(crate) fn is_empty(&self) -> bool {
        self.counts.drawn == 0
    }

    /// Draws the meshes of a view, up to about `budget` units of work. `is_hidden` knows meshes that other occluders hide.
    pub(crate) fn build(
        &mut self,
        meshes: &Meshes,
        window: &ViewWindow,
        frustum: &Frustum,
        budget: u64,
        is_hidden: &dyn Fn(&Aabb) -> bool,
    ) {
        self.image.clear();
        self.drawer.clear();
        self.last.fill(NONE);
        self.items.clear();
        self.drawn_of.clear();
        self.drawn.clear();
        self.sides.clear();
        self.records.clear();
        self.pending.clear();
        self.counts = OcclusionReport::default();
        self.first_batch.clear();
        self.first_batch.resize(meshes.instances.len(), NONE);
        let raster = Raster::new(window, (self.image.columns * SIDE) as f64, (self.image.rows * SIDE) as f64);
        // A mesh is as far away as its size, if there is no near plane.
        let usual_m = meshes.bounds.iter().map(|bounds| f64::from(bounds.extent().max_element()));
        let picture = Picture::new(window, &raster, usual_m.fold(1.0e-3, f64::max));
        self.picture = Some(picture);
        self.backend.run(Build { buffer: self, meshes, picture: &picture, frustum, budget, is_hidden });
    }

    /// Tests at most sixteen boxes.
    pub(crate) fn test(&self, boxes: &[Aabb], needed: Needed) -> TestedBoxes {
        let mut all = TestedBoxes::default();
        let Some(picture) = &self.picture else { return all };
        let each = |lane: usize, Tested { verdict, steps }: Tested| {
            all.hidden |= u16::from(verdict == Verdict::Hidden) << lane;
            all.unoccluded |= u16::from(verdict == Verdict::Unoccluded) << lane;
            all.steps += steps;
            all.planes += steps;
        };
        self.backend.run(TestBoxes { image: &self.image, picture, boxes, needed, each });
        all
    }
}

/// Draws the meshes of a view.
struct Build<'a> {
    buffer: &'a mut MeshBuffer,
    meshes: &'a Meshes,
    picture: &'a Picture,
    frustum: &'a Frustum,
    budget: u64,
    is_hidden: &'a dyn Fn(&Aabb) -> bool,
}

impl WithKernel for Build<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let Self { buffer, meshes, picture, frustum, budget, is_hidden } = self;
        buffer.consider_meshes(meshes, picture, frustum);
        let mut wave_size = FIRST_WAVE;
        loop {
            let mut expected = 0;
            buffer.wave.clear();
            while expected < wave_size && buffer.counts.work + expected < budget {
                let next = buffer.next(kernel, meshes, (picture, frustum), budget, is_hidden);
                match next {
                    Some(more) => expected += more,
                    None => break,
                }
            }
            if buffer.wave.is_empty() {
                break;
            }
            buffer.draw_wave(kernel, meshes, picture, budget);
            wave_size += wave_size / 2;
        }
        buffer.counts.over_budget +=
            buffer.items.iter().filter(|Reverse((_, _, batch))| *batch == NONE).count();
    }
}

impl MeshBuffer {
    #[inline(always)]
    fn consider_meshes(&mut self, meshes: &Meshes, picture: &Picture, frustum: &Frustum) {
        for (bounds, number) in meshes.bounds.iter().zip(0..) {
            if bounds.is_empty() || !frustum.may_see(bounds) {
                continue;
            }
            self.counts.considered += 1;
            self.push(bounds, picture, number, NONE);
        }
        self.counts.work += meshes.bounds.len() as u64 * CONSIDER;
    }

    #[inline(always)]
    fn push(&mut self, bounds: &Aabb, picture: &Picture, instance: u32, batch: u32) {
        let eye = picture.raster.eye_in_world.as_vec3();
        let distance_squared = bounds.distance_squared(eye);
        let pixels = picture.raster.pixels_a_unit().as_vec2().element_product();
        let size = 0.5 * bounds.extent().length_squared();
        if size * pixels < LEAST_PX * distance_squared {
            self.counts.too_small += usize::from(batch == NONE);
        } else {
            self.items.push(Reverse((distance_squared.to_bits(), instance, batch)));
        }
    }

    /// Tests the nearest meshes and batches, and adds the visible batches to the wave. Returns the expected work to draw
    /// them; `None` at the end.
    #[inline(always)]
    fn next<K: Kernel>(
        &mut self,
        kernel: K,
        meshes: &Meshes,
        (picture, frustum): (&Picture, &Frustum),
        budget: u64,
        is_hidden: &dyn Fn(&Aabb) -> bool,
    ) -> Option<u64> {
        let (mut group, mut boxes, mut len) = ([(0, 0); TOGETHER], [Aabb::EMPTY; TOGETHER], 0);
        while len < TOGETHER
            && let Some(Reverse((_, number, batch))) = self.items.pop()
        {
            let Some(Instance { mesh, columns, .. }) = &meshes.instances[number as usize] else { continue };
            group[len] = (number, batch);
            boxes[len] = match mesh.batches.get(batch as usize) {
                Some(batch) => moved(columns, &batch.bounds),
                None => meshes.bounds[number as usize],
            };
            len += 1;
        }
        if len == 0 {
            return None;
        }
        self.counts.work += len as u64 * TEST;
        let mut hidden = 0_u32;
        if !self.drawn.is_empty() {
            let each =
                |lane: usize, tested: Tested| hidden |= u32::from(tested.verdict == Verdict::Hidden) << lane;
            let boxes = &boxes[..len];
            TestBoxes { image: &self.image, picture, boxes, needed: Needed::Hidden, each }.run(kernel);
        }
        let mut expected = 0;
        let eye = picture.raster.eye_in_world.as_vec3();
        for i in 0..len {
            let (number, batch) = group[i];
            let Some(Instance { mesh, columns, .. }) = &meshes.instances[number as usize] else { continue };
            let is_mesh = batch == NONE;
            if hidden >> i & 1 == 1 || is_mesh && is_hidden(&boxes[i]) {
                self.counts.hidden += usize::from(is_mesh);
                continue;
            }
            let enter = if is_mesh { mesh.batches.len() as u64 * ENTER } else { 0 };
            if self.counts.work + enter > budget {
                self.counts.over_budget += usize::from(is_mesh);
                continue;
            }
            if is_mesh {
                self.counts.drawn += 1;
                self.first_batch[number as usize] = self.drawn_of.len() as u32;
                self.drawn_of.resize(self.drawn_of.len() + mesh.batches.len(), NONE);
                if let Some(inner) = &mesh.inner_box
                    && is_box_enough(inner.gap, columns, boxes[i].distance_squared(eye).sqrt(), picture)
                {
                    self.wave.push((number, INNER_BOX));
                    expected += expected_for(&inner.mesh.batches[0]);
                    continue;
                }
                if mesh.batches.len() > 1 {
                    self.counts.work += enter;
                    for (batch, k) in mesh.batches.iter().zip(0..) {
                        let bounds = moved(columns, &batch.bounds);
                        if frustum.may_see(&bounds) {
                            self.push(&bounds, picture, number, k);
                        }
                    }
                    continue;
                }
            }
            let batch = if is_mesh { 0 } else { batch };
            self.wave.push((number, batch));
            expected += expected_for(&mesh.batches[batch as usize]);
        }
        Some(expected)
    }

    #[inline(always)]
    fn draw_wave<K: Kernel>(&mut self, kernel: K, meshes: &Meshes, picture: &Picture, budget: u64) {
        let eye = picture.raster.eye_in_world.as_vec3();
        for i in 0..self.wave.len() {
            let (number, mut k) = self.wave[i];
            if self.counts.work >= budget {
                break;
            }
            let Some(instance) = &meshes.instances[number as usize] else { continue };
            let Instance { mesh, columns, .. } = instance;
            let mut mesh = &**mesh;
            if let Some(inner) = mesh.inner_box.as_ref().filter(|_| k == INNER_BOX) {
                (mesh, k) = (&*inner.mesh, 0);
            }
            let batch = &mesh.batches[k as usize];
            let around = meshes.around.filter(|_| *columns == UNMOVED).unwrap_or(mesh.bounds());
            let placed = Placed::new(&columns.map(|column| column.as_dvec3()), &around, picture);
            let mut seen = self.drawer.project(mesh, batch, &placed, picture);
            self.counts.work += BATCH + batch.corners.len() as u64 * CORNER;
            if mesh.is_closed && meshes.bounds[number as usize].distance_squared(eye) > 0.0 {
                // From outside, the back of a closed mesh lies behind its front.
                let front = usize::from(mesh.faces_out == is_mirrored(columns));
                seen[1 - front] = false;
            }
            let mut drawn = Drawn { sides: self.sides.len() as u32, surfaces: [NONE; 2] };
            self.sides.extend_from_slice(&self.drawer.sides);
            // The side of more triangles comes first, because it often hides the other one.
            let turned = self.drawer.sides.iter().filter(|&&side| side == 1).count();
            let first = u8::from(2 * turned > self.drawer.sides.len());
            for side in [first, 1 - first].into_iter().filter(|&side| seen[usize::from(side)]) {
                let of = (number, |border| meshes.mate(instance, border));
                self.counts.work += batch.triangles.len() as u64 * TRIANGLE;
                if self.drawer.draw(kernel, (mesh, batch), (&placed, picture), side, of, &self.image) {
                    drawn.surfaces[usize::from(side)] = self.drawer.surface();
                    self.flush(kernel, side);
                }
                self.counts.work += self.drawer.work();
            }
            self.counts.triangles += batch.triangles.len();
            self.drawn_of[(self.first_batch[number as usize] + k) as usize] = self.drawn.len() as u32;
            self.drawn.push(drawn);
        }
        self.join(kernel);
        self.counts.work += (self.records.len() + self.pending.len()) as u64 * RECORD;
    }

    /// Adds the drawn surface to the image, except near borders to other batches.
    #[inline(always)]
    fn flush<K: Kernel>(&mut self, kernel: K, side: u8) {
        let Self { drawer, image, records, last, pending, .. } = self;
        for &tile in &drawer.tiles {
            let part = &mut drawer.parts[tile as usize];
            let covered = part.reached & !part.open;
            if covered & !part.border != 0 {
                image.raise(kernel, tile as usize, covered & !part.border, part.far);
            }
            if part.border != 0 {
                part.record = records.len() as u32;
                records.push(Record {
                    tile,
                    surface: part.surface,
                    parent: part.record,
                    previous: std::mem::replace(&mut last[tile as usize], part.record),
                    reached: part.reached,
                    open: part.open,
                    pending: 0,
                    border: part.border,
                    far: part.far,
                });
            }
        }
        pending.extend(drawer.touches.iter().map(|&Touch { tile, instance, batch, triangle, pixels }| {
            Pending { record: drawer.parts[tile as usize].record, instance, batch, triangle, side, pixels }
        }));
    }

    /// Joins neighbouring batches, and adds the pixels at their common borders to the image.
    #[inline(always)]
    fn join<K: Kernel>(&mut self, kernel: K) {
        let Self { records, pending, first_batch, drawn_of, drawn, sides, sums, image, last, .. } = self;
        records.iter_mut().for_each(|record| record.pending = 0);
        pending.retain(|at| {
            let record = &mut records[at.record as usize];
            let first = first_batch[at.instance as usize];
            let batch = if first == NONE { NONE } else { drawn_of[(first + at.batch) as usize] };
            let Some(mate) = drawn.get(batch as usize) else {
                record.pending |= at.pixels;
                return true;
            };
            let surface = mate.surfaces[usize::from(at.side)];
            let is_alike = sides[mate.sides as usize + usize::from(at.triangle)] == at.side;
            let mut other = last[record.tile as usize];
            while is_alike && surface != NONE && other != NONE && records[other as usize].surface != surface {
                other = records[other as usize].previous;
            }
            if is_alike && surface != NONE && other != NONE {
                let (a, b) = (root(records, at.record), root(records, other));
                records[a.max(b) as usize].parent = a.min(b);
            } else {
                records[at.record as usize].open |= at.pixels;
            }
            false
        });
        sums.clear();
        for number in 0..records.len() as u32 {
            let (root, record) = (root(records, number), records[number as usize]);
            sums.push(record);
            if root != number {
                let sum = &mut sums[root as usize];
                sum.reached |= record.reached;
                sum.open |= record.open;
                sum.pending |= record.pending;
                sum.border |= record.border;
                sum.far = sum.far.min(record.far);
            }
        }
        for sum in sums.iter().zip(0..).filter(|(sum, number)| sum.parent == *number).map(|(sum, _)| sum) {
            let covered = sum.reached & sum.border & !(sum.open | sum.pending);
            if covered != 0 {
                image.raise(kernel, sum.tile as usize, covered, sum.far);
            }
        }
    }
}

#[inline(always)]
fn root(records: &mut [Record], mut at: u32) -> u32 {
    loop {
        let parent = records[at as usize].parent;
        if parent == at {
            return at;
        }
        let next = records[parent as usize].parent;
        records[at as usize].parent = next;
        at = next;
    }
}

/// Whether the box inside of a mesh hides nearly as much as the mesh, at this distance. The near plane must lie outside of
/// the mesh, because the mesh hides nothing where the near plane cuts it open.
fn is_box_enough(gap: f32, columns: &Columns, distance_m: f32, picture: &Picture) -> bool {
    let scale = columns[..3].iter().map(|column| column.length()).fold(0.0, f32::max);
    let [low, high] = picture.raster.tangents();
    let corner = low.abs().max(high.abs());
    let reach_m = picture.near * (1.0 + corner.length_squared()).sqrt();
    let gap_px = gap * scale * picture.raster.pixels_a_unit().max_element() as f32;
    f64::from(distance_m) > reach_m * (1.0 + 1.0e-5) && gap_px <= MOST_GAP_PX * distance_m
}

fn is_mirrored(columns: &Columns) -> bool {
    let [x, y, z] = [columns[0], columns[1], columns[2]].map(|column| column.as_dvec3());
    DVec3::dot(x.cross(y), z) < 0.0
}

/// Expected work to draw a batch.
fn expected_for(batch: &Batch) -> u64 {
    BATCH + batch.triangles.len() as u64 * EXPECTED
}
