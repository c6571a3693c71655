//! What the studio does at a command: each file is a part of [`Studio`](crate::Studio).

mod altering;
mod asking;
mod carry_out;
mod frames;
mod groups;
mod paint_layers;
mod working;
