//! Options of a member of a shared session: server and name.

use std::path::PathBuf;

use clap::Args;

use osp_session::recording::Author;

/// Address of a server and access to it.
#[derive(Args, Debug)]
pub(super) struct ServerArgs {
    /// A file with who one is to the server: one line, a token or USER:PASSWORD.
    #[arg(long, value_name = "FILE")]
    pub(super) credentials: Option<PathBuf>,
    /// Certificates (PEM) of authorities to trust beside those of the system.
    #[arg(long, value_name = "FILE")]
    pub(super) tls_ca: Option<PathBuf>,
    /// Go to another machine unencrypted: everybody on the way may read and change what is drawn.
    #[arg(long)]
    pub(super) unencrypted: bool,
}

/// An author's name for the others.
pub(super) fn name(text: &str) -> Result<String, String> {
    match text.len() <= Author::MAX_NAME_BYTES {
        true => Ok(text.to_owned()),
        false => Err(format!("expected a name of at most {} bytes", Author::MAX_NAME_BYTES)),
    }
}
