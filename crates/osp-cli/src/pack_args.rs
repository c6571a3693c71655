//! The arguments of `osp pack`.

use std::path::PathBuf;

use clap::Args;

use super::{numbers, reading::ReadArgs};

/// Names of the orders in which polygons fill blocks.
const ORDERS: [&str; 2] = ["strokes", "space"];

/// Pack finished sessions into a world that may be larger than memory, for `osp replay --world`.
///
/// The final polygons of each session become blocks of up to 4,096 polygons. An object (a file of a folder) holds 64
/// blocks. A manifest has the box, size and checksum of each block. The command writes the manifest last; without it,
/// the world cannot be opened. After an interruption, the next `osp pack` to the same address removes the incomplete
/// world.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp pack recordings/*.ron --out sketches.world
  osp pack room.tilt --out city.world --repeat 20x1x20
  osp pack *.tilt --out s3://bucket/world   (needs the feature `worlds-cloud`)

--repeat fills a grid of places along x, y and z with the sessions in turn, to make larger worlds for measurements.
For an s3:// address, osp reads the keys and the region from AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION \
and AWS_ENDPOINT.")]
pub(super) struct PackArgs {
    /// The sessions, of any format that replay reads.
    #[arg(required = true)]
    pub(super) files: Vec<PathBuf>,
    /// The folder for the world, or an s3:// address.
    #[arg(long, value_name = "DIR|URL")]
    pub(super) out: String,
    /// Order in which polygons fill blocks: along a curve through `space`, or in the order in which they were drawn
    /// (`strokes`).
    #[arg(long, value_name = "ORDER", default_value = "space", value_parser = ORDERS)]
    pub(super) order: String,
    /// Fill a grid of N by M by K places (along x, y and z) with the sessions in turn.
    #[arg(long, value_name = "NxMxK", value_parser = numbers::grid)]
    pub(super) repeat: Option<[u32; 3]>,
    /// Distance between neighbouring places of --repeat, metres [default: 1.1 times the longest side of the largest
    /// session].
    #[arg(long, value_name = "METRES", requires = "repeat", value_parser = numbers::metres)]
    pub(super) spacing: Option<f32>,
    /// Replace an existing world when the new one is complete.
    #[arg(long)]
    pub(super) force: bool,
    #[command(flatten)]
    pub(super) reading: ReadArgs,
}

#[cfg(all(test, feature = "worlds"))]
mod tests {
    use super::*;
    use osp_net::world::PackOrder;

    #[test]
    fn the_names_are_those_of_the_orders() {
        assert!(PackOrder::ALL.iter().map(|order| order.name()).eq(ORDERS));
        assert!(PackOrder::default().name() == "space");
    }
}
