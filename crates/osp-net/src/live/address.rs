//! The address of a shared session, `nats://HOST[:PORT]/NAME`, and the credentials for its server.

use std::fmt;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use thiserror::Error;
use url::{Host, Url};

use osp_session::small_file::read_text;

/// The default port of NATS servers.
const PORT: u16 = 4222;

/// Largest size of a file of credentials, bytes.
const CREDENTIALS_BYTES: u64 = 4096;

/// An error in an address or in its options.
#[derive(Debug, Error)]
pub enum AddressError {
    /// The text is not the address of a shared session; `found` lacks the parts that may be a password.
    #[error("expected nats://HOST[:PORT]/NAME or tls://HOST[:PORT]/NAME; found `{found}` ({why})")]
    NoAddress { found: String, why: String },
    /// The connection would leave this machine unencrypted, so that others could read and change the packets.
    #[error(
        "{host} is not this machine: expected tls://{host}/…, or --unencrypted if everybody on the way may read and change what is drawn"
    )]
    Unencrypted { host: String },
    /// The file of credentials cannot be read.
    #[error("{}", path.display())]
    File {
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    /// The file does not contain credentials.
    #[error("{}: expected one line, a token or USER:PASSWORD", path.display())]
    NoCredentials { path: PathBuf },
}

/// Credentials for the server.
#[derive(Clone, PartialEq, Eq)]
pub enum Credentials {
    /// No credentials.
    None,
    /// A shared token.
    Token(String),
    /// A user with a password.
    User { name: String, password: String },
}

/// Secrets are not printed.
impl fmt::Debug for Credentials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "None",
            Self::Token(_) => "Token(…)",
            Self::User { .. } => "User(…)",
        })
    }
}

impl Credentials {
    /// Reads a file of one line: a token, or a user's name and password with a colon between them.
    ///
    /// # Errors
    /// The file cannot be read, or has other contents.
    pub fn read(path: &Path) -> Result<Self, AddressError> {
        let text = read_text(path, CREDENTIALS_BYTES)
            .map_err(|cause| AddressError::File { path: path.to_owned(), cause })?;
        let text = text.trim();
        if text.is_empty() || text.contains(char::is_whitespace) {
            return Err(AddressError::NoCredentials { path: path.to_owned() });
        }
        Ok(match text.split_once(':') {
            Some((name, password)) => Self::User { name: name.to_owned(), password: password.to_owned() },
            None => Self::Token(text.to_owned()),
        })
    }
}

/// Address of a shared session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    host: String,
    port: u16,
    pub session: String,
    /// Whether the connection is encrypted (`tls://`).
    pub is_encrypted: bool,
    is_this_machine: bool,
    /// The credentials that the address contains.
    pub credentials: Credentials,
}

impl Address {
    /// Longest name of a session, bytes.
    pub const MAX_NAME_BYTES: usize = 64;

    /// Checks that the connection is encrypted or stays on this machine.
    ///
    /// # Errors
    /// The host is not a loopback address, and the address begins with `nats://`.
    pub fn check_way(&self) -> Result<(), AddressError> {
        if self.is_encrypted || self.is_this_machine {
            return Ok(());
        }
        Err(AddressError::Unencrypted { host: self.host.clone() })
    }

    /// The address of the server in the form that the client library takes.
    pub(super) fn server(&self) -> String {
        let scheme = if self.is_encrypted { "tls" } else { "nats" };
        format!("{scheme}://{}:{}", self.host, self.port)
    }

    /// The name of the stream that is the log of the session.
    pub(super) fn stream(&self) -> String {
        format!("osp-{}", self.session)
    }

    /// The subject of the session's messages.
    pub(super) fn subject(&self) -> String {
        format!("osp.{}", self.session)
    }

    /// The subject of presence messages. The server does not store them.
    pub(super) fn presence(&self) -> String {
        format!("osp-here.{}", self.session)
    }
}

