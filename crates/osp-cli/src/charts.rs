//! The charts of `osp replay --chart`.

use std::path::{Path, PathBuf};

use super::{
    output::warn,
    outputs::{Output, Outputs},
    replay_args::ReplayArgs,
};
use osp_lab::report::{ChartError, ChartFormat, ReplayReport, draw_frame_times};

/// The chart files, one for each session. None without `--chart`.
pub(super) struct Charts(Vec<Output>);

impl Charts {
    pub(super) fn checked(args: &ReplayArgs, outputs: &mut Outputs) -> anyhow::Result<Self> {
        let Some(path) = &args.chart else { return Ok(Self(Vec::new())) };
        ChartFormat::of(path)?;
        let mut charts = Vec::new();
        for number in 1..=args.files.len() {
            let path = if args.files.len() == 1 { path.clone() } else { numbered(path, number) };
            charts.push(outputs.add("--chart", &path, &[])?);
        }
        Ok(Self(charts))
    }

    /// Draws a chart of a session's frame times.
    pub(super) fn draw(&self, session: usize, report: &ReplayReport) -> anyhow::Result<()> {
        let Some(chart) = self.0.get(session) else { return Ok(()) };
        chart.check()?;
        match draw_frame_times(report, chart.path()) {
            Err(nothing @ ChartError::Empty(_)) => warn(&format!("warning: {nothing}")),
            outcome => outcome?,
        }
        Ok(())
    }
}

/// Appends a number to the name: `frames.png` becomes `frames-2.png`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = match path.extension() {
        Some(ending) => format!("{stem}-{number}.{}", ending.to_string_lossy()),
        None => format!("{stem}-{number}"),
    };
    path.with_file_name(name)
}
