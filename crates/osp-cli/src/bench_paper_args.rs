//! The arguments of `osp bench --paper`.

use clap::{Args, ValueEnum};

use super::{numbers, structure_args::TestArgs};
use osp::occlusion::SelectConfig;
use osp_rivals::MAX_MAX_DEPTH;

/// Whether `--paper` also runs the other parts of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PaperParts {
    /// Only the paper's experiments.
    Alone,
    /// Also the other parts of the report.
    Also,
}

/// Options of the paper's experiments.
#[derive(Args, Debug)]
pub(super) struct PaperArgs {
    /// Repeat the experiments of the paper, on a synthetic session if none is given. They run alone, or after the other
    /// parts (`--paper=also`).
    #[arg(long, value_name = "WHICH", num_args = 0..=1, default_missing_value = "alone", require_equals = true)]
    paper: Option<PaperParts>,
    /// With --paper: draw the frames on the graphics adapter, so that their times include drawing [default size: 1280x720].
    /// Without an adapter, or without the feature `render`, osp draws nothing and reports that.
    #[arg(long, value_name = "WxH", num_args = 0..=1, default_missing_value = "1280x720", require_equals = true,
        requires = "paper", value_parser = size)]
    pub(super) draw: Option<(u32, u32)>,
    /// With --paper: maximum depths of the paper's tree in binary levels. Separate them by commas [default: 3,6,9,12,15,18;
    /// with --quick up to 12]. If there is a single depth, the other experiments also use it; else they use 15.
    #[arg(long, value_delimiter = ',', requires = "paper", value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_MAX_DEPTH)))]
    pub(super) depth: Vec<u32>,
    /// With --paper: edges of the cube of the paper's tree, as multiples of the session's cube, separated by commas
    /// [default: 0.5,1,2,4]. If there is a single value, the other experiments also use it; else they use 1.
    #[arg(long, value_delimiter = ',', requires = "paper", value_parser = numbers::multiple)]
    pub(super) cube: Vec<f32>,
    /// With --paper: largest number of occluders in a frame.
    #[arg(long, value_name = "N", default_value_t = SelectConfig::default().occluders, requires = "paper",
        value_parser = numbers::occluders)]
    pub(super) occluders: usize,
    #[command(flatten)]
    pub(super) tests: TestArgs,
}

fn size(text: &str) -> Result<(u32, u32), String> {
    numbers::sides(text, &(1..=16_384))
}

impl PaperArgs {
    pub(super) fn is_given(&self) -> bool {
        self.paper.is_some()
    }

    /// Whether to measure nothing else.
    pub(super) fn is_alone(&self) -> bool {
        self.paper == Some(PaperParts::Alone)
    }
}
