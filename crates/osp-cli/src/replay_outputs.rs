//! The files that `osp replay` writes.

use anyhow::bail;

use super::{charts::Charts, outputs::Output, replay_args::ReplayArgs};
use osp_session::atomic_file::Destination;

/// The outputs of a replay.
pub(super) struct ReplayOutputs {
    pub(super) csv: Option<Output>,
    pub(super) charts: Charts,
    pub(super) pin: Option<Output>,
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only a window writes it"))]
    pub(super) trace: Option<Output>,
}

impl ReplayOutputs {
    pub(super) fn checked(args: &ReplayArgs) -> anyhow::Result<Self> {
        let mut outputs = args.force.outputs().reads(&args.files).reads(&args.check);
        outputs = outputs.reads(&args.rig.screens.file());
        if let Some(path) = &args.pin
            && matches!(Destination::of(path), Ok(Destination::Special(_)))
        {
            bail!(
                "{}: pins are added to the pins in the file: expected a regular file; found a pipe or a device",
                path.display()
            );
        }
        let charts = Charts::checked(args, &mut outputs)?;
        Ok(Self {
            csv: outputs.add_any("--csv", args.csv.as_ref(), &[])?,
            charts,
            pin: args.pin.as_ref().map(|pin| outputs.adds_to("--pin", pin, &[])).transpose()?,
            trace: outputs.add_any("--trace", args.trace.as_ref(), &[])?,
        })
    }
}
