//! What the studio does with pointer, fingers and tracker: each file is a part of [`Studio`](crate::Studio).

mod drawing_aids;
mod fingers;
mod handles;
mod listen;
mod pointer;
mod spans;
