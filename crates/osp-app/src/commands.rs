//! The commands of the studio. Each file has a part of the methods of [`Studio`](crate::Studio).

mod altering;
mod asking;
mod carry_out;
mod exporting;
mod filming;
mod frames;
mod groups;
mod paint_layers;
mod working;
