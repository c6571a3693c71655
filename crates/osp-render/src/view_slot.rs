use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::{
    DrawOrder, DrawnCounts, Gpu, GpuOcclusion, Style, descriptors, draw_switch::DrawSwitch, hzb::HzbView,
    order::Listing, style::MAX_STYLES,
};
use osp::{math::rotate, polygon::VisibleBlocks, view::View};

/// Resources of one view, such as a screen or an eye: its uniforms, and the numbers of its polygons.
#[derive(Debug)]
pub struct ViewSlot {
    pub(super) uniforms: wgpu::Buffer,
    /// First the polygon numbers of listed runs, then one bit for each polygon for the other runs.
    ids: wgpu::Buffer,
    /// Capacity of the buffer for polygon numbers. The bits begin at this position.
    pub(super) all_from: u32,
    /// Capacity of the buffer for bits, words of 32 bits.
    bit_words: u32,
    pub(super) bind_group: wgpu::BindGroup,
    /// The draw list in `bind_group`: `ids`, or that of the other eye.
    pub(super) list: wgpu::Buffer,
    /// Position of the first polygon of `order` in `list`.
    pub(super) first: u32,
    pub(super) order: DrawOrder,
    /// Whether `order` lacks the polygons that both eyes draw. They are in the order of the view before this view.
    pub(super) is_second: bool,
    /// The polygons of both eyes. Empty in most views; kept for its memory.
    pub(super) both: VisibleBlocks,
    pub(super) hzb: Option<Box<HzbView>>,
    /// For [`GpuOcclusion::Auto`]: whether the next frame is culled.
    pub(super) switch: Option<DrawSwitch>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Uniforms {
    clip_from_eye: [[f32; 4]; 4],
    eye_in_world: [f32; 4],
    styles: [[[f32; 4]; 2]; MAX_STYLES],
    up_in_world: [f32; 4],
    corners: [[f32; 4]; 3],
    /// x: the position of polygon 0. Each later position stands for the next polygon number.
    all_from: [u32; 4],
}

impl Uniforms {
    /// Uniforms without an eye: positions are relative to `middle`.
    pub(super) fn of_matrix(clip_from_middle: [[f32; 4]; 4], middle: [f32; 4]) -> Self {
        Self { clip_from_eye: clip_from_middle, eye_in_world: middle, ..Self::zeroed() }
    }
}

impl ViewSlot {
    pub(super) fn new(gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> Self {
        let uniforms = gpu.buffer("view", size_of::<Uniforms>() as u64, descriptors::UNIFORM);
        let all_from = 1 << 14;
        let ids = create_ids(gpu, u64::from(all_from));
        let bind_group = bind(gpu, layout, &uniforms, &ids);
        Self {
            uniforms,
            list: ids.clone(),
            ids,
            all_from,
            bit_words: 0,
            bind_group,
            first: 0,
            order: DrawOrder::new(),
            is_second: false,
            both: VisibleBlocks::new(),
            hzb: None,
            switch: None,
        }
    }

    pub(super) fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
        let uniform = descriptors::uniform(size_of::<Uniforms>() as u64);
        let bindings = [
            (wgpu::ShaderStages::VERTEX_FRAGMENT, uniform),
            (wgpu::ShaderStages::VERTEX, descriptors::read(4)),
        ];
        gpu.bind_layout("view", &bindings)
    }

    pub fn occlusion(&self) -> GpuOcclusion {
        match (&self.switch, &self.hzb) {
            (Some(_), _) => GpuOcclusion::Auto,
            (None, Some(view)) => view.occlusion(),
            (None, None) => GpuOcclusion::None,
        }
    }

    /// Records the time of a frame of this view, nanoseconds, and whether the frame was culled on the GPU. The time may
    /// arrive some frames late. [`GpuOcclusion::Auto`] compares these times. The time of an eye that shares its list
    /// belongs to the other eye, which decides for both.
    pub fn note_time(&mut self, culled: bool, ns: u64) {
        if let Some(switch) = self.switch.as_mut().filter(|_| !self.is_second) {
            switch.note(culled, ns);
        }
    }

    pub fn culls(&self) -> bool {
        self.hzb.is_some() && self.order.listing == Listing::Clusters
    }

    /// Begins the transfer of the frame's counts. Call it after the commands of
    /// [`Renderer::encode`](super::Renderer::encode) were submitted.
    pub fn submitted(&mut self) {
        if self.culls()
            && let Some(view) = &mut self.hzb
        {
            view.submitted();
        }
    }

