//! The methods that `osp verify` compares with the truth, by name.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::occlusion::Occlusion;
#[cfg(feature = "render")]
use crate::render::{HzbBound, HzbConfig, HzbFine, HzbGroup};

/// The paper's tree as it is printed.
const CAPLESS: &str = "msvbsp-paper-capless";

/// A method of occlusion culling, under the name that tables show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Method {
    pub(super) name: &'static str,
    pub(super) occlusion: Occlusion,
    /// Whether it is the paper's tree without caps, which is no method of its own.
    pub(super) capless: bool,
    /// Settings of a method that culls by a depth pyramid.
    #[cfg(feature = "render")]
    pub(super) hzb: HzbConfig,
}

impl Method {
    pub(super) fn new(occlusion: Occlusion) -> Self {
        Self {
            name: occlusion.name(),
            occlusion,
            capless: false,
            #[cfg(feature = "render")]
            hzb: HzbConfig::default(),
        }
    }

    /// The conservative methods of the CPU.
    pub(super) fn conservative() -> Vec<Self> {
        let methods = Occlusion::conservative_cullers().into_iter().chain([Occlusion::DepthLast]);
        methods.map(Self::new).collect()
    }

    /// All methods that can be compared.
    fn all() -> Vec<Self> {
        let methods = Occlusion::CULLERS.iter().copied().chain([Occlusion::DepthLast]).map(Self::new);
        let capless = Self { name: CAPLESS, capless: true, ..Self::new(Occlusion::MsvbspPaper) };
        let methods = methods.chain([capless]);
        #[cfg(feature = "render")]
        let methods = methods.chain(gpu_methods());
        methods.collect()
    }
}

/// The methods of the GPU: culling by a depth pyramid with other settings than the usual ones, too.
#[cfg(feature = "render")]
fn gpu_methods() -> impl Iterator<Item = Method> {
    let coarse = |group, bound| HzbConfig { group, bound, fine: HzbFine::Off };
    let fine = |group| HzbConfig { group, ..HzbConfig::default() };
    let pyramids = [
        ("hzb", HzbConfig::default()),
        ("hzb-16", coarse(HzbGroup::Sixteen, HzbBound::Corners)),
        ("hzb-4", coarse(HzbGroup::Four, HzbBound::Corners)),
        ("hzb-1", coarse(HzbGroup::One, HzbBound::Corners)),
        ("hzb-16-box", coarse(HzbGroup::Sixteen, HzbBound::Box)),
        ("hzb-4-box", coarse(HzbGroup::Four, HzbBound::Box)),
        ("hzb-1-box", coarse(HzbGroup::One, HzbBound::Box)),
        ("hzb-16-fine", fine(HzbGroup::Sixteen)),
        ("hzb-4-fine", fine(HzbGroup::Four)),
    ];
    let pyramids = pyramids.map(|(name, hzb)| Method { name, hzb, ..Method::new(Occlusion::Hzb) });
    pyramids.into_iter().chain([Occlusion::Queries, Occlusion::Auto].map(Method::new))
}

pub(super) fn method_parser() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::all().into_iter().map(|method| method.name)).try_map(|name| {
        let found = Method::all().into_iter().find(|method| method.name == name);
        found.ok_or_else(|| format!("no method is called {name}"))
    })
}
