//! Tests of the recording format and of the synthetic sessions.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod alteration;
mod authors;
mod camera;
mod damage;
mod events;
mod format;
mod limits;
mod look;
mod synth;
mod writer;
