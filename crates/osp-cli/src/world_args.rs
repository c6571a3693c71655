//! The arguments of `osp replay --world`.

use std::path::PathBuf;

use clap::Args;

use super::numbers;

/// Options of a replay that do not apply to worlds.
const NOT_OF_WORLDS: [&str; 21] = [
    "index",
    "depth",
    "cube",
    "cut_nodes",
    "buckets",
    "leaf",
    "morton_bits",
    "budget",
    "occlusion",
    "occluders",
    "node_test",
    "score",
    "polygon_ns",
    "groups",
    "chart",
    "check",
    "pin",
    "rig",
    "stereo",
    "draw",
    "window",
];

/// A world in place of sessions.
#[derive(Args, Clone, Debug)]
pub(super) struct WorldArgs {
    /// Fly through a world that `osp pack` has made, instead of playing sessions: a folder, or (feature `worlds-cloud`)
    /// an http://, https:// or s3:// address. The only other options that apply are --camera, --pace, --csv, --json and
    /// the options of worlds.
    #[arg(long, value_name = "DIR|URL", conflicts_with_all = NOT_OF_WORLDS)]
    pub(super) world: Option<String>,
    /// With --world: largest number of bytes of blocks in memory; k, M and G stand for 2^10, 2^20 and 2^30.
    #[arg(long, value_name = "BYTES", default_value = "1G", requires = "world", value_parser = numbers::bytes)]
    pub(super) memory: u64,
    /// With --world: wait in each frame for all blocks in view. A replay of the same sessions in memory then has the
    /// same fingerprint. Without --wait, a frame omits and counts the missing blocks.
    #[arg(long, requires = "world")]
    pub(super) wait: bool,
    /// With --world: fly along the recorded head path of this session, cut into frames by --pace.
    #[arg(long, value_name = "FILE", requires = "world")]
    pub(super) path: Option<PathBuf>,
    /// With --world: number of frames [default: 900; with --path: all frames].
    #[arg(long, value_name = "N", requires = "world", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    pub(super) frames: Option<u64>,
    /// With --world: seed of the synthetic flight, which is the default without --path and --camera.
    #[arg(long, value_name = "S", default_value_t = 1, requires = "world", conflicts_with = "path")]
    pub(super) seed: u64,
    /// With --world: speed of the synthetic flight, metres in 90 frames [default: the world's longest side in 10 s].
    #[arg(long, value_name = "METRES", requires = "world", conflicts_with = "path", value_parser = numbers::metres)]
    pub(super) speed: Option<f32>,
    /// With --world: greatest distance of visible polygons, metres [default: unlimited].
    #[arg(long, value_name = "METRES", requires = "world", value_parser = numbers::metres)]
    pub(super) far: Option<f32>,
    /// With --world: also load the blocks that will be in view up to this many frames later; 0 loads nothing ahead.
    #[arg(long, value_name = "FRAMES", default_value_t = 30, requires = "world", value_parser = clap::value_parser!(u16).range(..=900))]
    pub(super) prefetch: u16,
    /// With --world: frames a second; 0 plays without pauses, as --wait does.
    #[arg(long, value_name = "N", default_value_t = 90, requires = "world", conflicts_with = "wait", value_parser = clap::value_parser!(u16).range(..=1000))]
    pub(super) rate: u16,
    /// With --world: number of threads that load blocks.
    #[arg(long, value_name = "N", default_value_t = 2, requires = "world", value_parser = clap::value_parser!(u16).range(1..=64))]
    pub(super) loaders: u16,
}

impl WorldArgs {
    /// Returns the folder of the world. `None` for an address.
    pub(super) fn folder(&self) -> Option<PathBuf> {
        self.world.as_ref().filter(|world| !world.contains("://")).map(PathBuf::from)
    }
}

/// Returns the last part of the address.
#[cfg(feature = "worlds")]
pub(super) fn world_name(address: &str) -> String {
    address.trim_end_matches('/').rsplit('/').next().unwrap_or(address).to_owned()
}
