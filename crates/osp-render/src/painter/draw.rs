use std::ops::Range;

use wgpu::util::DeviceExt as _;

use super::{PaintList, list::PartCorner};
use crate::{
    Gpu, descriptors,
    formats::{COLOR_FORMAT, SAMPLES},
    gpu_scene::GpuScene,
    shaders,
};

/// Draws parts of polygons in the order of their list, each over the parts before it.
#[derive(Debug)]
pub(crate) struct PartPass {
    pipeline: wgpu::RenderPipeline,
}

impl PartPass {
    pub(crate) fn new(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout, scene: &GpuScene) -> Self {
        let module = gpu.module("painter", shaders::PAINTER);
        let layout = gpu.pipeline_layout("painter", &[Some(view_layout), Some(&scene.chunks.layout)]);
        let constants = [("CHUNK_LEN", scene.chunk_len() as f64)];
        let corners = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<PartCorner>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32],
        })];
        let vertex = wgpu::VertexState { buffers: &corners, ..descriptors::vertex(&module, "vertex_part") };
        let pipeline = gpu.render_pipeline(
            "painter",
            Some(&layout),
            descriptors::with_chunk_len(vertex, &constants),
            // The pass has a depth buffer, but neither tests nor writes it.
            Some(descriptors::depth(wgpu::CompareFunction::Always, false)),
            SAMPLES,
            Some(descriptors::fragment(&module, "fragment", &[Some(COLOR_FORMAT.into())])),
        );
        Self { pipeline }
    }

    /// Draws a list; returns the number of draw calls. The caller has bound group 0.
    pub(crate) fn draw(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        scene: &GpuScene,
        list: &PaintList,
    ) -> u64 {
        if list.corners.is_empty() {
            return 0;
        }
        let buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("parts"),
            contents: bytemuck::cast_slice(&list.corners),
            usage: wgpu::BufferUsages::VERTEX,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_vertex_buffer(0, buffer.slice(..));
        let mut calls = 0;
        for (page, range) in runs(&list.corners, scene.page_len()) {
            if scene.bind(pass, page) {
                pass.draw(range, 0..1);
                calls += 1;
            }
        }
        calls
    }
}

/// Divides the corners into ranges whose polygons belong to one page. Yields each page with its range.
fn runs(corners: &[PartCorner], page_len: usize) -> impl Iterator<Item = (u32, Range<u32>)> {
    let page = move |corner: &PartCorner| corner.polygon as usize / page_len;
    let mut at = 0;
    corners.chunk_by(move |a, b| page(a) == page(b)).map(move |run| {
        let first = at;
        at += run.len() as u32;
        (page(&run[0]) as u32, first..at)
    })
}
