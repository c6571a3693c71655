//! osp over a network: several authors in one session ([`live`]).

#[cfg(all(feature = "live", not(target_arch = "wasm32")))]
pub mod live;
