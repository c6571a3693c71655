//! What is on the window beside the model: tools, dialogs, times and counts; and what the pointer does on the model.
//!
//! Everything here is egui and nothing needs a window or a GPU, so that it can be tested as it is.

mod brushes;
mod canvas;
mod dialog;
mod interface;
mod keys;
mod numbers;
mod plot;
mod questions;
mod replay_bar;
mod tools;
mod wishes;

pub use brushes::PreviewGrid;
pub use interface::Interface;
pub use keys::{Action, HINTS, SHORTCUTS, Shortcut};
