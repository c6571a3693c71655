//! Options of several commands: node tests and occluder scores of occlusion culling.

use clap::{Args, builder::TypedValueParser};

use super::parsers::named;
use osp::occlusion::{NodeTest, Score};

/// Options of the commands that cull by occlusion.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct TestArgs {
    /// Volume by which occlusion culling tests a node of the index: its `box`, the `sphere` around it (as in the paper),
    /// or whether all eight `corners` lie in one shadow [default: box].
    #[arg(long, value_name = "VOLUME", value_parser = named(&NodeTest::ALL, NodeTest::name))]
    node_test: Option<NodeTest>,
    /// Score of an occluder: the `solid-angle` of its part in view, or equation (1) of the `paper` [default: solid-angle].
    #[arg(long, value_name = "SCORE", value_parser = score_parser())]
    score: Option<Score>,
}

impl TestArgs {
    pub(super) fn node_test(self) -> NodeTest {
        self.node_test.unwrap_or(NodeTest::Box)
    }

    pub(super) fn score(self) -> Score {
        self.score.unwrap_or_default()
    }

    /// Returns the first option that was given.
    pub(super) fn given(self) -> Option<&'static str> {
        let node_test = self.node_test.map(|_| "--node-test");
        node_test.or(self.score.map(|_| "--score"))
    }
}

pub(super) fn score_parser() -> impl TypedValueParser<Value = Score> {
    named(&Score::ALL, Score::name)
}
