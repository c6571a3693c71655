//! The fast form of the octal space partition tree.

mod file;
mod grid;
mod ids;
mod index;
mod layout;
mod open;
mod pages;
mod pool;
mod query;
mod remove;
mod tuning;
mod validate;
mod visit;

pub use index::Osp;
