//! Replaces the module `verify_drawn` in a build that cannot draw. Refuses the methods that cull while drawing.

use super::{
    built::{self, Feature},
    parsers::Size,
    verify_method::NamedMethod,
};
use osp::{polygon::Change, view::View};
use osp_lab::{
    rows::Rows,
    verify::{AtRest, Verifier},
};
use osp_session::scene::Scene;

/// A type without values, because this build cannot draw.
pub(super) enum DrawnTrials {}

impl DrawnTrials {
    pub(super) fn new(methods: &[NamedMethod], _: Size, _: AtRest) -> anyhow::Result<Option<Self>> {
        match methods.iter().find(|method| method.is_drawn()) {
            Some(method) => built::refuse(format!("--occlusion {}", method.name), &[Feature::Render]),
            None => Ok(None),
        }
    }

    pub(super) fn follow(&mut self, _: &[Change]) {
        match *self {}
    }

    pub(super) fn draw_view(&mut self, _: &Scene, _: &View, _: &mut Verifier) -> anyhow::Result<()> {
        match *self {}
    }

    pub(super) fn add_to(&self, _: &mut Rows, _: &str) {
        match *self {}
    }
}
