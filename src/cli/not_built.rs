//! Commands that this build does not have.

use std::ffi::OsString;

use anyhow::bail;
use clap::Args;

use super::Outcome;

/// Not in this build.
#[derive(Args, Debug)]
pub(super) struct NotBuilt {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _rest: Vec<OsString>,
}

/// Says what a command needs.
pub(super) fn refuse(command: &str, feature: &str) -> anyhow::Result<Outcome> {
    bail!(
        "osp {command} is not in this build: it needs the feature `{feature}` (cargo install --path . --features {feature})"
    )
}
