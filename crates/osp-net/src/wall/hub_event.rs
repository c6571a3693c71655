use std::fmt;

/// A change of a hub's computers.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "their messages describe them")]
pub enum HubEvent {
    /// From now on the hub waits for the computer of this screen.
    In { screen: String, host: String },
    /// The hub does not wait for a computer any more. The computer continues. The hub waits for this computer again
    /// once it answers in time.
    Out { screen: String, host: String, why: &'static str },
    /// A computer's result differs from the hub's result.
    Differs { screen: String, host: String, frame: u64, what: &'static str },
    /// A computer whose result differed agrees with the hub again.
    Agrees { screen: String, host: String },
}

impl fmt::Display for HubEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::In { screen, host } => write!(f, "{screen}: {host} is in"),
            Self::Out { screen, host, why } => write!(f, "{screen}: {host} is out: {why}"),
            Self::Differs { screen, host, frame, what } => {
                write!(f, "{screen}: {host} shows something else than the hub since frame {frame}: {what}")
            }
            Self::Agrees { screen, host } => write!(f, "{screen}: {host} shows the same as the hub again"),
        }
    }
}
