//! Options of a member of a shared session: server and name.

use std::path::PathBuf;

use clap::Args;

use osp_session::recording::Author;

/// Address of a server, and access to it.
#[derive(Args, Debug)]
pub(super) struct ServerArgs {
    /// A file of one line with the credentials for the server: a token or USER:PASSWORD.
    #[arg(long, value_name = "FILE")]
    pub(super) credentials: Option<PathBuf>,
    /// Certificates (PEM) of authorities to trust in addition to those of the system.
    #[arg(long, value_name = "FILE")]
    pub(super) tls_ca: Option<PathBuf>,
    /// Allow an unencrypted connection to another machine. Everybody between the two machines can then read and change
    /// the drawing.
    #[arg(long)]
    pub(super) unencrypted: bool,
}

/// Parses the name of an author.
pub(super) fn name(text: &str) -> Result<String, String> {
    match text.len() <= Author::MAX_NAME_BYTES {
        true => Ok(text.to_owned()),
        false => Err(format!("expected a name of at most {} bytes", Author::MAX_NAME_BYTES)),
    }
}
