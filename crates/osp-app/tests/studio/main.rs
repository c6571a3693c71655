//! The window without a display: the effects of the pointer, the keys and a tracker on a session.

mod altering;
mod authors;
mod brushes;
mod cancelling;
mod drawing;
mod drawing_aids;
mod edits;
mod exporting;
mod filming;
mod fingers;
mod groups;
mod hands;
mod keeping;
mod kept_views;
mod limits;
mod looking;
mod menus;
mod paint_layers;
mod panel;
mod rigs;
mod spans;
mod tracker;
mod turns;
mod walls;
mod working;
