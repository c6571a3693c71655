//! Options for the connection to a shared session, and the end of a command on a signal.

#[cfg(unix)]
use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use super::join_args::ServerArgs;
use osp_net::live::{Address, Credentials, Role, Who};

impl ServerArgs {
    /// Parses an address, and adds the credentials from a file. Errors do not contain the password.
    pub(super) fn address(&self, typed: &str) -> anyhow::Result<Address> {
        let mut address: Address = typed.parse()?;
        if let Some(path) = &self.credentials {
            address.credentials = Credentials::read(path)?;
        }
        if !self.unencrypted {
            address.check_way()?;
        }
        Ok(address)
    }

    /// Whether any of the options was given.
    #[cfg(feature = "window")]
    pub(super) fn is_given(&self) -> bool {
        self.credentials.is_some() || self.unencrypted
    }
}

/// Returns the role of an author with this name, or of a watcher.
pub(super) fn role(watches: bool, name: &str) -> Role {
    match watches {
        true => Role::Watcher,
        false => Role::Author(Who { name: name.to_owned(), color: None }),
    }
}

/// Makes Ctrl-C and other signals end the program in the normal way, within `time`.
#[cfg(unix)]
pub(super) fn end_on_signals(ending: &Arc<AtomicBool>, time: Duration) {
    let ending = Arc::clone(ending);
    osp_session::atomic_file::on_signal(Some(Box::new(move || {
        // The program normally ends during this time. If not, the signal ends it.
        ending.store(true, Ordering::Relaxed);
        thread::sleep(time);
    })));
}
