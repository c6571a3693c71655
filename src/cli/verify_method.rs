//! The methods that `osp verify` compares with the truth, by name.

use clap::builder::{PossibleValuesParser, TypedValueParser};

#[cfg(feature = "render")]
use super::verify_drawn::drawn_methods;
use crate::occlusion::Occlusion;
#[cfg(feature = "render")]
use crate::render::GpuOcclusion;

/// A way to find what is hidden that can be compared with the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Method {
    /// Before drawing, by the best of large occluders.
    Culler(Occlusion),
    /// Before drawing, by what was visible in the last frame.
    Last,
    /// While drawing.
    #[cfg(feature = "render")]
    Drawn(&'static str, GpuOcclusion),
}

impl Method {
    /// Those that cull before drawing and are sound.
    pub(super) fn sound() -> Vec<Self> {
        Occlusion::conservative_cullers().into_iter().map(Self::Culler).chain([Self::Last]).collect()
    }

    fn from_name(name: &str) -> Option<Self> {
        #[cfg(feature = "render")]
        if let Some((name, occlusion)) = drawn_methods().find(|(other, _)| *other == name) {
            return Some(Self::Drawn(name, occlusion));
        }
        if name == Occlusion::DepthLast.name() {
            return Some(Self::Last);
        }
        Occlusion::from_name(name).filter(|method| Occlusion::CULLERS.contains(method)).map(Self::Culler)
    }
}

pub(super) fn method_parser() -> impl TypedValueParser<Value = Method> {
    let names = Occlusion::CULLERS.iter().map(|kind| kind.name()).chain([Occlusion::DepthLast.name()]);
    #[cfg(feature = "render")]
    let names = names.chain(drawn_methods().map(|(name, _)| name));
    PossibleValuesParser::new(names)
        .try_map(|name| Method::from_name(&name).ok_or_else(|| format!("no method is called {name}")))
}
