//! The files that `osp replay` writes.

use std::path::{Path, PathBuf};

use anyhow::bail;

use super::{
    outputs::{Output, Outputs},
    replay_args::ReplayArgs,
};
use osp_lab::report::ChartFormat;
use osp_session::{atomic_file::Destination, output_file::OutputKind};

/// The outputs of a replay.
pub(super) struct ReplayOutputs {
    pub(super) csv: Option<Output>,
    /// One for each session, or none.
    pub(super) charts: Vec<Output>,
    pub(super) pin: Option<Output>,
    #[cfg_attr(not(feature = "window"), expect(dead_code, reason = "only a window writes it"))]
    pub(super) trace: Option<Output>,
}

impl ReplayOutputs {
    pub(super) fn checked(args: &ReplayArgs) -> anyhow::Result<Self> {
        let mut outputs = Outputs::new(args.force).reads(&args.files).reads(&args.check).reads(&args.pvs);
        outputs = outputs.reads(&args.rig.screens.file());
        outputs = outputs.reads(&args.world.path).reads(&args.world.folder());
        if let Some(path) = &args.pin
            && matches!(Destination::of(path), Ok(Destination::Special(_)))
        {
            bail!(
                "{}: pins are added to what is there: expected a regular file; found a pipe or a device",
                path.display()
            );
        }
        let mut charts = Vec::new();
        if let Some(path) = &args.chart {
            let kind = match ChartFormat::of(path)? {
                ChartFormat::Png => OutputKind::Png,
                ChartFormat::Svg => OutputKind::Svg,
            };
            for number in 1..=args.files.len() {
                let path = if args.files.len() == 1 { path.clone() } else { numbered(path, number) };
                charts.push(outputs.add("--chart", &path, kind)?);
            }
        }
        Ok(Self {
            csv: outputs.add_any("--csv", args.csv.as_ref(), OutputKind::Csv)?,
            charts,
            pin: outputs.add_any("--pin", args.pin.as_ref(), OutputKind::Pins)?,
            trace: outputs.add_any("--trace", args.trace.as_ref(), OutputKind::Trace)?,
        })
    }
}

/// `frames.png` as `frames-2.png`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(ending) => format!("{stem}-{number}.{}", ending.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    path.with_file_name(name)
}
