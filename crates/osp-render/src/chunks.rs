use super::{Gpu, descriptors, gpu::CHUNKS_A_PAGE, record::PolygonRecord, run::CLUSTER};

/// Largest number of polygons of a chunk, a multiple of [`CLUSTER`]. Such a chunk takes at most 128 MiB, the largest
/// binding that every adapter supports.
const MAX_CHUNK: usize = (128 << 20) / PolygonRecord::SIZE as usize / CLUSTER * CLUSTER;

/// Smallest capacity of the first chunk, polygons.
pub(super) const FIRST_LEN: usize = 1 << 12;

/// Polygons on the GPU, in chunks of fixed size. Growth adds chunks. The first chunk grows by copying until it has the
/// size of the others.
#[derive(Debug)]
pub(super) struct Chunks {
    /// Capacity of a chunk, polygons: a multiple of [`CLUSTER`].
    pub(super) len: usize,
    pub(super) buffers: Vec<wgpu::Buffer>,
    /// For each chunk, whether its memory is freed. The placeholder then replaces its buffer.
    is_free: Vec<bool>,
    pages: Vec<wgpu::BindGroup>,
    /// Bound in place of chunks that are freed or do not exist.
    placeholder: wgpu::Buffer,
    pub(super) layout: wgpu::BindGroupLayout,
}

impl Chunks {
    pub(super) fn new(gpu: &Gpu, len: usize) -> Self {
        let chunk = (wgpu::ShaderStages::VERTEX, descriptors::read(PolygonRecord::SIZE));
        Self {
            // The length is a multiple of a cluster, so that no cluster lies in two chunks.
            len: len.clamp(1, MAX_CHUNK).next_multiple_of(CLUSTER),
            buffers: Vec::new(),
            is_free: Vec::new(),
            pages: Vec::new(),
            placeholder: create(gpu, 1),
            layout: gpu.bind_layout("polygon chunks", &[chunk; CHUNKS_A_PAGE]),
        }
    }

    /// The bind group of a page, which consists of [`CHUNKS_A_PAGE`] consecutive chunks; `None` if the page does not
    /// exist.
    pub(super) fn page(&self, page: u32) -> Option<&wgpu::BindGroup> {
        self.pages.get(page as usize)
    }

    pub(super) fn is_free(&self, chunk: usize) -> bool {
        self.is_free[chunk]
    }

    pub(super) fn bytes(&self) -> u64 {
        let chunks = self.buffers.iter().zip(&self.is_free);
        chunks.filter(|(_, is_free)| !**is_free).map(|(chunk, _)| chunk.size()).sum()
    }

    pub(super) fn free(&mut self, gpu: &Gpu, chunk: usize) {
        self.put(gpu, chunk, self.placeholder.clone(), true);
    }

    /// Writes consecutive polygons of one chunk. A freed chunk gets memory again.
    pub(super) fn write(&mut self, gpu: &Gpu, first: usize, records: &[PolygonRecord]) {
        let (chunk, at) = (first / self.len, first % self.len);
        if self.is_free[chunk] {
            self.put(gpu, chunk, create(gpu, self.len), false);
        }
        gpu.queue.write_buffer(
            &self.buffers[chunk],
            at as u64 * PolygonRecord::SIZE,
            bytemuck::cast_slice(records),
        );
    }

    fn put(&mut self, gpu: &Gpu, chunk: usize, buffer: wgpu::Buffer, is_free: bool) {
        (self.buffers[chunk], self.is_free[chunk]) = (buffer, is_free);
        let page = chunk / CHUNKS_A_PAGE;
        self.pages[page] = self.bind_page(gpu, page);
    }

    /// Adds chunks until they hold at least `count` polygons.
    pub(super) fn grow(&mut self, gpu: &Gpu, count: usize) {
        let first_len = count.next_power_of_two().max(FIRST_LEN).min(self.len);
        self.grow_first(gpu, first_len);
        while self.buffers.len() * self.len < count {
            let polygons = if self.buffers.is_empty() { first_len } else { self.len };
            self.buffers.push(create(gpu, polygons));
            self.is_free.push(false);
            let page = (self.buffers.len() - 1) / CHUNKS_A_PAGE;
            self.pages.truncate(page);
            self.pages.push(self.bind_page(gpu, page));
        }
    }

    /// Grows the first chunk to a capacity of `polygons` polygons. It gets at most the capacity of the other chunks.
    fn grow_first(&mut self, gpu: &Gpu, polygons: usize) {
        let Some(first) = self.buffers.first() else { return };
        if self.is_free[0] || first.size() >= polygons as u64 * PolygonRecord::SIZE {
            return;
        }
        let larger = create(gpu, polygons);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(first, 0, &larger, 0, first.size());
        gpu.queue.submit([encoder.finish()]);
        self.put(gpu, 0, larger, false);
    }

    fn bind_page(&self, gpu: &Gpu, page: usize) -> wgpu::BindGroup {
        let chunks: [_; CHUNKS_A_PAGE] = std::array::from_fn(|i| {
            let chunk = self.buffers.get(page * CHUNKS_A_PAGE + i);
            chunk.unwrap_or(&self.placeholder).as_entire_binding()
        });
        gpu.bind_group("polygon page", &self.layout, &chunks)
    }
}

fn create(gpu: &Gpu, polygons: usize) -> wgpu::Buffer {
    gpu.buffer("polygon chunk", polygons as u64 * PolygonRecord::SIZE, descriptors::STORAGE)
}
