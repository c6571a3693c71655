use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{
    Gpu, descriptors,
    formats::{COLOR_FORMAT, SAMPLES},
    shaders,
};
use osp::{math::Aabb, view::View};

/// Whether surfaces of the model hide a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    Hidden,
    Through,
}

/// Red, green, blue, opacity, each from 0 to 255, sRGB.
pub type LineColor = [u8; 4];

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Vertex {
    point: [f32; 3],
    color: LineColor,
}

/// The lines and transparent faces of a frame, world space. The caller empties and fills the batch in every frame.
#[derive(Clone, Debug, Default)]
pub struct LineBatch {
    hidden: Vec<Vertex>,
    through: Vec<Vertex>,
    faces: Vec<Vertex>,
}

impl LineBatch {
    pub fn new() -> Self {
        Self::default()
    }

    pub fn clear(&mut self) {
        self.hidden.clear();
        self.through.clear();
        self.faces.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.hidden.is_empty() && self.through.is_empty() && self.faces.is_empty()
    }

    pub fn triangle_count(&self) -> usize {
        self.faces.len() / 3
    }

    pub fn line(&mut self, from: Vec3, to: Vec3, color: LineColor, depth: Depth) {
        let list = match depth {
            Depth::Hidden => &mut self.hidden,
            Depth::Through => &mut self.through,
        };
        list.extend([from, to].map(|p| Vertex { point: p.to_array(), color }));
    }

    pub fn outline(&mut self, corners: &[Vec3], color: LineColor, depth: Depth) {
        for i in 0..corners.len() {
            self.line(corners[i], corners[(i + 1) % corners.len()], color, depth);
        }
    }

    pub fn aabb(&mut self, bounds: &Aabb, color: LineColor, depth: Depth) {
        let corners = bounds.corners();
        for i in 0..8usize {
            for axis in 0..3 {
                if i >> axis & 1 == 0 {
                    self.line(corners[i], corners[i | 1 << axis], color, depth);
                }
            }
        }
    }

    /// Adds a convex face, visible from both sides, that hides nothing.
    pub fn face(&mut self, corners: &[Vec3], color: LineColor) {
        for pair in corners.windows(2).skip(1) {
            self.faces.extend([corners[0], pair[0], pair[1]].map(|p| Vertex { point: p.to_array(), color }));
        }
    }
}

const VERTEX: wgpu::BufferUsages = wgpu::BufferUsages::VERTEX.union(wgpu::BufferUsages::COPY_DST);

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Uniforms {
    clip_from_eye: [[f32; 4]; 4],
    eye_in_world: [f32; 4],
}

/// Draws a [`LineBatch`] over a view. Each view needs a pass of its own.
#[derive(Debug)]
pub struct LinePass {
    hidden: wgpu::RenderPipeline,
    through: wgpu::RenderPipeline,
    faces: wgpu::RenderPipeline,
    uniforms: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    /// Number of vertices of each of the three lists, in drawing order.
    counts: [u32; 3],
}

impl LinePass {
    pub fn new(gpu: &Gpu) -> Self {
        let module = gpu.module("line", shaders::LINE);
        let uniform = descriptors::uniform(size_of::<Uniforms>() as u64);
        let bind_layout = gpu.bind_layout("lines", &[(wgpu::ShaderStages::VERTEX, uniform)]);
        let layout = gpu.pipeline_layout("lines", &[Some(&bind_layout)]);
        let uniforms = gpu.buffer("lines' view", size_of::<Uniforms>() as u64, descriptors::UNIFORM);
        let bind_group = gpu.bind_group("lines", &bind_layout, &[uniforms.as_entire_binding()]);
        let corners = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4],
        })];
        let (blend, write_mask) = (Some(wgpu::BlendState::ALPHA_BLENDING), wgpu::ColorWrites::ALL);
        let targets = [Some(wgpu::ColorTargetState { format: COLOR_FORMAT, blend, write_mask })];
        let pipeline = |topology, compare| {
            gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("lines"),
                layout: Some(&layout),
                vertex: wgpu::VertexState { buffers: &corners, ..descriptors::vertex(&module, "vertex") },
                primitive: wgpu::PrimitiveState { topology, ..Default::default() },
                depth_stencil: Some(descriptors::depth(compare, false)),
                multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
                fragment: Some(descriptors::fragment(&module, "fragment", &targets)),
                multiview_mask: None,
                cache: None,
            })
        };
        let (lines, faces) = (wgpu::PrimitiveTopology::LineList, wgpu::PrimitiveTopology::TriangleList);
        let nearer = wgpu::CompareFunction::GreaterEqual;
        Self {
            hidden: pipeline(lines, nearer),
            through: pipeline(lines, wgpu::CompareFunction::Always),
            faces: pipeline(faces, nearer),
            uniforms,
            bind_group,
            vertices: gpu.buffer("lines", 1 << 16, VERTEX),
            counts: [0; 3],
        }
    }

    pub fn prepare(&mut self, gpu: &Gpu, view: &View, batch: &LineBatch) {
        let from_eye = View { eye_in_world: Vec3::ZERO, ..*view };
        let uniforms = Uniforms {
            clip_from_eye: from_eye.clip_from_world().to_cols_array_2d(),
            eye_in_world: view.eye_in_world.extend(1.0).to_array(),
        };
        gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&uniforms));
        let lists = [&batch.faces, &batch.hidden, &batch.through];
        self.counts = lists.map(|list| list.len() as u32);
        let bytes = lists.iter().map(|list| size_of_val(&list[..]) as u64).sum();
        gpu.grow(&mut self.vertices, bytes);
        let mut offset = 0;
        for list in lists.into_iter().filter(|list| !list.is_empty()) {
            gpu.queue.write_buffer(&self.vertices, offset, bytemuck::cast_slice(list));
            offset += size_of_val(&list[..]) as u64;
        }
    }

    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let mut first = 0;
        for (pipeline, count) in [&self.faces, &self.hidden, &self.through].into_iter().zip(self.counts) {
            if count > 0 {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &self.bind_group, &[]);
                pass.set_vertex_buffer(0, self.vertices.slice(..));
                pass.draw(first..first + count, 0..1);
            }
            first += count;
        }
    }
}
