//! The arguments of `osp serve`.

use std::path::PathBuf;

use clap::Args;

/// Serve a folder to browsers on this machine: the page that `web/build` makes in `web/dist`, or another page.
///
/// Requests from other machines are refused. Each answer has the headers that isolate a page from pages of other sites.
/// Browsers give only such pages a clock with steps of 5 µs. The server answers requests for a part of a file. It
/// compresses text, WebAssembly and models if the browser accepts gzip. Files and folders whose names begin with a dot
/// are not served.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp serve
  osp serve web/dist --port 8000")]
pub(super) struct ServeArgs {
    /// The folder.
    #[arg(default_value = "web/dist", value_name = "DIR")]
    pub(super) folder: PathBuf,
    /// The port; with 0 the system selects a free port.
    #[arg(long, default_value_t = 9328)]
    pub(super) port: u16,
}
