//! The window without a window: what the pointer, the keys and a tracker do to a session.
#![cfg(feature = "window")]

#[path = "studio/brushes.rs"]
mod brushes;
#[path = "studio/drawing.rs"]
mod drawing;
#[path = "studio/exporting.rs"]
mod exporting;
#[path = "studio/groups.rs"]
mod groups;
#[path = "studio/hands.rs"]
mod hands;
#[path = "studio/keeping.rs"]
mod keeping;
#[path = "studio/limits.rs"]
mod limits;
#[path = "studio/panel.rs"]
mod panel;
#[path = "studio/rigs.rs"]
mod rigs;
#[path = "studio/spans.rs"]
mod spans;
#[path = "studio/tests_of_occlusion.rs"]
mod tests_of_occlusion;
#[path = "studio/tracker.rs"]
mod tracker;
