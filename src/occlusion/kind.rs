use super::{
    Coverage, DepthBuffer, DepthConfig, MsvbspPaper, NoOcclusion, OcclusionCuller, PaperCaps, ShadowFrusta,
    Soundness, Svbsp,
    msvbsp::{Msvbsp, MsvbspConfig},
};

/// The methods of occlusion culling. An engine takes [`Occlusion::Msvbsp`] where walls and other large polygons hide much, and
/// [`Occlusion::Auto`] where that is not known; the others are there to compare with.
///
/// The pipeline and the renderer are given the same choice; each does its own part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Occlusion {
    /// Frustum culling alone.
    None,
    /// The shadow volume of each occluder alone: [`ShadowFrusta`].
    Frusta,
    /// A shadow-volume BSP tree of the occluders: [`Svbsp`].
    Svbsp,
    /// A shadow-volume BSP tree in its modified form, which is built faster and asked faster: [`Msvbsp`].
    Msvbsp,
    /// The modified tree as the paper prints it: [`MsvbspPaper`] with caps. Not conservative.
    MsvbspPaper,
    /// A software depth buffer of the occluders, of the pixels that they cover wholly: [`DepthBuffer`].
    Depth,
    /// The same, sampled at pixel centres. Wrong by up to half a pixel: not conservative.
    DepthCenters,
    /// A software depth buffer of the previous frame's visible polygons: [`super::PreviousFrameOccluders`].
    DepthLast,
    /// In each frame whichever of none, [`Occlusion::Msvbsp`] and [`Occlusion::DepthLast`] takes the least time; a renderer
    /// chooses between none and [`Occlusion::Hzb`] in the same way.
    Auto,
    /// Hi-Z culling on the GPU, by a depth pyramid; the CPU culls by the frustum only.
    Hzb,
    /// Hardware occlusion queries on the GPU; the CPU culls by the frustum only.
    Queries,
    /// The potentially visible sets of `lab::pvs`, sampled beforehand. Not conservative.
    Pvs,
}

impl Occlusion {
    /// The methods that build an [`OcclusionCuller`] from the largest occluders of each frame, and none.
    pub const CULLERS: &'static [Self] = &[
        Self::None,
        Self::Frusta,
        Self::Svbsp,
        Self::Msvbsp,
        Self::MsvbspPaper,
        Self::Depth,
        Self::DepthCenters,
    ];

    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Frusta => "frusta",
            Self::Svbsp => "svbsp",
            Self::Msvbsp => "msvbsp",
            Self::MsvbspPaper => "msvbsp-paper",
            Self::Depth => "depth",
            Self::DepthCenters => "depth-centers",
            Self::DepthLast => "depth-last",
            Self::Auto => "auto",
            Self::Hzb => "hzb",
            Self::Queries => "queries",
            Self::Pvs => "pvs",
        }
    }

    /// The methods that need nothing but the geometry: all except [`Occlusion::Pvs`].
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        Self::CULLERS.iter().copied().chain([Self::DepthLast, Self::Auto, Self::Hzb, Self::Queries])
    }

    /// The method with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().chain([Self::Pvs]).find(|method| method.name() == name)
    }

    /// The cullers that are conservative and hide something.
    pub fn conservative_cullers() -> Vec<Self> {
        let hides_nothing_visible = |method: &Self| method.soundness() == Soundness::Conservative;
        let cullers = Self::CULLERS.iter().copied().filter(|method| *method != Self::None);
        cullers.filter(hides_nothing_visible).collect()
    }

    /// Whether it never culls what is visible.
    pub fn soundness(self) -> Soundness {
        match self {
            Self::Pvs => Soundness::Unsound("what is seen only from between the samples"),
            method => method.create(1).soundness(),
        }
    }

    /// What a renderer does of it: this method if it culls on the GPU, else none.
    pub fn on_gpu(self) -> Self {
        if matches!(self, Self::Hzb | Self::Queries | Self::Auto) { self } else { Self::None }
    }

    /// This method if a [`Pipeline`](crate::frame::Pipeline) can run it on the CPU, else [`Occlusion::None`].
    pub fn on_cpu(self) -> Self {
        if matches!(self, Self::Hzb | Self::Queries | Self::Pvs) { Self::None } else { self }
    }

    /// Whether only the renderer finds what is hidden: the CPU culls by the frustum alone.
    pub fn is_while_drawing(self) -> bool {
        matches!(self, Self::Hzb | Self::Queries)
    }

    /// Whether it builds an [`OcclusionCuller`] from the largest occluders of a frame.
    pub fn has_culler(self) -> bool {
        self == Self::Auto || (self != Self::None && Self::CULLERS.contains(&self))
    }

    /// Splitting planes of a tree of this many occluders, at most.
    pub fn node_budget(occluders: usize) -> usize {
        (occluders * 32).clamp(512, 16_384)
    }

    /// The culler of this method, with room for this many occluders (more may be given: what exceeds a budget is left
    /// out, and counted). A method without one of its own gets [`NoOcclusion`].
    pub fn create(self, occluders: usize) -> Box<dyn OcclusionCuller> {
        let node_budget = Self::node_budget(occluders);
        match self {
            Self::None | Self::DepthLast | Self::Hzb | Self::Queries | Self::Pvs => Box::new(NoOcclusion),
            Self::Frusta => Box::new(ShadowFrusta::new(occluders)),
            Self::Svbsp => Box::new(Svbsp::new(node_budget)),
            Self::Msvbsp | Self::Auto => Box::new(Msvbsp::new(MsvbspConfig {
                node_budget,
                point_budget: node_budget * 16,
                ..MsvbspConfig::default()
            })),
            Self::MsvbspPaper => Box::new(MsvbspPaper::new(PaperCaps::Supporting, node_budget)),
            Self::Depth => Box::new(DepthBuffer::new(DepthConfig::default())),
            Self::DepthCenters => Box::new(DepthBuffer::new(DepthConfig {
                coverage: Coverage::PixelCenters,
                ..DepthConfig::default()
            })),
        }
    }
}
