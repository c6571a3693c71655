use std::ops::Range;

use super::{
    DrawnCounts,
    jump::LastLook,
    pyramid::{Levels, MAX_LEVELS},
    queries::Queries,
    span::{COUNTERS, LANES, PARAMS_BYTES, SPAN_STRIDE, Span, counts},
};
use crate::{
    DrawOrder, Gpu, GpuOcclusion,
    descriptors::{STORAGE, UNIFORM},
    gpu_scene::{CORNERS, GpuScene},
    read_ring::ReadRing,
    run::{CLUSTER, Handle},
};
use osp::view::View;
use osp_session::scene::Scene;

#[derive(Debug)]
pub(in super::super) struct HzbView {
    /// Whether bounds are too far away. A test must detect it.
    pub(super) is_wrong: bool,
    /// Hardware queries; if present, they replace the pyramid.
    pub(super) queries: Option<Queries>,
    pub(super) buffers: Buffers,
    pub(super) groups: Option<Groups>,
    /// The cluster masks of the frame: `buffers.handles`, or those of the other eye.
    pub(super) handles: wgpu::Buffer,
    /// Whether `buffers.spans` has the levels of the pyramid.
    has_levels: bool,
    pub(super) last: LastLook,
    /// Whether the last prepared frame was drawn.
    pub(super) is_encoded: bool,
    /// Whether the view has jumped. The frame then draws all polygons in view, and tests them afterwards.
    pub(super) has_jumped: bool,
    kept_masks: Vec<[u32; 2]>,
    /// A zero for each item of `chunks`, which resets its candidate counter.
    no_candidates: Vec<u32>,
    /// Size of the picture for which `levels` was computed, pixels.
    pub(super) size: (u32, u32),
    pub(super) levels: Levels,
    /// A dispatch for each page of opaque polygons.
    pub(super) pages: Vec<Span>,
    /// A dispatch for the opaque polygons of each chunk. `base` is the chunk's number.
    pub(super) chunks: Vec<Span>,
    /// A dispatch over all transparent polygons for each chunk that has transparent polygons. `base` is the chunk's
    /// number.
    pub(super) transparent: Vec<Span>,
    /// Offsets of `pages`, `chunks` and `transparent` in the buffer of spans, bytes.
    pub(super) first_span: [u32; 3],
    span_bytes: Vec<u8>,
    args_words: Vec<u32>,
    pub(super) ring: ReadRing,
    known: [(DrawnCounts, u64); super::super::read_ring::SLOTS],
    pub(super) frame: (DrawnCounts, u64),
}

#[derive(Debug)]
pub(super) struct Buffers {
    pub(super) spans: wgpu::Buffer,
    pub(super) params: wgpu::Buffer,
    pub(super) handles: wgpu::Buffer,
    pub(super) kept: wgpu::Buffer,
    /// First a counter for each dispatch of `HzbView::chunks`, then one list of candidates, which these dispatches use
    /// in turn. Candidates are the polygons that the coarse test has not proven hidden.
    pub(super) candidates: wgpu::Buffer,
    /// For each cluster of the scene, a mask of its polygons that were visible in the last frame.
    pub(super) remembered: wgpu::Buffer,
    pub(super) recalled: wgpu::Buffer,
    pub(super) sums: wgpu::Buffer,
    pub(super) args: wgpu::Buffer,
    pub(super) pyramid: wgpu::Buffer,
}

#[derive(Debug)]
pub(super) struct Groups {
    pub(super) recall: wgpu::BindGroup,
    pub(super) pyramid: wgpu::BindGroup,
    pub(super) test: wgpu::BindGroup,
    pub(super) transparent: wgpu::BindGroup,
    pub(super) compact: wgpu::BindGroup,
    /// Bind group of the vertex shader with the recalled polygons as the draw list.
    pub(super) draw_recalled: wgpu::BindGroup,
    pub(super) handles: wgpu::Buffer,
    pub(super) list: wgpu::Buffer,
    pub(super) depth: wgpu::TextureView,
}

/// Size of the levels of the pyramid in the buffer of spans.
const LEVEL_BYTES: u64 = MAX_LEVELS as u64 * SPAN_STRIDE as u64;
impl HzbView {
    pub(in super::super) fn new(gpu: &Gpu) -> Self {
        let buffers = Buffers {
            spans: gpu.buffer("work", u64::from(SPAN_STRIDE) * 64, UNIFORM),
            params: gpu.buffer("depth pyramid's levels", PARAMS_BYTES, UNIFORM),
            handles: gpu.buffer("handles", 1 << 12, STORAGE),
            kept: gpu.buffer("kept polygons", 1 << 12, STORAGE),
            candidates: gpu.buffer("candidates", 1 << 12, STORAGE),
            remembered: gpu.buffer("remembered polygons", 1 << 12, STORAGE),
            recalled: gpu.buffer("recalled polygons", 1 << 12, STORAGE),
            sums: gpu.buffer("sums", 1 << 10, STORAGE),
            args: gpu.buffer("draw calls", 1 << 8, STORAGE | wgpu::BufferUsages::INDIRECT),
            pyramid: gpu.buffer("depth pyramid", 4, STORAGE),
        };
        let ring = ReadRing::new(gpu, buffers.args.size());
        Self {
            is_wrong: false,
            queries: None,
            handles: buffers.handles.clone(),
            has_levels: false,
            buffers,
            groups: None,
            last: LastLook::default(),
            is_encoded: false,
            has_jumped: false,
            kept_masks: Vec::new(),
            no_candidates: Vec::new(),
            size: (0, 0),
            levels: Levels::of(1, 1),
            pages: Vec::new(),
            chunks: Vec::new(),
            transparent: Vec::new(),
            first_span: [0; 3],
            span_bytes: Vec::new(),
            args_words: Vec::new(),
            ring,
            known: Default::default(),
            frame: Default::default(),
        }
    }

