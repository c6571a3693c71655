use super::{
    CoverageBuffer, MakeCuller, NoOcclusion, OcclusionCuller,
    msvbsp::{Msvbsp, MsvbspConfig},
    tree::node_budget,
};

/// The methods of occlusion culling. All are conservative. [`Occlusion::Msvbsp`] suits scenes in which walls and other
/// large polygons hide much; [`Occlusion::Auto`] suits unknown scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Occlusion {
    /// Frustum culling alone.
    None,
    /// A shadow-volume BSP tree of the largest polygons: [`Msvbsp`].
    Msvbsp,
    /// A software depth buffer of the pixels that the largest polygons cover wholly: [`CoverageBuffer`].
    Depth,
    /// A software depth buffer of the previous frame's visible polygons: [`super::PreviousFrameOccluders`].
    PreviousFrame,
    /// In each frame the fastest of none, [`Occlusion::Msvbsp`] and [`Occlusion::PreviousFrame`].
    Auto,
}

impl Occlusion {
    /// The name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Msvbsp => "msvbsp",
            Self::Depth => "depth",
            Self::PreviousFrame => "depth-last",
            Self::Auto => "auto",
        }
    }

    /// Constructor of the culler that the method builds from a frame's largest polygons. Methods without such polygons get
    /// [`NoOcclusion`].
    #[doc(hidden)]
    pub fn culler(self) -> MakeCuller {
        match self {
            Self::None | Self::PreviousFrame => |_| Box::new(NoOcclusion),
            Self::Msvbsp | Self::Auto => |occluders| {
                let node_budget = node_budget(occluders);
                Box::new(Msvbsp::new(MsvbspConfig { node_budget, point_budget: node_budget * 16 }))
            },
            Self::Depth => |_| Box::new(CoverageBuffer::new(1024, 576)),
        }
    }

    /// The culler of [`Occlusion::culler`], with room for `occluders` occluders. A build with more omits occluders beyond
    /// its budget, and counts them.
    #[doc(hidden)]
    pub fn create(self, occluders: usize) -> Box<dyn OcclusionCuller> {
        self.culler()(occluders)
    }
}
