use std::ops::Range;

use wgpu::util::DeviceExt as _;

use super::{
    Classes, Gpu, descriptors,
    gpu::CHUNKS_A_PAGE,
    record::{Colors, DrawClass, PolygonRecord},
    run::CLUSTER,
};
use osp::polygon::{Change, PolygonId, bits};
use osp_session::scene::Scene;

/// Moved polygons are sent in one transfer if at most this number of unmoved polygons lies between them. Sending 96 bytes
/// for each of these costs less than another transfer.
const GAP: usize = 16;

/// Number of polygons of one transfer (1.5 MiB). It is limited, because otherwise loading a large session would double its
/// memory for a moment.
const TRANSFER: usize = 1 << 14;

/// Largest number of polygons of a chunk, whole clusters: 128 MiB, the largest binding that every adapter supports.
const MAX_CHUNK: usize = (128 << 20) / PolygonRecord::SIZE as usize / CLUSTER * CLUSTER;

/// Number of polygons of the first chunk and of the index buffer, unless the scene has more.
const FIRST_LEN: usize = 1 << 12;

/// Number of corners of a polygon, which are its vertices.
pub(super) const CORNERS: u32 = 4;
/// Number of indices of the two triangles of a polygon.
pub(super) const INDICES: u32 = 6;

/// All polygons of a scene on the GPU, in chunks of fixed size. Growth adds chunks. The first chunk grows by copying
/// until it has the size of the others.
#[derive(Debug)]
pub(super) struct GpuScene {
    /// Number of polygons of a chunk, whole clusters.
    chunk_len: usize,
    /// Largest number of polygons of a draw call.
    draw_len: usize,
    /// Indices for as many polygons as the scene has, at most `draw_len`.
    indices: wgpu::Buffer,
    chunks: Vec<wgpu::Buffer>,
    /// For each chunk, whether the scene has released all its polygons, so that the placeholder replaces it.
    is_free: Vec<bool>,
    /// Number of polygons that the scene had released at the last [`GpuScene::flush`].
    free_unreachable: u64,
    pages: Vec<wgpu::BindGroup>,
    /// A buffer that is bound instead of chunks that do not exist.
    placeholder: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    /// Number of polygons on the GPU.
    uploaded: usize,
    /// A bit for each uploaded polygon that has moved since its upload.
    moved: Vec<u64>,
    any_moved: bool,
    /// Groups that have moved as a whole since the last [`GpuScene::flush`].
    placed: Vec<Change>,
    /// A bit for each transparent polygon.
    transparent: Vec<u64>,
    /// A bit for each additive polygon.
    additive: Vec<u64>,
    /// Whether a brush has painted any polygon.
    has_brushes: bool,
    /// Whether any brush is animated.
    is_animated: bool,
    scratch: Vec<PolygonRecord>,
    colors: Colors,
}

impl GpuScene {
    pub(super) fn new(gpu: &Gpu, chunk_len: usize, draw_len: usize) -> Self {
        let chunk = (wgpu::ShaderStages::VERTEX, descriptors::read(PolygonRecord::SIZE));
        let layout = descriptors::bind_layout(gpu.device(), "polygon chunks", &[chunk; CHUNKS_A_PAGE]);
        Self {
            // The length is a multiple of a cluster, so that no cluster lies in two chunks.
            chunk_len: chunk_len.clamp(1, MAX_CHUNK).next_multiple_of(CLUSTER),
            draw_len: draw_len.max(1),
            indices: create_indices(gpu, FIRST_LEN.min(draw_len.max(1))),
            chunks: Vec::new(),
            is_free: Vec::new(),
            free_unreachable: 0,
            pages: Vec::new(),
            placeholder: create_chunk(gpu, 1),
            layout,
            uploaded: 0,
            moved: Vec::new(),
            any_moved: false,
            placed: Vec::new(),
            transparent: Vec::new(),
            additive: Vec::new(),
            has_brushes: false,
            is_animated: false,
            scratch: Vec::new(),
            colors: Colors::Own,
        }
    }

    /// Sets the colours; returns whether they have changed. If so, all polygons are sent again.
    pub(super) fn set_colors(&mut self, colors: Colors) -> bool {
        let is_other = colors != self.colors;
        if is_other {
            self.colors = colors;
            self.truncate(0);
        }
        is_other
    }

