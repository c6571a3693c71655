use super::Limits;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpenOptions {
    /// Whether damaged parts are skipped and counted in [`Notes::skipped`](super::Notes::skipped). Otherwise damage
    /// ends the session with an error.
    pub lenient: bool,
    pub limits: Limits,
}

impl OpenOptions {
    /// Damage is an error. The limits are [`Limits::DEFAULT`].
    pub const STRICT: Self = Self { lenient: false, limits: Limits::DEFAULT };
    /// Damage is skipped. The limits are [`Limits::DEFAULT`].
    pub const LENIENT: Self = Self { lenient: true, limits: Limits::DEFAULT };
}