    /// Counts of the latest frame whose results became available since the last call.
    pub fn take_counts(&mut self) -> Option<DrawnCounts> {
        self.hzb.as_mut()?.take_counts()
    }

    /// Sends the view and the order of drawing; returns the number of bytes sent. `place` is where the list of another
    /// eye leaves room for this one.
    pub(super) fn send(
        &mut self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        (view, styles): (&View, &[Style; MAX_STYLES]),
        place: Place<'_>,
    ) -> u64 {
        let from_eye = View { eye_in_world: Vec3::ZERO, ..*view };
        let [from, right, _, up] = view.corner_directions();
        let uniforms = Uniforms {
            clip_from_eye: from_eye.clip_from_world().to_cols_array_2d(),
            eye_in_world: view.eye_in_world.extend(1.0).to_array(),
            styles: styles.map(|style| style.words()),
            up_in_world: rotate(view.world_from_view, Vec3::Y).extend(0.0).to_array(),
            corners: [from, right - from, up - from].map(|way| way.extend(0.0).to_array()),
            ..Uniforms::zeroed()
        };
        self.send_uniforms(gpu, layout, uniforms, place)
    }

    pub(super) fn send_uniforms(
        &mut self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        uniforms: Uniforms,
        place: Place<'_>,
    ) -> u64 {
        let (list, all_from) = match place {
            Place::Behind(other) => {
                self.first = other.first + other.order.ids().len() as u32;
                (other.ids.clone(), other.polygon_0())
            }
            Place::Own { before, more } => {
                self.first = before;
                self.grow(gpu, u64::from(before) + self.order.ids().len() as u64 + more);
                (self.ids.clone(), self.polygon_0())
            }
        };
        if self.list != list {
            self.bind_group = bind(gpu, layout, &self.uniforms, &list);
            self.list = list;
        }
        let ids: &[u8] = bytemuck::cast_slice(self.order.ids());
        let (first_word, bits) = self.order.span_bits();
        if !ids.is_empty() {
            gpu.queue.write_buffer(&self.list, u64::from(self.first) * 4, ids);
        }
        let bits: &[u8] = bytemuck::cast_slice(bits);
        if !bits.is_empty() {
            gpu.queue.write_buffer(&self.list, u64::from(all_from) * 4 + first_word as u64 * 8, bits);
        }
        let uniforms = Uniforms { all_from: [all_from; 4], ..uniforms };
        gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&uniforms));
        (ids.len() + bits.len() + size_of::<Uniforms>()) as u64
    }

    fn polygon_0(&self) -> u32 {
        // Without bits, no position stands for a polygon number, because other lists may be longer than this one.
        if self.order.span_bits().1.is_empty() { u32::MAX } else { self.all_from }
    }

    /// Makes room for `listed` polygons and the bits of the order.
    fn grow(&mut self, gpu: &Gpu, listed: u64) {
        let (first_word, bits) = self.order.span_bits();
        let bit_words = if bits.is_empty() { 0 } else { (first_word + bits.len()) as u64 * 2 };
        if listed > u64::from(self.all_from) || bit_words > u64::from(self.bit_words) {
            // Both parts are written again in every frame, so the old contents need not be copied.
            let grown = |room: u32, wanted: u64| u64::from(room).max(wanted.next_power_of_two()) as u32;
            self.all_from = grown(self.all_from, listed);
            self.bit_words = if bit_words == 0 { self.bit_words } else { grown(self.bit_words, bit_words) };
            self.ids = create_ids(gpu, u64::from(self.all_from) + u64::from(self.bit_words));
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Place<'a> {
    /// The view's own buffer. The adapter lists `before` polygons before the list, and another eye `more` behind it.
    Own { before: u32, more: u64 },
    /// The buffer of another eye, behind its list.
    Behind(&'a ViewSlot),
}

impl Place<'_> {
    /// A buffer for nothing but the list.
    pub(super) const ALONE: Self = Self::Own { before: 0, more: 0 };
}

fn create_ids(gpu: &Gpu, count: u64) -> wgpu::Buffer {
    gpu.buffer("draw list", count * 4, descriptors::STORAGE)
}

fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    uniforms: &wgpu::Buffer,
    ids: &wgpu::Buffer,
) -> wgpu::BindGroup {
    gpu.bind_group("view", layout, &[uniforms.as_entire_binding(), ids.as_entire_binding()])
}
