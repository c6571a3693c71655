use super::{
    Coverage, DepthBuffer, DepthConfig, MsvbspPaper, NoOcclusion, OcclusionCuller, PaperCaps, ShadowFrusta,
    Soundness, Svbsp,
    msvbsp::{Msvbsp, MsvbspConfig},
};

/// The cullers, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CullerKind {
    /// [`NoOcclusion`].
    None,
    /// [`ShadowFrusta`].
    Frusta,
    /// [`Svbsp`].
    Svbsp,
    /// [`Msvbsp`].
    Msvbsp,
    /// [`MsvbspPaper`] with caps. Unsound.
    MsvbspPaper,
    /// [`MsvbspPaper`] without caps. Unsound.
    MsvbspPaperCapless,
    /// [`DepthBuffer`], whole pixels.
    Depth,
    /// [`DepthBuffer`], pixel centres. Unsound by half a pixel.
    DepthCenters,
}

impl CullerKind {
    /// All of them.
    pub const ALL: &'static [Self] = &[
        Self::None,
        Self::Frusta,
        Self::Svbsp,
        Self::Msvbsp,
        Self::MsvbspPaper,
        Self::MsvbspPaperCapless,
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
            Self::MsvbspPaperCapless => "msvbsp-paper-capless",
            Self::Depth => "depth",
            Self::DepthCenters => "depth-centers",
        }
    }

    /// The kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// Whether its answers can be relied upon.
    pub fn soundness(self) -> Soundness {
        self.create(1).soundness()
    }

    /// The methods that are sound and hide something, to compare.
    pub fn sound() -> Vec<Self> {
        let is_sound = |kind: &Self| *kind != Self::None && kind.soundness() == Soundness::Conservative;
        Self::ALL.iter().copied().filter(is_sound).collect()
    }

    /// A culler of this kind, with room for this many occluders (more may be given: what exceeds a budget is left
    /// out, and counted).
    pub fn create(self, occluders: usize) -> Box<dyn OcclusionCuller> {
        let node_budget = (occluders * 32).clamp(512, 16_384);
        match self {
            Self::None => Box::new(NoOcclusion),
            Self::Frusta => Box::new(ShadowFrusta::new(occluders)),
            Self::Svbsp => Box::new(Svbsp::new(node_budget)),
            Self::Msvbsp => Box::new(Msvbsp::new(MsvbspConfig {
                node_budget,
                point_budget: node_budget * 16,
                ..MsvbspConfig::default()
            })),
            Self::MsvbspPaper => Box::new(MsvbspPaper::new(PaperCaps::Supporting, node_budget)),
            Self::MsvbspPaperCapless => Box::new(MsvbspPaper::new(PaperCaps::None, node_budget)),
            Self::Depth => Box::new(DepthBuffer::new(DepthConfig::default())),
            Self::DepthCenters => Box::new(DepthBuffer::new(DepthConfig {
                coverage: Coverage::PixelCenters,
                ..DepthConfig::default()
            })),
        }
    }
}
