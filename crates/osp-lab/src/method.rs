use osp::{
    frame::{PassConfig, Pipeline},
    occlusion::{Occlusion, OcclusionCuller, Soundness},
};
#[cfg(feature = "render")]
use osp_render::GpuOcclusion;
use osp_rivals::RivalOcclusion;

/// A method of occlusion culling. It belongs to the culler, to a rival or to the renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Method {
    /// A method of the culler.
    Own(Occlusion),
    /// A method that serves only for comparison with the culler's methods.
    Rival(RivalOcclusion),
    /// Culling by a depth pyramid (Hi-Z) on the GPU while drawing. The CPU culls only by the frustum.
    Hzb,
    /// Culling by hardware occlusion queries while drawing. The CPU culls only by the frustum.
    Queries,
}

impl From<Occlusion> for Method {
    fn from(own: Occlusion) -> Self {
        Self::Own(own)
    }
}

impl From<RivalOcclusion> for Method {
    fn from(rival: RivalOcclusion) -> Self {
        Self::Rival(rival)
    }
}

impl Method {
    /// Frustum culling alone.
    pub const NONE: Self = Self::Own(Occlusion::None);

    /// The methods that build an [`OcclusionCuller`] from the largest occluders of each frame, and `none`.
    pub const CULLERS: &'static [Self] = &[
        Self::NONE,
        Self::Rival(RivalOcclusion::Frusta),
        Self::Rival(RivalOcclusion::Svbsp),
        Self::Rival(RivalOcclusion::SvbspPaper),
        Self::Own(Occlusion::Msvbsp),
        Self::Rival(RivalOcclusion::MsvbspPaper),
        Self::Own(Occlusion::Depth),
    ];

    pub fn all() -> impl Iterator<Item = Self> + Clone {
        let others = [Occlusion::PreviousFrame, Occlusion::Auto].map(Self::Own).into_iter();
        Self::CULLERS.iter().copied().chain(others).chain([Self::Hzb, Self::Queries])
    }

    /// The method's name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own(own) => own.name(),
            Self::Rival(rival) => rival.name(),
            Self::Hzb => "hzb",
            Self::Queries => "queries",
        }
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|method| method.name() == name)
    }

    /// All conservative methods that cull polygons, except the paper's SVBSP, which finds little.
    pub fn conservative_cullers() -> Vec<Self> {
        let others = [Self::NONE, Self::Rival(RivalOcclusion::SvbspPaper)];
        let cullers = Self::CULLERS.iter().copied().filter(|method| !others.contains(method));
        cullers.filter(|method| method.soundness() == Soundness::Conservative).collect()
    }

    /// Whether the method never culls visible polygons.
    pub fn soundness(self) -> Soundness {
        match self {
            Self::Rival(_) => self.create(1).soundness(),
            Self::Own(_) | Self::Hzb | Self::Queries => Soundness::Conservative,
        }
    }

    /// Whether the renderer alone does the occlusion culling, so that the CPU culls only by the frustum.
    pub fn is_while_drawing(self) -> bool {
        matches!(self, Self::Hzb | Self::Queries)
    }

    /// Whether [`Method::add_to`] adds a culler.
    pub fn is_on_cpu(self) -> bool {
        self != Self::NONE && !self.is_while_drawing()
    }

    /// The culler of this method, with capacity for `occluders` occluders ([`Occlusion::create`]).
    pub fn create(self, occluders: usize) -> Box<dyn OcclusionCuller> {
        match self {
            Self::Own(own) => own.create(occluders),
            Self::Rival(rival) => rival.culler()(occluders),
            Self::Hzb | Self::Queries => Occlusion::None.create(occluders),
        }
    }

    /// The pipeline with this method's culling on the CPU. The settings are `config`, except for the choice of the
    /// method. A method that culls while drawing does not change the pipeline.
    #[must_use]
    pub fn add_to(self, pipeline: Pipeline, config: PassConfig) -> Pipeline {
        match self {
            Self::Own(choice) => pipeline.with_occlusion(PassConfig { choice, ..config }),
            Self::Rival(rival) => {
                pipeline.with_culler(rival.culler(), PassConfig { choice: Occlusion::Msvbsp, ..config })
            }
            Self::Hzb | Self::Queries => pipeline,
        }
    }

    /// The method's culling on the GPU, while drawing.
    #[cfg(feature = "render")]
    pub fn while_drawing(self) -> GpuOcclusion {
        match self {
            Self::Hzb => GpuOcclusion::Hzb,
            Self::Queries => GpuOcclusion::Queries,
            Self::Own(Occlusion::Auto) => GpuOcclusion::Auto,
            Self::Own(_) | Self::Rival(_) => GpuOcclusion::None,
        }
    }
}