    pub(super) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    pub(super) fn chunk_len(&self) -> usize {
        self.chunk_len
    }

    /// The chunks, in the order of the polygons' numbers.
    pub(super) fn chunks(&self) -> &[wgpu::Buffer] {
        &self.chunks
    }

    /// Number of polygons of a page. A draw call draws polygons of a single page.
    pub(super) fn page_len(&self) -> usize {
        self.chunk_len * CHUNKS_A_PAGE
    }

    /// Largest number of polygons of a draw call.
    pub(super) fn draw_len(&self) -> u32 {
        self.draw_len as u32
    }

    /// Number of draw calls for `polygons` polygons of a page.
    pub(super) fn draw_calls(&self, polygons: usize) -> u64 {
        polygons.div_ceil(self.draw_len) as u64
    }

    /// Binds the polygons of a page, and the indices. Returns `false` if the page does not exist.
    pub(super) fn bind(&self, pass: &mut wgpu::RenderPass<'_>, page: u32) -> bool {
        let Some(page) = self.pages.get(page as usize) else { return false };
        pass.set_bind_group(1, page, &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        true
    }

    /// Draws the polygons at `places` of the draw list in a style, after [`GpuScene::bind`].
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, places: Range<u32>, style: u32) {
        for first in places.clone().step_by(self.draw_len) {
            let count = (places.end - first).min(self.draw_len());
            pass.draw_indexed(0..count * INDICES, (first * CORNERS) as i32, style..style + 1);
        }
    }

    pub(super) fn uploaded(&self) -> usize {
        self.uploaded
    }

