//! osp over a network: several authors in one session ([`live`]), worlds that are larger than memory
//! ([`world`]).

#[cfg(all(feature = "live", not(target_arch = "wasm32")))]
pub mod live;
#[cfg(feature = "worlds")]
pub mod world;
