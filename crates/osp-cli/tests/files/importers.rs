//! The readers of foreign formats: what they make of real files (where `OSP_CORPUS` names a folder of them), of small
//! files written here, and of damaged ones.
#![allow(
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test stops where its files cannot be written"
)]

mod bombs;
mod brushes;
mod command;
mod corpus;
mod damage;
pub(crate) mod files;
mod forged;
mod gltf;
mod in_memory;
mod left_out;
mod limits;
mod messages;
mod metadata;
mod models;
mod tilt;
mod values;
mod written;
