use std::{collections::BTreeSet, ops::Range};

use wgpu::util::DeviceExt as _;

use super::{
    Classes, Gpu,
    chunks::{Chunks, FIRST_LEN},
    gpu::CHUNKS_A_PAGE,
    record::{Colors, DrawClass, PolygonRecord},
};
use osp::polygon::{Change, PolygonId, SpaceId, bits};
use osp_session::scene::Scene;

/// Moved polygons are sent in one transfer if at most this number of unmoved polygons lies between them. Sending 96
/// bytes for each unmoved polygon costs less than another transfer.
const GAP: usize = 16;

/// Largest number of polygons of one transfer (1.5 MiB). A single transfer of a large session would double its memory
/// for a moment.
const TRANSFER: usize = 1 << 14;

pub(super) const CORNERS: u32 = 4;
pub(super) const INDICES: u32 = 6;

#[derive(Debug)]
pub(super) struct GpuScene {
    pub(super) chunks: Chunks,
    draw_len: usize,
    /// Indices for as many polygons as the scene has, at most `draw_len`.
    indices: wgpu::Buffer,
    /// Number of polygons that the scene had freed at the last [`GpuScene::flush`].
    free_unreachable: u64,
    pub(super) uploaded: usize,
    /// A bit for each uploaded polygon that has moved since its upload.
    moved: Vec<u64>,
    any_moved: bool,
    /// Groups that have moved as a whole since the last [`GpuScene::flush`].
    placed: BTreeSet<SpaceId>,
    transparent: Vec<u64>,
    additive: Vec<u64>,
    /// Whether a brush has painted any polygon.
    pub(super) has_brushes: bool,
    /// Whether any polygon has normals of its own.
    pub(super) has_normals: bool,
    pub(super) is_animated: bool,
    scratch: Vec<PolygonRecord>,
    colors: Colors,
}

impl GpuScene {
    pub(super) fn new(gpu: &Gpu, chunk_len: usize, draw_len: usize) -> Self {
        Self {
            chunks: Chunks::new(gpu, chunk_len),
            draw_len: draw_len.max(1),
            indices: create_indices(gpu, FIRST_LEN.min(draw_len.max(1))),
            free_unreachable: 0,
            uploaded: 0,
            moved: Vec::new(),
            any_moved: false,
            placed: BTreeSet::new(),
            transparent: Vec::new(),
            additive: Vec::new(),
            has_brushes: false,
            has_normals: false,
            is_animated: false,
            scratch: Vec::new(),
            colors: Colors::Own,
        }
    }

    /// Sets the colours; returns whether they have changed. After a change, all polygons are sent again.
    pub(super) fn set_colors(&mut self, colors: Colors) -> bool {
        let is_other = colors != self.colors;
        if is_other {
            self.colors = colors;
            self.truncate(0);
        }
        is_other
    }

    pub(super) fn chunk_len(&self) -> usize {
        self.chunks.len
    }

    /// Number of polygons of a page. A draw call draws polygons of a single page.
    pub(super) fn page_len(&self) -> usize {
        self.chunks.len * CHUNKS_A_PAGE
    }

    pub(super) fn draw_len(&self) -> u32 {
        self.draw_len as u32
    }

    pub(super) fn draw_calls(&self, polygons: usize) -> u64 {
        polygons.div_ceil(self.draw_len) as u64
    }

