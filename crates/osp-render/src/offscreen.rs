use std::{ops::Add, sync::Arc};

use super::{
    DrawnCounts, Eye, EyePicture, Gpu, GpuOcclusion, GpuTimer, Image, Layer, OpaqueOrder, OrderCounts,
    Overdraw, PaintList, PassTimes, PyramidLevel, RenderError, Renderer, RendererConfig, Target, ViewSlot,
};
use osp::{
    frame::{Stage, StageClock},
    polygon::PolygonId,
    view::View,
};
use osp_session::scene::Scene;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawTimes {
    /// Time for sending new polygons, sorting the visible polygons, and sending their numbers.
    pub prepare: Stage,
    /// Time from submission to completion.
    pub draw: Stage,
    /// GPU time by time stamps, nanoseconds; `None` if the adapter has no time stamps.
    pub gpu_ns: Option<u64>,
    /// GPU time of each pass; `None` if the adapter has no time stamps.
    pub passes: Option<PassTimes>,
    /// Counts of culling on the GPU; `None` in a frame without it.
    pub occlusion: Option<DrawnCounts>,
    /// Number of bytes sent for polygons that are new or have moved.
    pub polygon_bytes: u64,
    /// Number of bytes sent for the view and for the numbers of the polygons to draw.
    pub list_bytes: u64,
    pub draw_calls: u64,
    /// Number of polygons in the draw list, four vertices each. Frames that are culled on the GPU
    /// count only transparent and additive polygons.
    pub listed: u64,
}

fn sum<T: Add<Output = T>>(a: Option<T>, b: Option<T>) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a + b),
        (a, b) => a.or(b),
    }
}

#[derive(Debug)]
struct Sight {
    slot: ViewSlot,
    target: Target,
    timer: GpuTimer,
}

/// Draws without a window, one frame at a time, and waits for each frame. The number of a view that does not exist
/// panics.
#[derive(Debug)]
pub struct Offscreen {
    /// Keeps the polygons of all views. Call [`Renderer::follow`] with the changes of every frame, drawn or not.
    pub renderer: Renderer,
    sights: Vec<Sight>,
    last: usize,
    clock: StageClock,
}

impl Offscreen {
    /// Creates a drawer of pictures of `width` x `height` pixels on the best adapter.
    ///
    /// # Errors
    /// The system has no adapter, or a side is zero or longer than the adapter allows.
    pub fn new(width: u32, height: u32) -> Result<Self, RenderError> {
        Self::on(Arc::new(Gpu::headless()?), width, height, &RendererConfig::default())
    }

    /// Creates a drawer of pictures of `width` x `height` pixels on this adapter.
    ///
    /// # Errors
    /// A side is zero or longer than the adapter allows.
    pub fn on(gpu: Arc<Gpu>, width: u32, height: u32, config: &RendererConfig) -> Result<Self, RenderError> {
        let renderer = Renderer::new(gpu, config);
        renderer.gpu.check()?;
        let mut drawer = Self { renderer, sights: Vec::new(), last: 0, clock: StageClock::default() };
        drawer.add_view(width, height)?;
        Ok(drawer)
    }

    /// Adds a view with pictures of `width` x `height` pixels; returns the view's number. The first view has number 0. All
    /// views share the polygons, and each has its own state of occlusion culling. A new view does not cull.
    ///
    /// # Errors
    /// A side is zero or longer than the adapter allows.
    pub fn add_view(&mut self, width: u32, height: u32) -> Result<usize, RenderError> {
        let target = Target::new(&self.renderer.gpu, width, height)?;
        let timer = GpuTimer::new(&self.renderer.gpu);
        self.sights.push(Sight { slot: self.renderer.create_view_slot(), target, timer });
        Ok(self.sights.len() - 1)
    }

    /// Width divided by height of the first view's pictures.
    pub fn aspect(&self) -> f32 {
        self.sights[0].target.aspect()
    }

    /// Selects how all views cull hidden polygons on the GPU; see [`Renderer::set_occlusion`].
    ///
    /// # Errors
    /// The adapter lacks a required feature.
    pub fn set_occlusion(&mut self, occlusion: GpuOcclusion) -> Result<(), RenderError> {
        self.sights.iter_mut().try_for_each(|sight| self.renderer.set_occlusion(&mut sight.slot, occlusion))
    }

    /// Selects how view number `number` culls hidden polygons on the GPU.
    ///
    /// # Errors
    /// The adapter lacks a required feature.
    pub fn set_occlusion_of(&mut self, number: usize, occlusion: GpuOcclusion) -> Result<(), RenderError> {
        self.renderer.set_occlusion(&mut self.sights[number].slot, occlusion)
    }

    #[cfg(test)]
    pub(crate) fn use_wrong_bounds(&mut self) {
        let views = self.sights.iter_mut().filter_map(|sight| sight.slot.hzb.as_mut());
        views.for_each(|view| view.use_wrong_bounds());
    }

    /// Draws a frame of the first view and waits for the GPU. A view whose aspect differs from the picture's is
    /// stretched; see [`View::with_aspect`].
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        layers: &[Layer<'_>],
    ) -> Result<DrawTimes, RenderError> {
        self.draw_view(0, scene, view, layers)
    }