    pub(in super::super) fn occlusion(&self) -> GpuOcclusion {
        if self.queries.is_some() { GpuOcclusion::Queries } else { GpuOcclusion::Hzb }
    }

    /// Selects culling by a depth pyramid. The record of the last frame stays.
    pub(in super::super) fn use_pyramid(&mut self) {
        self.queries = None;
        self.size = (0, 0);
    }

    #[cfg(test)]
    pub(crate) fn use_wrong_bounds(&mut self) {
        self.is_wrong = true;
    }

    /// Selects culling by hardware queries. The record of the last frame stays.
    pub(in super::super) fn use_queries(&mut self, gpu: &Gpu) {
        self.queries.get_or_insert_with(|| Queries::new(gpu));
    }

    /// Sends the inputs of the frame's shaders, except those that depend on the picture's size; returns the number of bytes
    /// sent. `other` is the other eye's prepared view and order, if they have the opaque polygons of both eyes.
    pub(in super::super) fn prepare(
        &mut self,
        gpu: &Gpu,
        own: &DrawOrder,
        other: Option<(&Self, &DrawOrder)>,
        on_gpu: &GpuScene,
        (scene, view): (&Scene, &View),
    ) -> u64 {
        let order = other.map_or(own, |(_, order)| order);
        let opaque = order.opaque_count();
        let light = if other.is_some() { order.light() } else { &[] };
        let transparent = opaque..opaque + (light.len() + own.ids().len()) as u32;
        let polygon_count = scene.polygon_count();
        self.lay_out(order, [light, own.ids()], on_gpu.chunk_len() as u32, on_gpu.draw_len());
        let handles = &order.handles[..];
        let sums = self.pages.last().map_or(0, |span| span.first_sum + span.len().div_ceil(LANES));
        let of_chunk = self.chunks.iter().map(|span| u64::from(span.len()) * CLUSTER as u64).max();
        let candidate_words = self.chunks.len() as u64 + of_chunk.unwrap_or(0);
        let buffers = &mut self.buffers;
        let forgets = gpu.grow(&mut buffers.remembered, polygon_count.div_ceil(CLUSTER) as u64 * 8);
        let own_handles = if other.is_some() { &[] } else { handles };
        self.has_levels &= !gpu.grow(&mut buffers.spans, LEVEL_BYTES + self.span_bytes.len() as u64);
        let has_grown = gpu.grow(&mut buffers.handles, size_of_val(own_handles) as u64);
        self.handles = other.map_or(&buffers.handles, |(other, _)| &other.handles).clone();
        let is_new = [
            !self.has_levels,
            has_grown,
            gpu.grow(&mut buffers.kept, handles.len() as u64 * 8),
            gpu.grow(&mut buffers.candidates, candidate_words * 4),
            forgets,
            gpu.grow(&mut buffers.recalled, u64::from(transparent.start) * 4),
            gpu.grow(&mut buffers.sums, u64::from(sums) * 4),
            gpu.grow(&mut buffers.args, self.args_words.len() as u64 * 4),
        ];
        if is_new.contains(&true) {
            self.groups = None;
            self.queries.iter_mut().for_each(Queries::forget_groups);
        }
        if self.ring.capacity() < self.buffers.args.size() {
            self.ring = ReadRing::new(gpu, self.buffers.args.size());
        }
        if !std::mem::take(&mut self.is_encoded) {
            // A frame that was prepared but not drawn has found no visible polygons.
            self.last = LastLook::default();
        }
        let has_jumped =
            self.last.jumps_to(view.eye_in_world, (handles, opaque), scene) || forgets && !handles.is_empty();
        // Queries store a frame number for each group, so they need no special frame after a jump.
        self.has_jumped = has_jumped && self.queries.is_none();
        self.kept_masks.clear();
        if self.has_jumped {
            self.kept_masks.extend(handles.iter().map(|handle| handle.mask));
        }
        self.no_candidates.resize(self.chunks.len(), 0);
        let mut sent = 0;
        let mut send = |buffer: &wgpu::Buffer, offset: u64, bytes: &[u8]| {
            if !bytes.is_empty() {
                gpu.queue.write_buffer(buffer, offset, bytes);
                sent += bytes.len() as u64;
            }
        };
        if !std::mem::replace(&mut self.has_levels, true) {
            send(&self.buffers.spans, 0, &levels());
        }
        send(&self.buffers.spans, LEVEL_BYTES, &self.span_bytes);
        send(&self.buffers.handles, 0, bytemuck::cast_slice(own_handles));
        send(&self.buffers.kept, 0, bytemuck::cast_slice(&self.kept_masks));
        send(&self.buffers.args, 0, bytemuck::cast_slice(&self.args_words));
        send(&self.buffers.candidates, 0, bytemuck::cast_slice(&self.no_candidates));
        let in_view = u64::from(transparent.end);
        let groups_tested = match &mut self.queries {
            Some(queries) => {
                sent += queries.prepare(gpu, order, scene, view);
                queries.count()
            }
            None => u64::from(opaque) + if self.has_jumped { 0 } else { transparent.len() as u64 },
        };
        let counts = DrawnCounts { groups_tested, in_view, ..DrawnCounts::default() };
        self.frame = (counts, transparent.len() as u64);
        sent
    }