    /// Binds the polygons of a page, and the indices. Returns `false` if the page does not exist.
    pub(super) fn bind(&self, pass: &mut wgpu::RenderPass<'_>, page: u32) -> bool {
        let Some(page) = self.chunks.page(page) else { return false };
        pass.set_bind_group(1, page, &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        true
    }

    /// Draws the polygons at the positions `places` of the draw list in a style. Call it after [`GpuScene::bind`].
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, places: Range<u32>, style: u32) {
        for first in places.clone().step_by(self.draw_len) {
            let count = (places.end - first).min(self.draw_len());
            pass.draw_indexed(0..count * INDICES, (first * CORNERS) as i32, style..style + 1);
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.chunks.bytes()
    }

    pub(super) fn classes_of(&self, first: usize) -> Classes {
        let of = |words: &[u64]| words.get(first / bits::WORD).copied().unwrap_or(0);
        Classes { transparent: of(&self.transparent), additive: of(&self.additive) }
    }

    /// Records polygons that have moved or whose paint has changed. [`GpuScene::flush`] finds new polygons by their
    /// numbers.
    pub(super) fn note(&mut self, changes: &[Change]) {
        for change in changes {
            match *change {
                Change::Update(id) | Change::Repaint(id) => self.note_moved(id),
                Change::Place(space) => _ = self.placed.insert(space),
                Change::Insert(_) | Change::Remove(_) => {}
            }
        }
    }

    fn note_moved(&mut self, id: PolygonId) {
        if id.index() < self.uploaded {
            bits::insert(&mut self.moved, id.index());
            self.any_moved = true;
        }
    }

    /// Drops the polygons from number `count` on. The scene then gives their numbers to other polygons.
    pub(super) fn truncate(&mut self, count: usize) {
        if count >= self.uploaded {
            return;
        }
        for i in count..self.uploaded {
            for words in [&mut self.moved, &mut self.transparent, &mut self.additive] {
                bits::remove(words, i);
            }
        }
        self.has_brushes &= count > 0;
        self.has_normals &= count > 0;
        self.is_animated &= count > 0;
        self.uploaded = count;
    }

    /// Sends polygons that are new or have moved; returns the number of bytes sent.
    pub(super) fn flush(&mut self, gpu: &Gpu, scene: &Scene) -> u64 {
        let mut bytes = 0;
        if self.free_unreachable != scene.let_go_count() {
            self.free_unreachable = scene.let_go_count();
            self.free_chunks(gpu, scene);
        }
        let placed: Vec<Change> = std::mem::take(&mut self.placed).into_iter().map(Change::Place).collect();
        scene.for_each_change(&placed, |change| {
            if let Change::Update(id) = change {
                self.note_moved(id);
            }
        });
        if self.any_moved {
            bytes += self.send_moved(gpu, scene);
        }
        let count = scene.polygon_count();
        if count > self.uploaded {
            self.grow(gpu, count);
            for i in self.uploaded..count {
                let id = PolygonId(i as u32);
                let stroke = scene.stroke_of(id);
                self.has_normals |= scene.surface(id).is_smooth();
                self.has_brushes |= stroke.brush().is_some();
                self.is_animated |= stroke.brush().is_some_and(|brush| brush.is_animated);
                match DrawClass::of(stroke) {
                    DrawClass::Solid => {}
                    DrawClass::Transparent => bits::insert(&mut self.transparent, i),
                    DrawClass::Additive => bits::insert(&mut self.additive, i),
                }
            }
            bytes += self.send(gpu, scene, self.uploaded..count);
            self.uploaded = count;
        }
        bytes
    }

    fn send_moved(&mut self, gpu: &Gpu, scene: &Scene) -> u64 {
        let mut bytes = 0;
        let mut run: Option<Range<usize>> = None;
        let mut moved = std::mem::take(&mut self.moved);
        for at in bits::iter(&moved) {
            run = match run {
                Some(run) if at - run.end <= GAP => Some(run.start..at + 1),
                Some(run) => {
                    bytes += self.send(gpu, scene, run);
                    Some(at..at + 1)
                }
                None => Some(at..at + 1),
            };
        }
        moved.fill(0);
        self.moved = moved;
        self.any_moved = false;
        bytes + run.map_or(0, |run| self.send(gpu, scene, run))
    }

    fn send(&mut self, gpu: &Gpu, scene: &Scene, range: Range<usize>) -> u64 {
        let mut at = range.start;
        let mut sent = 0;
        while at < range.end {
            let (chunk, first) = (at / self.chunk_len(), at % self.chunk_len());
            let count = (range.end - at).min(self.chunk_len() - first).min(TRANSFER);
            // If the replay jumps back, a freed chunk has polygons again.
            if self.chunks.is_free(chunk) && scene.are_freed(at..at + count) {
                at += count;
                continue;
            }
            self.scratch.clear();
            self.scratch
                .extend((at..at + count).map(|i| PolygonRecord::of(scene, PolygonId(i as u32), self.colors)));
            self.chunks.write(gpu, at, &self.scratch);
            at += count;
            sent += count as u64 * PolygonRecord::SIZE;
        }
        sent
    }

    fn free_chunks(&mut self, gpu: &Gpu, scene: &Scene) {
        let len = self.chunk_len();
        for chunk in 0..self.uploaded / len {
            if !self.chunks.is_free(chunk) && scene.are_freed(chunk * len..(chunk + 1) * len) {
                self.chunks.free(gpu, chunk);
            }
        }
    }

    fn grow(&mut self, gpu: &Gpu, count: usize) {
        let words = bits::words_for(count);
        self.moved.resize(words, 0);
        self.transparent.resize(words, 0);
        self.additive.resize(words, 0);
        self.chunks.grow(gpu, count);
        let indexed = count.next_power_of_two().max(FIRST_LEN).min(self.draw_len);
        if self.indices.size() < indices_bytes(indexed) {
            self.indices = create_indices(gpu, indexed);
        }
    }
}

fn indices_bytes(polygons: usize) -> u64 {
    polygons as u64 * u64::from(INDICES) * 4
}

/// The indices of the two triangles of each polygon: corners 0 1 2 and 0 2 3.
fn create_indices(gpu: &Gpu, polygons: usize) -> wgpu::Buffer {
    let of = |polygon: u32| [0, 1, 2, 0, 2, 3].map(|corner| polygon * CORNERS + corner);
    let indices: Vec<[u32; INDICES as usize]> = (0..polygons as u32).map(of).collect();
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("indices"),
        contents: bytemuck::cast_slice(&indices),
        usage: wgpu::BufferUsages::INDEX,
    })
}
