use bytemuck::{Pod, Zeroable};

use super::{
    DrawOrder, DrawnCounts, Gpu, Style, draw_switch::DrawSwitch, hzb::HzbView, order::Listing,
    renderer::MAX_STYLES,
};
use crate::{occlusion::Occlusion, view::View};

/// What a frame sends for one view: the view itself and the numbers of its polygons. One for each screen and eye.
#[derive(Debug)]
pub struct ViewSlot {
    uniforms: wgpu::Buffer,
    ids: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    pub(super) order: DrawOrder,
    pub(super) hzb: Option<Box<HzbView>>,
    /// For [`Occlusion::Auto`]: whether the next frame is culled.
    pub(super) switch: Option<DrawSwitch>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Uniforms {
    clip_from_eye: [[f32; 4]; 4],
    eye_in_world: [f32; 4],
    styles: [[[f32; 4]; 2]; MAX_STYLES],
}

impl ViewSlot {
    pub(super) fn new(gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> Self {
        let uniforms = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<Uniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let ids = create_ids(gpu, 1 << 14);
        let bind_group = bind(gpu, layout, &uniforms, &ids);
        Self { uniforms, ids, bind_group, order: DrawOrder::new(), hzb: None, switch: None }
    }

    pub(super) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
        let entry = |binding, ty, size: u64| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: wgpu::BufferSize::new(size),
            },
            count: None,
        };
        gpu.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("view"),
            entries: &[
                entry(0, wgpu::BufferBindingType::Uniform, size_of::<Uniforms>() as u64),
                entry(1, wgpu::BufferBindingType::Storage { read_only: true }, 4),
            ],
        })
    }

    pub(super) fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    pub(super) fn uniforms(&self) -> &wgpu::Buffer {
        &self.uniforms
    }

    pub(super) fn list(&self) -> &wgpu::Buffer {
        &self.ids
    }

    /// The method by which this view is culled on the GPU.
    pub fn occlusion(&self) -> Occlusion {
        match (&self.switch, &self.hzb) {
            (Some(_), _) => Occlusion::Auto,
            (None, Some(view)) => view.occlusion(),
            (None, None) => Occlusion::None,
        }
    }

    /// Takes the time of a frame of this view, now or some frames later, and whether that frame was culled on the GPU.
    /// [`Occlusion::Auto`] decides by these times.
    pub fn note_time(&mut self, culled: bool, ns: u64) {
        if let Some(switch) = &mut self.switch {
            switch.note(culled, ns);
        }
    }

    /// Whether the current frame is culled on the GPU.
    pub fn culls(&self) -> bool {
        self.hzb.is_some() && self.order.listing() == Listing::Blocks
    }

    /// To be called after the submission of what [`Renderer::encode`](super::Renderer::encode) has encoded.
    pub fn submitted(&mut self) {
        if self.culls()
            && let Some(view) = &mut self.hzb
        {
            view.submitted();
        }
    }

    /// Counts of the latest frame whose results have arrived since the last call.
    pub fn take_counts(&mut self) -> Option<DrawnCounts> {
        self.hzb.as_mut()?.take_counts()
    }

    /// Sends the view and the order of drawing; returns the bytes sent.
    pub(super) fn send(
        &mut self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        view: &View,
        styles: &[Style; MAX_STYLES],
    ) -> u64 {
        let from_eye = View { eye_in_world: glam::Vec3::ZERO, ..*view };
        let uniforms = Uniforms {
            clip_from_eye: from_eye.clip_from_world().to_cols_array_2d(),
            eye_in_world: view.eye_in_world.extend(1.0).to_array(),
            styles: styles.map(|style| style.words()),
        };
        gpu.queue().write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&uniforms));
        let ids: &[u8] = bytemuck::cast_slice(self.order.ids());
        // Opaque polygons that are handed over as blocks are listed on the GPU, before the others.
        let before = u64::from(self.order.opaque_count());
        let count = before + self.order.ids().len() as u64;
        if count * 4 > self.ids.size() {
            // The list is written anew every frame: the old one need not be copied.
            self.ids = create_ids(gpu, count.next_power_of_two());
            self.bind_group = bind(gpu, layout, &self.uniforms, &self.ids);
        }
        if !ids.is_empty() {
            gpu.queue().write_buffer(&self.ids, before * 4, ids);
        }
        ids.len() as u64 + size_of::<Uniforms>() as u64
    }
}

fn create_ids(gpu: &Gpu, count: u64) -> wgpu::Buffer {
    gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("draw list"),
        size: count * 4,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    uniforms: &wgpu::Buffer,
    ids: &wgpu::Buffer,
) -> wgpu::BindGroup {
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("view"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: ids.as_entire_binding() },
        ],
    })
}
