//! The `osp` program. Its code is in [`osp_cli`].

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: osp_cli::CountingAllocator = osp_cli::CountingAllocator;

fn main() -> ExitCode {
    osp_cli::run()
}
