//! Input from pointer, fingers and tracker. Each file has a part of the methods of [`Studio`](crate::Studio).

mod listen;
mod pointer;
