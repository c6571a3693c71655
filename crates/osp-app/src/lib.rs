//! The sketch and replay window.
//!
//! ```text
//! pointer, keys, tracker ──> Studio ──> Event ──> Session ──> Scene  ──> Culling ──> Painter
//!                              │                  (its file)            (index)     (GPU)
//! egui ──────────────────── Interface
//! ```
//!
//! Strokes become the same [`Event`](osp_session::recording::Event)s that a replay reads, and take the same path
//! through the scene and the index. [`Studio`] contains everything except the window and the GPU. [`ui`] has the
//! panels, laid out by egui. [`run`] shows both in a window.
//!
//! This crate may depend on all others except `osp-cli`.

#![allow(missing_docs, reason = "only this workspace uses the crate; many names need no comment")]

pub use egui;

mod altering;
mod command;
mod commands;
mod culling;
mod draw_cost;
mod drawing_aids;
mod film_maker;
mod fingers;
mod gestures;
mod groups;
mod handles;
mod input;
mod journal;
#[cfg(test)]
mod jump_tests;
mod layers;
mod navigator;
#[cfg(target_arch = "wasm32")]
pub mod page;
mod paint_layers;
mod painter;
mod pen;
mod previews;
mod question;
mod room;
mod selection;
mod session;
mod settings;
mod spans;
mod stats;
mod studio;
mod test_pattern;
mod threads;
mod tool;
mod trace;
pub mod tracker;
mod turns;
pub mod ui;
mod wall_surface;
mod walls;
mod window;
mod working;

pub use altering::Altering;
pub use command::Command;
pub use culling::{Culling, CullingPlan, Indexed, Reindexed, SearchCounts};
pub use drawing_aids::Aids;
pub use film_maker::{FilmMaker, MakeFilm};
pub use fingers::Fingers;
pub use gestures::{Button, Held, Input};
pub use groups::Placing;
pub use journal::{Autosave, Autosaves, Journal, OpenElsewhere, SaveError, Trouble, Unwritten};
pub use layers::LayerChoice;
pub use navigator::Navigator;
pub use paint_layers::{LayerEdit, LayerRow};
pub use pen::{Brush, Pen, Snap};
pub use question::{Answer, Question, Then};
pub use room::{Room, RoomView};
pub use selection::Selection;
pub use session::{Access, Jump, OpenError, Opened, Opening, Replay, ReplayReader, Session};
#[cfg(feature = "live")]
pub use session::{Live, OtherPen, Overlay, Unjoined};
pub use settings::{Settings, Theme};
pub use stats::{FrameStage, FrameTimes, History};
#[cfg(feature = "live")]
pub use studio::OtherInView;
pub use studio::{FrameReport, Studio};
pub use tool::{Span, ToolChoice};
#[cfg(not(target_arch = "wasm32"))]
pub use window::monitors;
pub use window::{MonitorInfo, WindowError, WindowOptions, run};
pub use working::{ReplayStart, WorkShown};
