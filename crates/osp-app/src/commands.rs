//! The commands of the studio. Each file has a part of the methods of [`Studio`](crate::Studio).

mod carry_out;
mod exporting;
mod working;
