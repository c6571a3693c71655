//! `osp bench --paper`: the experiments of the paper.

use super::{bench_paper_args::PaperArgs, output::warn};
use osp_lab::{
    Contender,
    bench::{Adapter, PaperConfig},
};
use osp_rivals::IndexKind;

/// Number of polygons of the synthetic session, which is used if no session is named.
pub(super) const SYNTHETIC: u32 = 20_000;

impl PaperArgs {
    pub(super) fn config(&self, is_quick: bool, index: &[Contender], reference: IndexKind) -> PaperConfig {
        let or = |given: &[u32], usual: &[u32]| if given.is_empty() { usual } else { given }.to_vec();
        let depths: &[u32] = if is_quick { &[3, 6, 9, 12] } else { &[3, 6, 9, 12, 15, 18] };
        PaperConfig {
            kinds: if index.is_empty() { PaperConfig::USUAL.into() } else { index.into() },
            reference,
            depths: or(&self.depth, depths),
            cubes: if self.cube.is_empty() { vec![0.5, 1.0, 2.0, 4.0] } else { self.cube.clone() },
            frames: if is_quick { 60 } else { 360 },
            verified: if is_quick { 2 } else { 6 },
            occluders: self.occluders,
            node_test: self.tests.node_test(),
            score: self.tests.score(),
        }
    }

    /// Opens the adapter that draws. `None` without `--draw`. Prints a warning and returns `None` if the machine has no
    /// adapter.
    pub(super) fn adapter(&self) -> Option<Adapter> {
        let (width, height) = self.draw?;
        match Adapter::open(width, height) {
            Ok(adapter) => {
                warn(&format!("drawn by {}", adapter.name()));
                Some(adapter)
            }
            Err(why) => {
                warn(&format!(
                    "warning: nothing is drawn, the times are of insertion and culling alone: {why}"
                ));
                None
            }
        }
    }
}
