use super::Hzb;
use crate::{
    DrawOrder, Gpu, Target,
    finish::{Bloom, Finish},
    gpu_scene::GpuScene,
    pipelines::Pipelines,
};

/// Parts of the renderer and of the view's slot that draw a view.
#[derive(Clone, Copy)]
pub(in super::super) struct Frame<'a> {
    pub(in super::super) gpu: &'a Gpu,
    pub(in super::super) hzb: &'a Hzb,
    pub(in super::super) scene: &'a GpuScene,
    pub(in super::super) pipelines: &'a Pipelines,
    pub(in super::super) finish: &'a Finish,
    pub(in super::super) bloom: Bloom,
    pub(in super::super) view_layout: &'a wgpu::BindGroupLayout,
    pub(in super::super) target: &'a Target,
    pub(in super::super) background: wgpu::Color,
    pub(in super::super) uniforms: &'a wgpu::Buffer,
    pub(in super::super) list: &'a wgpu::Buffer,
    pub(in super::super) draw: &'a wgpu::BindGroup,
    /// The order of the polygons, and its list. It lacks the transparent polygons of the second eye.
    pub(in super::super) order: &'a DrawOrder,
    pub(in super::super) list_of_order: &'a wgpu::Buffer,
    /// The transparent polygons of the second eye.
    pub(in super::super) of_second: Option<&'a DrawOrder>,
}
