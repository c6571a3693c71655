//! Options of every command that reads a session.

use std::path::Path;

use anyhow::ensure;
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};

use osp_session::{
    recording::{Limits, OpenOptions, Pace, Up, unit_m},
    replay::Summary,
};

/// Options for damaged sessions, and limits of a session.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct ReadArgs {
    /// Skip and count damaged parts, instead of stopping at the first damage. If a session exceeds a limit
    /// (--max-polygons), use the part before the limit.
    #[arg(long)]
    pub(super) lenient: bool,
    /// The axis of an .obj that points up [default: what its comments say, else y].
    #[arg(long, value_name = "AXIS", value_parser = up_parser(), hide_short_help = true)]
    up: Option<Up>,
    /// The unit of an .obj: m, cm, mm, km, in, ft or yd [default: what its comments say, else m].
    #[arg(long, value_name = "UNIT", value_parser = unit, hide_short_help = true)]
    unit: Option<f64>,
    #[command(flatten)]
    limits: LimitArgs,
}

fn up_parser() -> impl TypedValueParser<Value = Up> {
    PossibleValuesParser::new(["y", "z"]).map(|name| if name == "z" { Up::Z } else { Up::Y })
}

fn unit(name: &str) -> Result<f64, String> {
    unit_m(name).ok_or_else(|| "expected m, cm, mm, km, in, ft or yd".to_owned())
}

/// Limits of a session.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct LimitArgs {
    /// Largest number of polygons of a session. A ribbon sample counts as 1, a tube sample as 8, a face with n corners
    /// as n - 2. N also limits a session to N/4 strokes and 4N events, and the unpacking of a compressed session (.ron.zst,
    /// .tilt, .gz): 32 bytes from each byte, and more in proportion if N is above the default.
    #[arg(
        long,
        value_name = "N",
        default_value_t = Limits::DEFAULT.polygons,
        value_parser = clap::value_parser!(u64).range(1..=u64::from(u32::MAX)),
        hide_short_help = true
    )]
    max_polygons: u64,
}

impl LimitArgs {
    pub(super) fn limits(&self) -> Limits {
        let times = (self.max_polygons / Limits::DEFAULT.polygons).max(1);
        Limits { polygons: self.max_polygons, unpacking: Limits::DEFAULT.unpacking * times }
    }
}

impl ReadArgs {
    pub(super) fn options(&self) -> OpenOptions {
        OpenOptions { lenient: self.lenient, limits: self.limits.limits(), up: self.up, unit_m: self.unit }
    }

    /// Returns an error if the time stamps of a session result in more frames than the limits allow.
    pub(super) fn check_frames(&self, file: &Path, summary: &Summary, pace: Pace) -> anyhow::Result<()> {
        let most = self.limits.limits().frames();
        ensure!(
            summary.frames <= most || pace != Pace::Recorded,
            "{}: expected at most {most} frames at the pace {pace} (--max-polygons N allows half as many); found {}: \
             --pace samples:16 counts samples instead",
            file.display(),
            summary.frames
        );
        Ok(())
    }
}