    /// Divides the frame's work into dispatches. `ids` are the additive and transparent polygons of the view.
    fn lay_out(&mut self, order: &DrawOrder, ids: [&[u32]; 2], chunk_len: u32, draw_len: u32) {
        let handles = &order.handles;
        self.pages.clear();
        self.chunks.clear();
        self.transparent.clear();
        self.args_words.clear();
        self.args_words.resize(COUNTERS as usize, 0);
        let (mut base, mut first_sum) = (0, 0);
        for run in &order.handle_runs {
            let Range { start: first, end } = run.range;
            let args = self.args_words.len() as u32;
            let draws = run.polygons.div_ceil(draw_len);
            self.pages.push(Span { first, end, first_sum, base, args, draws, draw_len, first_polygon: 0 });
            // Each page begins with its number of recalled polygons; then come draw calls for depth, then for colours.
            self.args_words.push(0);
            for draw in (0..draws).chain(0..draws) {
                let first_vertex = (base + draw * draw_len) * CORNERS;
                // A draw call consists of the numbers of indices and instances, the first index, the first vertex and the
                // first instance.
                self.args_words.extend([0, 1, 0, first_vertex, 0]);
            }
            first_sum += (end - first).div_ceil(LANES);
            base += run.polygons;
            let mut at = first;
            while at < end {
                let chunk = handles[at as usize].cluster * CLUSTER as u32 / chunk_len;
                let is_in_chunk = |handle: &Handle| handle.cluster * CLUSTER as u32 / chunk_len == chunk;
                let count = handles[at as usize..end as usize].partition_point(is_in_chunk) as u32;
                let span = Span { first: at, end: at + count, base: chunk, ..Span::default() };
                self.chunks.push(Span { first_polygon: chunk * chunk_len, ..span });
                at += count;
            }
        }
        let chunks = self.chunks.len() as u32;
        for (number, span) in (0..).zip(&mut self.chunks) {
            (span.args, span.first_sum) = (number, chunks);
        }
        let end = base + ids.map(|ids| ids.len() as u32).iter().sum::<u32>();
        for &id in ids.into_iter().flatten() {
            let chunk = id / chunk_len;
            if !self.transparent.iter().any(|span| span.base == chunk) {
                let span = Span { first: base, end, ..Span::default() };
                self.transparent.push(Span { base: chunk, first_polygon: chunk * chunk_len, ..span });
            }
        }
        self.span_bytes.clear();
        for (first, spans) in self.first_span.iter_mut().zip([&self.pages, &self.chunks, &self.transparent]) {
            *first = LEVEL_BYTES as u32 + self.span_bytes.len() as u32;
            spans.iter().for_each(|span| push_span(&mut self.span_bytes, span));
        }
    }

    /// Reserves a slot for the frame's results. Call it before the results are copied.
    pub(super) fn begin_results(&mut self) {
        if let Some(slot) = self.ring.begin() {
            self.known[slot] = self.frame;
        }
    }

    pub(super) fn result_bytes(&self) -> u64 {
        self.args_words.len() as u64 * 4
    }

    /// Begins the transfer of the results. Call it after submission.
    pub(in super::super) fn submitted(&mut self) {
        self.ring.submitted();
        self.queries.iter_mut().for_each(Queries::submitted);
    }

    /// Counts of the latest frame whose results became available since the last call.
    pub(in super::super) fn take_counts(&mut self) -> Option<DrawnCounts> {
        let (mut latest, known) = (None, &self.known);
        self.ring.take(|slot, bytes| {
            let (frame, transparent) = known[slot];
            latest = Some(counts(bytes, frame, transparent));
        });
        latest
    }
}

/// The levels of the pyramid. They come before the spans of a frame, because they are the same in every frame.
fn levels() -> Vec<u8> {
    let mut bytes = Vec::new();
    (0..MAX_LEVELS as u32).for_each(|level| push_span(&mut bytes, &Span { first: level, ..Span::default() }));
    bytes
}

fn push_span(bytes: &mut Vec<u8>, span: &Span) {
    let end = bytes.len() + SPAN_STRIDE as usize;
    bytes.extend_from_slice(bytemuck::bytes_of(span));
    bytes.resize(end, 0);
}
