use super::{MsvbspPaper, PaperCaps, ShadowFrusta, Svbsp, SvbspForm};
use osp::occlusion::{MakeCuller, kernels::node_budget};

/// The methods of occlusion culling that [`Occlusion`](osp::occlusion::Occlusion)'s methods are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RivalOcclusion {
    /// The shadow volume of each occluder alone: [`ShadowFrusta`].
    Frusta,
    /// A shadow-volume BSP tree of the occluders: [`Svbsp`].
    Svbsp,
    /// A BSP tree of the occluders' shadow planes, as the paper describes it: [`Svbsp`] by [`SvbspForm::Planes`].
    SvbspPaper,
    /// The modified tree as the paper prints it: [`MsvbspPaper`] with caps. Not conservative.
    MsvbspPaper,
}

impl RivalOcclusion {
    /// The name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Frusta => "frusta",
            Self::Svbsp => "svbsp",
            Self::SvbspPaper => "svbsp-paper",
            Self::MsvbspPaper => "msvbsp-paper",
        }
    }

    /// Constructor of the method's culler, for [`Pipeline::with_culler`](osp::frame::Pipeline::with_culler).
    pub fn culler(self) -> MakeCuller {
        match self {
            Self::Frusta => |occluders| Box::new(ShadowFrusta::new(occluders)),
            Self::Svbsp => |occluders| Box::new(Svbsp::new(SvbspForm::Occluders, node_budget(occluders))),
            Self::SvbspPaper => |occluders| Box::new(Svbsp::new(SvbspForm::Planes, node_budget(occluders))),
            Self::MsvbspPaper => {
                |occluders| Box::new(MsvbspPaper::new(PaperCaps::Supporting, node_budget(occluders)))
            }
        }
    }
}