    /// Draws a frame of view number `number`; see [`Offscreen::draw`].
    pub fn draw_view(
        &mut self,
        number: usize,
        scene: &Scene,
        view: &View,
        layers: &[Layer<'_>],
    ) -> Result<DrawTimes, RenderError> {
        self.draw_views(scene, &[(number, view, layers)])
    }

    /// Draws a frame of several views, such as the eyes of a headset, in one submission, and waits for the GPU. Each
    /// view comes with its number and its layers; no number may occur twice. Returns the sums over the views.
    pub fn draw_views(
        &mut self,
        scene: &Scene,
        views: &[(usize, &View, &[Layer<'_>])],
    ) -> Result<DrawTimes, RenderError> {
        let gpu = Arc::clone(&self.renderer.gpu);
        let mut times = DrawTimes::default();
        let stage = self.clock.start();
        times.polygon_bytes = self.renderer.send(scene);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut sights: Vec<_> = self.sights.iter_mut().map(Some).collect();
        let (mut eyes, mut timed) = (Vec::new(), Vec::new());
        for &(number, view, layers) in views {
            self.last = number;
            let Some(Sight { slot, target, timer }) = sights[number].take() else { continue };
            eyes.push(Eye { slot, view, layers });
            timed.push((&*target, timer));
        }
        times.list_bytes = self.renderer.prepare_all(scene, &mut eyes);
        let pictures = eyes.into_iter().zip(timed);
        let mut pictures: Vec<_> =
            pictures.map(|(Eye { slot, .. }, (target, timer))| EyePicture { target, slot, timer }).collect();
        self.renderer.encode_all(&mut encoder, &mut pictures, &mut |_, _| {});
        for together in pictures.chunk_by(|_, next| next.slot.is_second) {
            for EyePicture { slot, .. } in together {
                times.draw_calls += self.renderer.draw_calls(together[0].slot, slot);
                times.listed += self.renderer.listed(together[0].slot, slot);
            }
        }
        let commands = encoder.finish();
        times.prepare = self.clock.since(stage);

        let stage = self.clock.start();
        gpu.queue.submit([commands]);
        gpu.wait()?;
        times.draw = self.clock.since(stage);

        for &(number, ..) in views {
            let Sight { slot, timer, .. } = &mut self.sights[number];
            timer.submitted();
            slot.submitted();
        }
        // After this call, the results of the frame are mapped.
        gpu.wait()?;
        let even_ns = times.draw.ns / views.len().max(1) as u64;
        for &(number, ..) in views {
            let Sight { slot, timer, .. } = &mut self.sights[number];
            let passes = timer.take();
            let culls = slot.culls();
            slot.note_time(culls, passes.map_or(even_ns, |passes| passes.total_ns));
            times.passes = sum(times.passes, passes);
            times.occlusion = sum(times.occlusion, if culls { slot.take_counts() } else { None });
        }
        times.gpu_ns = times.passes.map(|passes| passes.total_ns);
        Ok(times)
    }

    /// Sets the order of opaque polygons in frames that are not culled on the GPU. With `splits_by_material`, each
    /// range of one material gets its own draw call, like in a renderer with a pipeline for each material.
    pub fn set_opaque_order(&mut self, order: OpaqueOrder, splits_by_material: bool) {
        self.sights[0].slot.order.set_opaque(order, splits_by_material);
    }

    /// Cost of the last frame's order, in calls and changes of state; `scene` is the drawn scene.
    pub fn order_counts(&self, scene: &Scene) -> OrderCounts {
        self.renderer.order_counts(&self.sights[0].slot, scene)
    }

    /// Overdraw of the opaque polygons of the last frame, in their order.
    pub fn count_overdraw(&mut self) -> Result<Overdraw, RenderError> {
        self.renderer.count_overdraw(&self.sights[0].target, &self.sights[0].slot)
    }

    /// Draws a painter's list in the first view and waits for the GPU. Each part is drawn over the parts before it,
    /// without a depth test. Parts are opaque, in the plain colour of their polygon.
    pub fn draw_parts(
        &mut self,
        scene: &Scene,
        view: &View,
        list: &PaintList,
    ) -> Result<DrawTimes, RenderError> {
        self.last = 0;
        let Sight { slot, target, .. } = &mut self.sights[0];
        let gpu = Arc::clone(&self.renderer.gpu);
        let stage = self.clock.start();
        let polygon_bytes = self.renderer.send(scene);
        self.renderer.prepare_parts(slot, view);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let draw_calls = self.renderer.encode_parts(&mut encoder, target, slot, list);
        let commands = encoder.finish();
        let prepare = self.clock.since(stage);
        let stage = self.clock.start();
        gpu.queue.submit([commands]);
        gpu.wait()?;
        let draw = self.clock.since(stage);
        Ok(DrawTimes { prepare, draw, polygon_bytes, draw_calls, ..DrawTimes::default() })
    }

    /// Reads back the depth pyramid of the last frame; `None` if that frame was not culled on the GPU.
    pub fn pyramid(&self) -> Result<Option<Vec<PyramidLevel>>, RenderError> {
        self.renderer.read_pyramid(&self.sights[self.last].slot)
    }

    /// Reads back the opaque polygons that the last frame drew; `None` if that frame was not culled on the GPU.
    pub fn drawn(&self) -> Result<Option<Vec<PolygonId>>, RenderError> {
        self.renderer.read_drawn(&self.sights[self.last].slot)
    }

    pub fn image(&self) -> Result<Image, RenderError> {
        self.image_of(self.last)
    }

    pub fn image_of(&self, number: usize) -> Result<Image, RenderError> {
        self.sights[number].target.image(&self.renderer.gpu)
    }
}
