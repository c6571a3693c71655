//! Parsers of arguments that several commands take.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::numbers;
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::replay::CameraChoice;

pub(super) fn occlusion_parser() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::all().map(Method::name))
        .try_map(|name| Method::from_name(&name).ok_or_else(|| format!("no method is called {name}")))
}

/// Parses one of these values by its name.
pub(super) fn named<T: Copy + Send + Sync>(
    all: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.iter().map(|value| name(*value))).try_map(move |text| {
        let found = all.iter().find(|value| name(**value) == text);
        found.copied().ok_or_else(|| format!("nothing is called {text}"))
    })
}

pub(super) fn index_parser() -> impl TypedValueParser<Value = IndexKind> {
    named(IndexKind::ALL, IndexKind::name)
}

pub(super) fn camera_parser() -> impl TypedValueParser<Value = CameraChoice> {
    named(CameraChoice::ALL, CameraChoice::name)
}

/// The size of a picture, `WxH` pixels.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "render"), expect(dead_code, reason = "nothing is drawn"))]
pub(super) struct Size {
    pub(super) width: u32,
    pub(super) height: u32,
}

#[cfg(feature = "render")]
impl Size {
    /// Returns the size of a picture with this height and the aspect ratio of a screen.
    pub(super) fn on(self, screen: &osp_session::rig::Screen) -> Self {
        let width = (f64::from(screen.aspect()) * f64::from(self.height)).round().max(1.0);
        Self { width: width as u32, ..self }
    }
}

impl std::str::FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = numbers::sides(text, &(1..=16_384))?;
        Ok(Self { width, height })
    }
}