/// Prints the address without the credentials.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.server(), self.session)
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        // The part before an @ may be secret.
        let found = match text.rsplit_once('@') {
            Some((_, rest)) => format!("…@{rest}"),
            None => text.to_owned(),
        };
        let bad = |why: &str| AddressError::NoAddress { found: found.clone(), why: why.to_owned() };
        let url = Url::parse(text).map_err(|error| bad(&error.to_string()))?;
        let is_encrypted = match url.scheme() {
            "nats" => false,
            "tls" => true,
            _ => return Err(bad("another scheme")),
        };
        if url.query().is_some() || url.fragment().is_some() {
            return Err(bad("more after the name"));
        }
        let host = url.host_str().filter(|host| !host.is_empty()).ok_or_else(|| bad("no host"))?.to_owned();
        let session = url.path().strip_prefix('/').unwrap_or_default().to_owned();
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if session.is_empty() || session.len() > Self::MAX_NAME_BYTES || !session.chars().all(is_plain) {
            return Err(bad("the name is 1 to 64 letters, digits, - and _"));
        }
        // For this scheme the parser returns an IPv4 address as a name, so names are parsed again.
        let is_this_machine = match url.host() {
            Some(Host::Ipv4(address)) => address.is_loopback(),
            Some(Host::Ipv6(address)) => address.is_loopback(),
            Some(Host::Domain(name)) => {
                name == "localhost" || name.parse().is_ok_and(|address: IpAddr| address.is_loopback())
            }
            None => false,
        };
        let decoded = |text: &str| {
            percent_encoding::percent_decode_str(text)
                .decode_utf8()
                .map(std::borrow::Cow::into_owned)
                .map_err(|_| bad("credentials that are not UTF-8"))
        };
        let credentials = match (url.username(), url.password()) {
            ("", None) => Credentials::None,
            (token, None) => Credentials::Token(decoded(token)?),
            (name, Some(password)) => {
                Credentials::User { name: decoded(name)?, password: decoded(password)? }
            }
        };
        let port = url.port().unwrap_or(PORT);
        Ok(Self { host, port, session, is_encrypted, is_this_machine, credentials })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> Address {
        text.parse().expect("an address")
    }

    #[test]
    fn addresses_are_read() {
        let plain = address("nats://127.0.0.1/house");
        assert_eq!(plain.server(), "nats://127.0.0.1:4222");
        assert_eq!((plain.session.as_str(), plain.stream().as_str()), ("house", "osp-house"));
        assert_eq!(plain.to_string(), "nats://127.0.0.1:4222/house");
        assert_eq!(address("nats://a%20word@localhost:9/x").credentials, Credentials::Token("a word".into()));
        let user = Credentials::User { name: "ann".into(), password: "p:w".into() };
        let with_user = address("tls://ann:p%3Aw@[::1]:7/x-1_Y");
        assert_eq!(with_user.credentials, user);
        assert_eq!(with_user.server(), "tls://[::1]:7");
        assert!(!format!("{with_user} {with_user:?}").contains("p:w"));
    }

    #[test]
    fn nothing_leaves_this_machine_unasked() {
        for here in ["nats://127.0.0.1/x", "nats://127.8.0.1/x", "nats://[::1]/x", "nats://localhost/x"] {
            assert!(address(here).check_way().is_ok(), "{here}");
        }
        for away in ["nats://10.0.0.1/x", "nats://example.org/x", "nats://ann:pw@[2001:db8::1]/x"] {
            let error = address(away).check_way().expect_err(away).to_string();
            assert!(error.contains("is not this machine: expected tls://"), "{error}");
            assert!(address(&away.replace("nats", "tls")).check_way().is_ok());
        }
        // The name only looks like an address of this machine.
        assert!(address("nats://127.0.0.1.example.org/x").check_way().is_err());
        assert!(address("nats://localhost.example.org/x").check_way().is_err());
    }

    #[test]
    fn what_is_no_address_is_said_without_its_password() {
        let long = format!("nats://a/{}", "x".repeat(65));
        for bad in [
            "",
            "house",
            "http://a/x",
            "nats:///x",
            "nats://a",
            "nats://a/",
            "nats://a/x/y",
            "nats://a/x.y",
            "nats://a/x*",
            "nats://a/x?y",
            "nats://a:99999/x",
            "nats://a/\u{e9}",
            long.as_str(),
        ] {
            let error = bad.parse::<Address>().expect_err(bad).to_string();
            assert!(error.starts_with("expected nats://HOST[:PORT]/NAME"), "{error}");
        }
        let error = "nats://ann:secret@a/x.y".parse::<Address>().expect_err("no name").to_string();
        assert!(!error.contains("secret"), "{error}");
    }

    #[test]
    fn credentials_are_read_from_a_file_of_one_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("who");
        let read = |text: &str| {
            std::fs::write(&path, text).expect("written");
            Credentials::read(&path)
        };
        assert_eq!(read("word\n").expect("a token"), Credentials::Token("word".into()));
        let user = Credentials::User { name: "ann".into(), password: "p:w".into() };
        assert_eq!(read(" ann:p:w ").expect("a user"), user);
        for bad in ["", "\n", "two words", "a\nb"] {
            let error = read(bad).expect_err(bad).to_string();
            assert!(error.ends_with("expected one line, a token or USER:PASSWORD"), "{error}");
        }
        assert!(Credentials::read(folder.path()).is_err());
    }
}
