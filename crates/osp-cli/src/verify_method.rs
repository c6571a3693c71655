//! The methods that `osp verify` compares, by name.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use osp::occlusion::Occlusion;
use osp_lab::Method;
use osp_rivals::RivalOcclusion;

/// The paper's tree exactly as printed.
const CAPLESS: &str = "msvbsp-paper-capless";

/// A method of occlusion culling, under the name that tables show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NamedMethod {
    pub(super) name: &'static str,
    pub(super) occlusion: Method,
    /// Whether this is the paper's tree without caps, which is not a separate method.
    pub(super) capless: bool,
}

impl NamedMethod {
    pub(super) fn new(occlusion: Method) -> Self {
        Self { name: occlusion.name(), occlusion, capless: false }
    }

    /// Returns the conservative methods that run on the CPU.
    pub(super) fn conservative() -> Vec<Self> {
        let methods = Method::conservative_cullers().into_iter().chain([Occlusion::PreviousFrame.into()]);
        methods.map(Self::new).collect()
    }

    /// Whether the method culls while drawing.
    pub(super) fn is_drawn(&self) -> bool {
        self.occlusion.is_while_drawing() || self.occlusion == Occlusion::Auto.into()
    }

    /// Returns all methods of `osp verify`.
    fn all() -> impl Iterator<Item = Self> {
        let methods = Method::CULLERS.iter().copied().chain([Occlusion::PreviousFrame.into()]).map(Self::new);
        let capless = Self { name: CAPLESS, capless: true, ..Self::new(RivalOcclusion::MsvbspPaper.into()) };
        let drawn = [Method::Hzb, Method::Queries, Occlusion::Auto.into()].map(Self::new);
        methods.chain([capless]).chain(drawn)
    }
}

pub(super) fn method_parser() -> impl TypedValueParser<Value = NamedMethod> {
    PossibleValuesParser::new(NamedMethod::all().map(|method| method.name)).try_map(|name| {
        let found = NamedMethod::all().find(|method| method.name == name);
        found.ok_or_else(|| format!("no method is called {name}"))
    })
}
