//! osp over a network: several authors in one session ([`live`]).

#![allow(
    missing_docs,
    reason = "a name without a comment says all: no unit, space, bound or error is to add"
)]

#[cfg(all(feature = "live", not(target_arch = "wasm32")))]
pub mod live;
