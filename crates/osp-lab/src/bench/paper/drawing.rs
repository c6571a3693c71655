#[cfg(feature = "render")]
use std::sync::Arc;

use super::PaperError;
use crate::Method;
use osp::{
    polygon::{Change, VisibleBlocks},
    view::View,
};
#[cfg(feature = "render")]
use osp_render::{Gpu, Layer, Offscreen, RendererConfig};
use osp_session::scene::Scene;

#[derive(Debug)]
pub struct Adapter {
    #[cfg(feature = "render")]
    gpu: Arc<Gpu>,
    width: u32,
    height: u32,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drawn {
    pub(super) prepare_ns: u64,
    pub(super) draw_ns: u64,
}

impl Drawn {
    pub(super) fn total_ns(self) -> u64 {
        self.prepare_ns + self.draw_ns
    }
}

#[derive(Debug)]
pub(super) struct Drawer {
    #[cfg(feature = "render")]
    offscreen: Offscreen,
    #[cfg(not(feature = "render"))]
    never: std::convert::Infallible,
}

#[cfg(feature = "render")]
impl Adapter {
    /// The best available adapter, for pictures of this size.
    ///
    /// # Errors
    /// As text: no adapter exists.
    pub fn open(width: u32, height: u32) -> Result<Self, String> {
        let gpu = Arc::new(Gpu::headless().map_err(|error| error.to_string())?);
        Ok(Self { gpu, width, height })
    }

    pub fn name(&self) -> String {
        format!("{}, {} x {} pixels", self.gpu.name(), self.width, self.height)
    }

    /// A drawer that uses this method's occlusion culling while drawing.
    pub(super) fn drawer(&self, method: Method) -> Result<Drawer, PaperError> {
        let open = || {
            let config = RendererConfig::default();
            let mut offscreen = Offscreen::on(Arc::clone(&self.gpu), self.width, self.height, &config)?;
            offscreen.set_occlusion(method.while_drawing())?;
            Ok(Drawer { offscreen })
        };
        open().map_err(failed)
    }
}

#[cfg(feature = "render")]
fn failed(error: osp_render::RenderError) -> PaperError {
    match error {
        osp_render::RenderError::NoOcclusion { .. } => PaperError::NoOcclusion(error.to_string()),
        _ => PaperError::Drawing(Box::new(error)),
    }
}

#[cfg(feature = "render")]
impl Drawer {
    pub(super) fn follow(&mut self, changes: &[Change]) {
        self.offscreen.renderer.follow(changes);
    }

    pub(super) fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        drawn: &VisibleBlocks,
    ) -> Result<Drawn, PaperError> {
        let times = self.offscreen.draw(scene, view, &[Layer::plain(drawn)]).map_err(failed)?;
        Ok(Drawn { prepare_ns: times.prepare.ns, draw_ns: times.draw.ns })
    }
}

#[cfg(not(feature = "render"))]
impl Adapter {
    /// Always an error, because this build cannot draw.
    ///
    /// # Errors
    /// Always.
    pub fn open(_width: u32, _height: u32) -> Result<Self, String> {
        let lacking = "drawing needs a build with the feature `render`, which this one lacks: \
                       cargo install --path crates/osp-cli --features render";
        Err(lacking.to_owned())
    }

    pub fn name(&self) -> String {
        format!("{} x {} pixels", self.width, self.height)
    }

    pub(super) fn drawer(&self, _method: Method) -> Result<Drawer, PaperError> {
        Err(PaperError::Drawing("no renderer".into()))
    }
}

#[cfg(not(feature = "render"))]
impl Drawer {
    pub(super) fn follow(&mut self, _changes: &[Change]) {
        match self.never {}
    }

    pub(super) fn draw(
        &mut self,
        _scene: &Scene,
        _view: &View,
        _drawn: &VisibleBlocks,
    ) -> Result<Drawn, PaperError> {
        match self.never {}
    }
}
