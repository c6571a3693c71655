//! Worlds: finished sessions that may be larger than memory, stored as blocks in a folder or at an address.
//!
//! ```text
//! Scene ──> WorldWriter ──> blocks of 4,096 polygons in larger objects, and last of all the manifest
//!
//! World: the manifest in memory, the boxes of all blocks in an index of their own
//!   a View ──> blocks in view ──┬─ resident: culled polygon by polygon, sixteen boxes at a time
//!                               └─ missing:  loaded by threads ──> cache of resident blocks (bounded in bytes)
//! ```
//!
//! [`WorldWriter`] packs a world, [`World::open`] opens it, [`Walk`] culls it frame by frame. Depends on
//! [`scene`](osp_session::scene), [`index`](osp::index), [`view`](osp::view) and [`replay`](osp_session::replay).
//!
//! * **Conservative.** A block is skipped only if its box, which contains all its polygons, is outside the frustum. A
//!   frame counts the missing blocks in view.
//! * **Exact.** A frame that waits for its blocks has the same polygons as the same sessions in memory.
//! * **Complete or not at all.** The manifest is written after all blocks, in one step. Without it, the place contains no
//!   world.
//! * **Bounded.** The counts in a manifest or a block are compared with its size before memory is reserved for them. At
//!   most the requested number of bytes is read from a server.

mod block;
mod boxes;
mod bytes;
mod error;
mod flight;
mod loaders;
mod lock;
mod manifest;
mod open_world;
mod order;
mod place;
mod resident;
mod walk;
mod writer;

pub use block::{BLOCK_POLYGONS, Block, Piece};
pub use error::WorldError;
pub use flight::Flight;
pub use manifest::{BlockEntry, Manifest, Source};
pub use open_world::World;
pub use order::PackOrder;
pub use place::Place;
pub use resident::ResidentConfig;
pub use walk::{Frame, Missing, Walk, WalkCounts};
pub use writer::{Packed, Replacing, WorldWriter};
