//! The window without a window: what the pointer, the keys and a tracker do to a session.

#[path = "studio/altering.rs"]
mod altering;
#[path = "studio/authors.rs"]
mod authors;
#[path = "studio/brushes.rs"]
mod brushes;
#[path = "studio/drawing.rs"]
mod drawing;
#[path = "studio/drawing_aids.rs"]
mod drawing_aids;
#[path = "studio/dtrack.rs"]
mod dtrack;
#[path = "studio/edits.rs"]
mod edits;
#[path = "studio/exporting.rs"]
mod exporting;
#[path = "studio/fingers.rs"]
mod fingers;
#[path = "studio/groups.rs"]
mod groups;
#[path = "studio/hands.rs"]
mod hands;
#[path = "studio/keeping.rs"]
mod keeping;
#[path = "studio/kept_views.rs"]
mod kept_views;
#[path = "studio/limits.rs"]
mod limits;
#[path = "studio/menus.rs"]
mod menus;
#[path = "studio/paint_layers.rs"]
mod paint_layers;
#[path = "studio/panel.rs"]
mod panel;
#[path = "../../../tests/support/repository.rs"]
mod repository;
#[path = "studio/rigs.rs"]
mod rigs;
#[path = "studio/senders.rs"]
mod senders;
#[path = "studio/spans.rs"]
mod spans;
#[path = "studio/tests_of_occlusion.rs"]
mod tests_of_occlusion;
#[path = "studio/tracker.rs"]
mod tracker;
#[path = "studio/turns.rs"]
mod turns;
#[path = "studio/walls.rs"]
mod walls;
#[path = "studio/working.rs"]
mod working;
