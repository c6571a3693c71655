//! The `osp` program; everything it does is in [`osp::cli`].

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: osp::cli::CountingAllocator = osp::cli::CountingAllocator;

fn main() -> ExitCode {
    osp::cli::run()
}
