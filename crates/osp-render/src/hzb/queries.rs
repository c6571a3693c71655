//! An alternative to the depth pyramid: Jiří Bittner, Michael Wimmer, Harald Piringer, Werner Purgathofer, "Coherent
//! Hierarchical Culling: Hardware Occlusion Queries Made Useful", 2004.
//!
//! A group is a cluster of 64 consecutive polygons. A query tests the bounding box of a group against the depth of the
//! polygons that were visible in the last frame. A group that was visible is drawn without a query, and queried again
//! some frames later. A group that was hidden is queried in every frame.
//!
//! Differences from the paper: groups are polygons with neighbouring numbers, without a hierarchy. The GPU applies the
//! results to the same frame. The CPU receives the results later, and uses them only to select the next queries. As in
//! [`hzb`](super), depth comes first and colours follow in one pass in order, so that the picture is the same to the
//! last bit.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{
    frame::Frame,
    span::{self, LANES, with_offsets},
};
use crate::{
    DrawOrder, Gpu,
    descriptors::{self, STORAGE, UNIFORM, depth_pass, read, uniform, written},
    formats::SAMPLES,
    read_ring::{ReadRing, SLOTS},
    run::{CLUSTER, Handle},
    shaders,
};
use osp::{math::Aabb, view::View};
use osp_session::scene::Scene;

/// Number of queries of a query set, which every adapter must support.
const SET: u32 = 4096;
/// Largest number of queries of a frame; further groups are drawn without a query.
const MOST: usize = 1 << 16;
/// Longest interval between queries of a visible group, frames. The interval starts at one frame and doubles while the
/// group stays visible.
const PATIENCE: u64 = 8;
const NOTHING: u32 = u32::MAX;

#[derive(Debug)]
pub(super) struct QueryPipelines {
    boxes_layout: wgpu::BindGroupLayout,
    apply_layout: wgpu::BindGroupLayout,
    boxes: wgpu::RenderPipeline,
    apply: wgpu::ComputePipeline,
}

impl QueryPipelines {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let bindings = [uniform(0), uniform(0), read(0)].map(|ty| (wgpu::ShaderStages::VERTEX, ty));
        let boxes_layout = gpu.bind_layout("boxes", &bindings);
        let module = gpu.module("boxes", shaders::QUERY_BOX);
        let layout = gpu.pipeline_layout("boxes", &[Some(&boxes_layout)]);
        let vertex = descriptors::vertex(&module, "vertex");
        let depth = Some(descriptors::depth(wgpu::CompareFunction::GreaterEqual, false));
        let boxes = gpu.render_pipeline("boxes", Some(&layout), vertex, depth, SAMPLES, None);
        let (read, write) = (read(0), written());
        let types = [span::binding(), read, read, read, write, write];
        let apply_layout = gpu.compute_layout("queries", &types);
        let apply = gpu.compute_pipeline(shaders::QUERY_APPLY, &[Some(&apply_layout)], "apply");
        Self { boxes_layout, apply_layout, boxes, apply }
    }
}

#[derive(Debug)]
pub(super) struct Queries {
    pixel: wgpu::Buffer,
    boxes: wgpu::Buffer,
    of_handle: wgpu::Buffer,
    results: wgpu::Buffer,
    sets: Vec<wgpu::QuerySet>,
    groups: Option<(wgpu::BindGroup, wgpu::BindGroup)>,
    /// Width and height of the view frustum at distance 1 along the direction of view.
    extent: [f32; 2],
    frame: u64,
    /// For each group, the frame of its next query, and the interval between its last and its next query, frames.
    due: Vec<(u64, u64)>,
    box_words: Vec<[[f32; 4]; 2]>,
    of_handle_words: Vec<u32>,
    asked: Vec<u32>,
    /// For each slot of `ring`, the groups of the queries whose results are not available yet.
    waiting: [Vec<u32>; SLOTS],
    ring: ReadRing,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Pixel {
    size: [f32; 2],
    /// The longer side of the picture, pixels.
    side: f32,
    nothing: f32,
}

impl Queries {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let bytes = u64::from(SET) * 8;
        Self {
            pixel: gpu.buffer("pixel", size_of::<Pixel>() as u64, UNIFORM),
            boxes: gpu.buffer("boxes", 1 << 12, STORAGE),
            of_handle: gpu.buffer("queries of handles", 1 << 12, STORAGE),
            results: gpu.buffer("samples counted", bytes, STORAGE | wgpu::BufferUsages::QUERY_RESOLVE),
            sets: Vec::new(),
            groups: None,
            extent: [1.0; 2],
            frame: 0,
            due: Vec::new(),
            box_words: Vec::new(),
            of_handle_words: Vec::new(),
            asked: Vec::new(),
            waiting: Default::default(),
            ring: ReadRing::new(gpu, bytes),
        }
    }

    pub(super) fn count(&self) -> u64 {
        self.asked.len() as u64
    }

    /// Drops the bind groups after buffers of the view were replaced.
    pub(super) fn forget_groups(&mut self) {
        self.groups = None;
    }

