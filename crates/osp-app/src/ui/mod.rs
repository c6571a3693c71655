//! The window's panels around the model: tools, dialogs, times and counts. The module also passes the pointer's events
//! over the model to the studio.
//!
//! egui lays out the panels without a window or a GPU, so tests run them directly.

mod actions;
mod authors;
mod brushes;
mod calibrating;
mod canvas;
mod dialog;
mod fields;
mod groups;
mod help;
mod interface;
mod keys;
mod menu;
mod numbers;
#[cfg(feature = "live")]
mod others;
mod paint_layers;
mod panel_commands;
mod plot;
mod questions;
mod recent;
mod replay_bar;
mod room;
mod selected;
mod status;
mod tools;

pub use brushes::PreviewGrid;
pub use interface::Interface;