    /// Bytes reserved on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        let chunks = self.chunks.iter().zip(&self.is_free);
        chunks.filter(|(_, is_free)| !**is_free).map(|(chunk, _)| chunk.size()).sum()
    }

    /// Drawing classes of the 64 polygons from `first` on, a multiple of 64.
    pub(super) fn classes_of(&self, first: usize) -> Classes {
        let of = |words: &[u64]| words.get(first / bits::WORD).copied().unwrap_or(0);
        Classes { transparent: of(&self.transparent), additive: of(&self.additive) }
    }

    /// Whether an animated brush has painted any polygon.
    pub(super) fn is_animated(&self) -> bool {
        self.is_animated
    }

    /// Whether a brush has painted any polygon.
    pub(super) fn has_brushes(&self) -> bool {
        self.has_brushes
    }

    /// Records polygons that have moved or whose paint has changed. [`GpuScene::flush`] finds new polygons by their
    /// numbers.
    pub(super) fn note(&mut self, changes: &[Change]) {
        for change in changes {
            match *change {
                Change::Update(id) | Change::Repaint(id) => self.note_moved(id),
                Change::Place(_) => self.placed.push(*change),
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

    /// Drops the polygons from number `count` on, because the scene assigns their numbers again.
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
        let mut placed = std::mem::take(&mut self.placed);
        scene.for_each_change(&placed, |change| {
            if let Change::Update(id) = change {
                self.note_moved(id);
            }
        });
        placed.clear();
        self.placed = placed;
        if self.any_moved {
            bytes += self.send_moved(gpu, scene);
        }
        let count = scene.polygon_count();
        if count > self.uploaded {
            self.grow(gpu, count);
            for i in self.uploaded..count {
                let stroke = scene.stroke_of(PolygonId(i as u32));
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

    /// Sends a range of polygons, cut at the ends of chunks.
    fn send(&mut self, gpu: &Gpu, scene: &Scene, range: Range<usize>) -> u64 {
        let mut at = range.start;
        let mut sent = 0;
        while at < range.end {
            let (chunk, first) = (at / self.chunk_len, at % self.chunk_len);
            let count = (range.end - at).min(self.chunk_len - first).min(TRANSFER);
            if self.is_free[chunk] {
                if scene.are_freed(at..at + count) {
                    at += count;
                    continue;
                }
                // The replay went back to a time when the chunk had polygons.
                let buffer = create_chunk(gpu, self.chunk_len);
                self.put_chunk(gpu, chunk, buffer, false);
            }
            self.scratch.clear();
            self.scratch
                .extend((at..at + count).map(|i| PolygonRecord::of(scene, PolygonId(i as u32), self.colors)));
            let offset = first as u64 * PolygonRecord::SIZE;
            gpu.queue().write_buffer(&self.chunks[chunk], offset, bytemuck::cast_slice(&self.scratch));
            at += count;
            sent += count as u64 * PolygonRecord::SIZE;
        }
        sent
    }

    /// Frees the memory of chunks all of whose polygons the scene has released.
    fn free_chunks(&mut self, gpu: &Gpu, scene: &Scene) {
        for chunk in 0..self.uploaded / self.chunk_len {
            let polygons = chunk * self.chunk_len..(chunk + 1) * self.chunk_len;
            if !self.is_free[chunk] && scene.are_freed(polygons) {
                self.put_chunk(gpu, chunk, self.placeholder.clone(), true);
            }
        }
    }

    fn put_chunk(&mut self, gpu: &Gpu, chunk: usize, buffer: wgpu::Buffer, is_free: bool) {
        (self.chunks[chunk], self.is_free[chunk]) = (buffer, is_free);
        let page = chunk / CHUNKS_A_PAGE;
        self.pages[page] = self.bind_page(gpu, page);
    }

    /// Makes room for `count` polygons.
    fn grow(&mut self, gpu: &Gpu, count: usize) {
        let words = bits::words_for(count);
        self.moved.resize(words, 0);
        self.transparent.resize(words, 0);
        self.additive.resize(words, 0);
        let first_len = count.next_power_of_two().max(FIRST_LEN).min(self.chunk_len);
        self.grow_first_chunk(gpu, first_len);
        while self.chunks.len() * self.chunk_len < count {
            let polygons = if self.chunks.is_empty() { first_len } else { self.chunk_len };
            self.chunks.push(create_chunk(gpu, polygons));
            self.is_free.push(false);
            let page = (self.chunks.len() - 1) / CHUNKS_A_PAGE;
            self.pages.truncate(page);
            self.pages.push(self.bind_page(gpu, page));
        }
        let indexed = count.next_power_of_two().max(FIRST_LEN).min(self.draw_len);
        if self.indices.size() < indices_bytes(indexed) {
            self.indices = create_indices(gpu, indexed);
        }
    }

    /// Grows the first chunk to `polygons` polygons, at most `chunk_len`.
    fn grow_first_chunk(&mut self, gpu: &Gpu, polygons: usize) {
        let Some(first) = self.chunks.first() else { return };
        if self.is_free[0] || first.size() >= polygons as u64 * PolygonRecord::SIZE {
            return;
        }
        let larger = create_chunk(gpu, polygons);
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(first, 0, &larger, 0, first.size());
        gpu.queue().submit([encoder.finish()]);
        self.put_chunk(gpu, 0, larger, false);
    }

    fn bind_page(&self, gpu: &Gpu, page: usize) -> wgpu::BindGroup {
        let chunks: [_; CHUNKS_A_PAGE] = std::array::from_fn(|i| {
            let chunk = self.chunks.get(page * CHUNKS_A_PAGE + i);
            chunk.unwrap_or(&self.placeholder).as_entire_binding()
        });
        descriptors::bind_group(gpu.device(), "polygon page", &self.layout, &chunks)
    }
}

fn indices_bytes(polygons: usize) -> u64 {
    polygons as u64 * u64::from(INDICES) * 4
}

/// The indices of the two triangles of each polygon: corners 0 1 2 and 0 2 3.
fn create_indices(gpu: &Gpu, polygons: usize) -> wgpu::Buffer {
    let of = |polygon: u32| [0, 1, 2, 0, 2, 3].map(|corner| polygon * CORNERS + corner);
    let indices: Vec<[u32; INDICES as usize]> = (0..polygons as u32).map(of).collect();
    gpu.device().create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("indices"),
        contents: bytemuck::cast_slice(&indices),
        usage: wgpu::BufferUsages::INDEX,
    })
}

fn create_chunk(gpu: &Gpu, polygons: usize) -> wgpu::Buffer {
    descriptors::buffer(
        gpu.device(),
        "polygon chunk",
        polygons as u64 * PolygonRecord::SIZE,
        wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
    )
}
