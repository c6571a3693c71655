//! `osp serve`: a folder for a browser on this machine.

use std::path::PathBuf;

use clap::Args;

use super::Outcome;

/// Serve a folder to browsers on this machine: the page that `web/build` makes in `web/dist`, or another one.
///
/// Requests of other machines are not answered. Each answer has the headers that isolate a page from pages of other sites,
/// which browsers ask for before they give it a clock in steps of 5 µs. A request for a part of a file gets that part. Text,
/// WebAssembly and models are compressed for those who take gzip. Files and folders whose names begin with a dot are not served.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp serve
  osp serve web/dist --port 8000

It is in builds with the feature `serve` (cargo install --path . --features serve).")]
#[cfg_attr(not(feature = "serve"), expect(dead_code, reason = "this build serves nothing"))]
pub(super) struct ServeArgs {
    /// The folder.
    #[arg(default_value = "web/dist", value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// The port; 0 takes a free one.
    #[arg(long, default_value_t = 9328)]
    pub(super) port: u16,
}

#[cfg(feature = "serve")]
pub(super) fn run(args: &ServeArgs) -> anyhow::Result<Outcome> {
    super::serve_http::run(args)
}

#[cfg(not(feature = "serve"))]
pub(super) fn run(_: &ServeArgs) -> anyhow::Result<Outcome> {
    super::not_built::refuse("serve", "serve")
}
