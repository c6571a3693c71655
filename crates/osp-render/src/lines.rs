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
    /// Nearer surfaces hide the line.
    Hidden,
    /// The line is drawn over all surfaces.
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

    /// Removes all lines and faces; keeps the memory.
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

    /// Adds a closed line around these corners.
    pub fn outline(&mut self, corners: &[Vec3], color: LineColor, depth: Depth) {
        for i in 0..corners.len() {
            self.line(corners[i], corners[(i + 1) % corners.len()], color, depth);
        }
    }

    /// Adds the twelve edges of a box.
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
    /// A pass with nothing to draw.
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let module = descriptors::module(device, "line", shaders::LINE);
        let uniform = descriptors::uniform(size_of::<Uniforms>() as u64);
        let bind_layout = descriptors::bind_layout(device, "lines", &[(wgpu::ShaderStages::VERTEX, uniform)]);
        let layout = descriptors::pipeline_layout(device, "lines", &[Some(&bind_layout)]);
        let uniforms = descriptors::buffer(
            device,
            "lines' view",
            size_of::<Uniforms>() as u64,
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let bind_group =
            descriptors::bind_group(device, "lines", &bind_layout, &[uniforms.as_entire_binding()]);
        let pipeline = |topology, depth| create_pipeline(device, &module, &layout, topology, depth);
        Self {
            hidden: pipeline(wgpu::PrimitiveTopology::LineList, Depth::Hidden),
            through: pipeline(wgpu::PrimitiveTopology::LineList, Depth::Through),
            faces: pipeline(wgpu::PrimitiveTopology::TriangleList, Depth::Hidden),
            uniforms,
            bind_group,
            vertices: create_vertices(gpu, 1 << 12),
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
        let total: usize = lists.iter().map(|list| list.len()).sum();
        let bytes = (total * size_of::<Vertex>()) as u64;
        if bytes > self.vertices.size() {
            self.vertices = create_vertices(gpu, total.next_power_of_two());
        }
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

fn create_vertices(gpu: &Gpu, count: usize) -> wgpu::Buffer {
    descriptors::buffer(
        &gpu.device,
        "lines",
        (count * size_of::<Vertex>()) as u64,
        wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
    )
}

fn create_pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    topology: wgpu::PrimitiveTopology,
    depth: Depth,
) -> wgpu::RenderPipeline {
    let vertex_layout = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4],
    };
    let blend = Some(wgpu::BlendState::ALPHA_BLENDING);
    let target = wgpu::ColorTargetState { format: COLOR_FORMAT, blend, write_mask: wgpu::ColorWrites::ALL };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("lines"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            buffers: &[Some(vertex_layout)],
            ..descriptors::vertex(module, "vertex")
        },
        primitive: wgpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: Some(descriptors::depth(
            match depth {
                Depth::Hidden => wgpu::CompareFunction::GreaterEqual,
                Depth::Through => wgpu::CompareFunction::Always,
            },
            false,
        )),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: Some(descriptors::fragment(module, "fragment", &[Some(target)])),
        multiview_mask: None,
        cache: None,
    })
}