    /// Selects the groups to query and sends their boxes; returns the number of bytes sent.
    pub(super) fn prepare(&mut self, gpu: &Gpu, order: &DrawOrder, scene: &Scene, view: &View) -> u64 {
        self.learn();
        self.frame += 1;
        let projection = view.projection;
        self.extent = [projection.right - projection.left, projection.top - projection.bottom];
        self.box_words.clear();
        self.of_handle_words.clear();
        self.asked.clear();
        self.due.resize(scene.polygon_count().div_ceil(CLUSTER).max(self.due.len()), (0, 0));
        for handle in &order.handles {
            let group = handle.cluster;
            let is_asked = self.due[group as usize].0 <= self.frame && self.asked.len() < MOST;
            let query = if is_asked { self.asked.len() as u32 } else { NOTHING };
            self.of_handle_words.push(query);
            if is_asked {
                let bounds = bounds_of(handle, scene);
                self.box_words.push([bounds.min.extend(0.0).to_array(), bounds.max.extend(0.0).to_array()]);
                self.asked.push(group);
            }
        }
        let results = u64::from(self.sets_needed() * SET) * 8;
        let is_new = [
            gpu.grow(&mut self.boxes, size_of_val(&self.box_words[..]) as u64),
            gpu.grow(&mut self.of_handle, size_of_val(&self.of_handle_words[..]) as u64),
            gpu.grow(&mut self.results, results),
        ];
        if is_new.contains(&true) {
            self.groups = None;
        }
        if self.ring.capacity() < self.results.size() {
            self.ring = ReadRing::new(gpu, self.results.size());
        }
        while self.sets.len() < self.sets_needed() as usize {
            self.sets.push(gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("samples counted"),
                ty: wgpu::QueryType::Occlusion,
                count: SET,
            }));
        }
        let mut sent = 0;
        let boxes: &[u8] = bytemuck::cast_slice(&self.box_words);
        for (buffer, bytes) in
            [(&self.boxes, boxes), (&self.of_handle, bytemuck::cast_slice(&self.of_handle_words))]
        {
            if !bytes.is_empty() {
                gpu.queue.write_buffer(buffer, 0, bytes);
                sent += bytes.len() as u64;
            }
        }
        sent
    }

    fn sets_needed(&self) -> u32 {
        (self.asked.len() as u32).div_ceil(SET)
    }

    /// Reads the available results, and sets the frame of the next query of each group.
    fn learn(&mut self) {
        let (due, waiting, frame) = (&mut self.due, &self.waiting, self.frame);
        self.ring.take(|slot, bytes| {
            for (group, samples) in waiting[slot].iter().zip(bytes.chunks_exact(8)) {
                let is_visible = samples.iter().any(|byte| *byte != 0);
                if let Some((due, wait)) = due.get_mut(*group as usize) {
                    *wait = if is_visible { (*wait * 2).clamp(1, PATIENCE) } else { 0 };
                    *due = frame + *wait;
                }
            }
        });
    }

    pub(super) fn submitted(&mut self) {
        self.ring.submitted();
    }

    /// Encodes the queries, and the compute pass that removes the groups without visible samples.
    pub(super) fn encode(
        &mut self,
        frame: &Frame<'_>,
        view: &HzbViewParts<'_>,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let pipelines = &frame.hzb.queries;
        let (width, height) = frame.target.size();
        let size = [self.extent[0] / width as f32, self.extent[1] / height as f32];
        let pixel = Pixel { size, side: width.max(height) as f32, nothing: 0.0 };
        frame.gpu.queue.write_buffer(&self.pixel, 0, bytemuck::bytes_of(&pixel));
        let whole = wgpu::Buffer::as_entire_binding;
        let (boxes, apply) = self.groups.get_or_insert_with(|| {
            let boxes = [whole(frame.uniforms), whole(&self.pixel), whole(&self.boxes)];
            let apply = [
                view.span.clone(),
                whole(view.handles),
                whole(&self.of_handle),
                whole(&self.results),
                whole(view.remembered),
                whole(view.kept),
            ];
            (
                frame.gpu.bind_group("boxes", &pipelines.boxes_layout, &boxes),
                frame.gpu.bind_group("queries", &pipelines.apply_layout, &apply),
            )
        });
        let count = self.asked.len() as u32;
        for (set, first) in self.sets.iter().zip((0..count).step_by(SET as usize)) {
            let of_set = (count - first).min(SET);
            // The pass tests against the stored depth, and changes no texture.
            let (depth, load) = (&frame.target.depth, wgpu::LoadOp::Load);
            let mut pass = depth_pass(encoder, "occlusion queries", depth, load, None, Some(set));
            pass.set_pipeline(&pipelines.boxes);
            pass.set_bind_group(0, &*boxes, &[]);
            for i in 0..of_set {
                pass.begin_occlusion_query(i);
                pass.draw(0..36, first + i..first + i + 1);
                pass.end_occlusion_query();
            }
            drop(pass);
            encoder.resolve_query_set(set, 0..of_set, &self.results, u64::from(first) * 8);
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipelines.apply);
        for (span, offset) in with_offsets(view.pages, view.first_page) {
            pass.set_bind_group(0, &*apply, &[offset]);
            pass.dispatch_workgroups(span.len().div_ceil(LANES), 1, 1);
        }
        drop(pass);
        if count > 0
            && let Some(slot) = self.ring.begin()
        {
            std::mem::swap(&mut self.waiting[slot], &mut self.asked);
            self.ring.copy(encoder, &self.results, 0, u64::from(count) * 8);
        }
    }
}

pub(super) struct HzbViewParts<'a> {
    pub(super) span: wgpu::BindingResource<'a>,
    pub(super) handles: &'a wgpu::Buffer,
    pub(super) remembered: &'a wgpu::Buffer,
    pub(super) kept: &'a wgpu::Buffer,
    pub(super) pages: &'a [span::Span],
    pub(super) first_page: u32,
}

fn bounds_of(handle: &Handle, scene: &Scene) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for id in handle.ids() {
        let of_polygon = scene.bounds(id);
        // The box is NaN if a polygon's box is not finite, because a union would ignore it.
        if !(of_polygon.min.is_finite() && of_polygon.max.is_finite()) {
            return Aabb { min: Vec3::NAN, max: Vec3::NAN };
        }
        bounds = bounds.union(&of_polygon);
    }
    bounds
}
