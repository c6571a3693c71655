//! The window without a display: the effects of the pointer, the keys and a tracker on a session.

mod altering;
mod authors;
mod brushes;
mod drawing;
mod drawing_aids;
mod dtrack;
mod edits;
mod exporting;
mod fingers;
mod groups;
mod hands;
mod keeping;
mod kept_views;
mod limits;
mod menus;
mod occlusion_steps;
mod paint_layers;
mod panel;
mod rigs;
mod senders;
mod spans;
mod tests_of_occlusion;
mod tracker;
mod turns;
mod walls;
mod working;
