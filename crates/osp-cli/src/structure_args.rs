//! Options of several commands: settings of the structures, node tests and occluder scores of occlusion culling.

use std::ops::RangeInclusive;

use anyhow::{bail, ensure};
use clap::{Args, builder::TypedValueParser};

use super::{numbers, parsers::named};
use osp::occlusion::{NodeTest, Score};
use osp_rivals::{CutNodes, IndexKind, IndexSetting, IndexSettings, REBUILDS};

/// Settings of the structures.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct IndexSettingsArgs {
    /// For osp-paper and octree-paper: number of levels below the root, 0 to 21 [default of osp-paper: 15; of
    /// octree-paper: 10]. A node of osp-paper has two children, so each level doubles the memory (12 MB at 15 levels).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(integers(IndexSettings::DEPTHS)))]
    depth: Option<u32>,
    /// For osp-paper: edge of its cube, as a multiple of the session's cube, 0.01 to 100 [default: 1]. Polygons that are
    /// not wholly in the cube are tested one by one.
    #[arg(long, value_name = "X", value_parser = numbers::multiple)]
    cube: Option<f32>,
    /// For bvh-sah, hlbvh, bvh-two-level and octree-bvh: number of buckets of an axis for the surface area heuristic, 2 to
    /// 32 [default: 12].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(integers(IndexSettings::BUCKETS)))]
    buckets: Option<u8>,
    /// Largest number of polygons of a leaf, 1 to 4096 [default: 64; octree-paper: 16]. For: octree-rebuild,
    /// octree-paper, octree-every-child, octree-bvh, bvh-midpoint, bvh-median, bvh-sah, bvh-sah-sweep, lbvh, hlbvh,
    /// bvh-two-level, kd-tree, quadtree.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(integers(IndexSettings::LEAF_CAPACITIES)))]
    leaf: Option<u16>,
    /// For lbvh and hlbvh: number of bits of an axis in the Morton codes, 1 to 21 [default: 21].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(integers(IndexSettings::MORTON_BITS)))]
    morton_bits: Option<u32>,
}

/// The option for nodes that the frustum cuts, for commands that show the drawn polygons.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct CutNodesArgs {
    /// For osp-paper and octree-paper: polygons of nodes that the frustum cuts are `tested` one by one, or all `drawn`
    /// as in the paper [default: tested]. `drawn` also draws polygons that are not in view.
    #[arg(long, value_name = "NAME", value_parser = named(&CutNodes::ALL, CutNodes::name))]
    pub(super) cut_nodes: Option<CutNodes>,
}

impl CutNodesArgs {
    /// Adds the option to the settings of these indexes. Returns an error if no index has this setting.
    pub(super) fn add_to(
        self,
        settings: IndexSettings,
        indexes: &[IndexKind],
    ) -> anyhow::Result<IndexSettings> {
        let Some(cut_nodes) = self.cut_nodes else { return Ok(settings) };
        check_concerns(IndexSetting::CutNodes, indexes)?;
        Ok(IndexSettings { cut_nodes, ..settings })
    }
}

impl IndexSettingsArgs {
    /// Returns the settings. An option that concerns none of `indexes` is an error.
    pub(super) fn settings(&self, indexes: &[IndexKind]) -> anyhow::Result<IndexSettings> {
        for (setting, value) in self.all() {
            if value {
                check_concerns(setting, indexes)?;
            }
        }
        let usual = IndexSettings::default();
        Ok(IndexSettings {
            max_depth: self.depth,
            cube: self.cube.unwrap_or(usual.cube),
            buckets: self.buckets.map_or(usual.buckets, usize::from),
            leaf_capacity: self.leaf.map(usize::from),
            morton_bits: self.morton_bits.unwrap_or(usual.morton_bits),
            ..usual
        })
    }

    /// Returns each setting, and whether its option is given.
    fn all(&self) -> [(IndexSetting, bool); 5] {
        [
            (IndexSetting::MaxDepth, self.depth.is_some()),
            (IndexSetting::Cube, self.cube.is_some()),
            (IndexSetting::Buckets, self.buckets.is_some()),
            (IndexSetting::LeafCapacity, self.leaf.is_some()),
            (IndexSetting::MortonBits, self.morton_bits.is_some()),
        ]
    }
}

/// Returns an error if a setting concerns none of these indexes. The error names the option and the indexes that have
/// the setting.
fn check_concerns(setting: IndexSetting, indexes: &[IndexKind]) -> anyhow::Result<()> {
    if indexes.iter().any(|kind| kind.has(setting)) {
        return Ok(());
    }
    let names = |kinds: &mut dyn Iterator<Item = IndexKind>| {
        kinds.map(IndexKind::name).collect::<Vec<_>>().join(", ")
    };
    let having = names(&mut IndexKind::ALL.iter().copied().filter(|kind| kind.has(setting)));
    let given = names(&mut indexes.iter().copied());
    let option = setting.name();
    bail!("--{option} is a setting of {having}: expected --index with one of them; found {given}")
}

/// Converts a range to the integer type that clap expects.
fn integers<N: Copy + TryInto<i64>>(range: RangeInclusive<N>) -> RangeInclusive<i64> {
    let of = |n: &N| (*n).try_into().unwrap_or(i64::MAX);
    of(range.start())..=of(range.end())
}

/// The option for the times at which octree-rebuild is built.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct RebuildArgs {
    /// When octree-rebuild builds its tree: once a `frame` with changes; for each `insert`, as in the paper; on another
    /// `thread`; in every `nth` (16th) frame [default: frame]. The last two test the polygons that the tree lacks in a list.
    /// Several values, separated by commas, are several indexes.
    #[arg(long, value_name = "WHEN", value_delimiter = ',', value_parser = named(&REBUILDS, |when| when.0))]
    rebuild: Vec<(&'static str, IndexKind)>,
}

impl RebuildArgs {
    /// Returns the indexes, with those of --rebuild in place of octree-rebuild.
    pub(super) fn expand<T: Copy + PartialEq>(&self, indexes: &[T], of: fn(IndexKind) -> T) -> Vec<T> {
        let expanded = |&index: &T| match index == of(IndexKind::OctreeRebuild) && !self.rebuild.is_empty() {
            true => self.rebuild.iter().map(|(_, kind)| of(*kind)).collect(),
            false => vec![index],
        };
        indexes.iter().flat_map(expanded).collect()
    }

    pub(super) fn check(&self, has_octree: bool) -> anyhow::Result<()> {
        ensure!(
            self.rebuild.is_empty() || has_octree,
            "--rebuild is a setting of octree-rebuild: expected --index with it"
        );
        Ok(())
    }
}

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
