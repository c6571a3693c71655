//! Replaces the module `charts` in a build without the feature `bench`. [`super::built`] has already refused `--chart`.

use super::{outputs::Outputs, replay_args::ReplayArgs};
use osp_lab::report::ReplayReport;

pub(super) struct Charts;

impl Charts {
    pub(super) fn checked(_: &ReplayArgs, _: &mut Outputs) -> anyhow::Result<Self> {
        Ok(Self)
    }

    pub(super) fn draw(&self, _session: usize, _: &ReplayReport) -> anyhow::Result<()> {
        Ok(())
    }
}
