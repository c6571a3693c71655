//! Input from pointer, fingers and tracker. Each file has a part of the methods of [`Studio`](crate::Studio).

mod drawing_aids;
mod fingers;
mod handles;
mod listen;
mod pointer;
mod spans;
