//! osp over a network: several authors in one session ([`live`]), walls of screens ([`wall`]), worlds that are larger than
//! memory ([`world`]).

#[cfg(all(feature = "live", not(target_arch = "wasm32")))]
pub mod live;
#[cfg(all(feature = "live", not(target_arch = "wasm32")))]
pub mod wall;
#[cfg(feature = "worlds")]
pub mod world;
