use std::{net::SocketAddr, str::FromStr, time::Duration};

use super::osc::osc_key;
use osp_session::platform::time::Instant;

/// Largest number of datagrams that are read in a second; further datagrams are dropped and counted. Ten trackers with
/// a thousand poses a second each stay below this limit.
const DATAGRAMS_A_SECOND: u32 = 10_000;

/// Options for accepting datagrams.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrackerOptions {
    /// Key with which a datagram must begin, if any.
    pub key: Option<TrackerKey>,
}

/// A word that sender and listener share. It is sent unencrypted: it excludes senders that lack it, but not
/// eavesdroppers on the network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrackerKey(String);

impl TrackerKey {
    /// Longest key, bytes.
    pub const MAX_BYTES: usize = 64;

    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Compares two words in constant time.
    fn is(&self, other: &str) -> bool {
        let differing = self.0.bytes().zip(other.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
        self.0.len() == other.len() && differing == 0
    }
}

impl FromStr for TrackerKey {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_word = text.bytes().all(|b| b.is_ascii_graphic());
        if is_word && (1..=Self::MAX_BYTES).contains(&text.len()) {
            Ok(Self(text.to_owned()))
        } else {
            Err("expected 1 to 64 ASCII letters, digits or punctuation marks, no spaces".to_owned())
        }
    }
}

/// Whether a datagram is accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Admission {
    /// The datagram is read.
    Read,
    /// The datagram came from a sender that is not accepted, or lacks the key.
    Refused,
    /// The limit of datagrams per second is exceeded.
    TooMany,
}

/// Checks every datagram before it is read.
#[derive(Debug)]
pub(super) struct Admittance {
    options: TrackerOptions,
    /// The accepted sender, and the time of its last valid message.
    heard: Option<(SocketAddr, Instant)>,
    second_began: Option<Instant>,
    this_second: u32,
}

impl Admittance {
    /// Time without messages after which another sender may replace the accepted sender, for example after a restart on
    /// another port.
    const SILENCE: Duration = Duration::from_secs(5);

    pub(super) fn new(options: TrackerOptions) -> Self {
        Self { options, heard: None, second_began: None, this_second: 0 }
    }

    pub(super) fn admit(&mut self, from: SocketAddr, packet: &[u8], now: Instant) -> Admission {
        let is_stranger =
            self.heard.is_some_and(|(sender, at)| sender != from && now.duration_since(at) < Self::SILENCE);
        let knows_key = match &self.options.key {
            None => true,
            Some(key) => key_of(packet).is_some_and(|said| key.is(said)),
        };
        // This check comes before the count, so that refused datagrams do not use up the limit.
        if is_stranger || !knows_key {
            return Admission::Refused;
        }
        if self.second_began.is_none_or(|began| now.duration_since(began) >= Duration::from_secs(1)) {
            (self.second_began, self.this_second) = (Some(now), 0);
        }
        self.this_second += 1;
        if self.this_second > DATAGRAMS_A_SECOND { Admission::TooMany } else { Admission::Read }
    }

    /// Records that an admitted sender has sent a valid message: its datagrams are accepted from now on.
    pub(super) fn note_understood(&mut self, from: SocketAddr, now: Instant) {
        self.heard = Some((from, now));
    }
}

/// Whether a datagram is OSC: it begins with an address, or with `#bundle` and a zero byte. A comment line has no zero
/// byte there.
pub(super) fn is_osc(packet: &[u8]) -> bool {
    packet.starts_with(b"/") || packet.starts_with(b"#bundle\0")
}

fn key_of(packet: &[u8]) -> Option<&str> {
    if is_osc(packet) {
        return osc_key(packet);
    }
    let line = packet.split(|&b| b == b'\n').next()?;
    let mut words = str::from_utf8(line).ok()?.split_ascii_whitespace();
    match (words.next(), words.next(), words.next()) {
        (Some("key"), Some(key), None) => Some(key),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sender(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    #[test]
    fn the_first_who_is_understood_is_listened_to_until_it_is_silent() {
        let mut admittance = Admittance::new(TrackerOptions::default());
        let start = Instant::now();
        let at = |millis| start + Duration::from_millis(millis);
        // A malformed datagram does not make its sender the accepted one.
        assert_eq!(admittance.admit(sender(1), b"noise", at(0)), Admission::Read);
        assert_eq!(admittance.admit(sender(2), b"undo", at(1)), Admission::Read);
        admittance.note_understood(sender(2), at(1));
        assert_eq!(admittance.admit(sender(1), b"undo", at(2)), Admission::Refused);
        assert_eq!(admittance.admit(sender(2), b"undo", at(4_000)), Admission::Read);
        admittance.note_understood(sender(2), at(4_000));
        assert_eq!(admittance.admit(sender(1), b"undo", at(8_999)), Admission::Refused);
        assert_eq!(admittance.admit(sender(1), b"undo", at(9_000)), Admission::Read);
        admittance.note_understood(sender(1), at(9_000));
        assert_eq!(admittance.admit(sender(2), b"undo", at(9_001)), Admission::Refused);
    }

    #[test]
    fn only_who_knows_the_key_comes_in() {
        let key = Some("a-key".parse().expect("a key"));
        let mut admittance = Admittance::new(TrackerOptions { key });
        let now = Instant::now();
        let mut admits = |packet: &[u8]| admittance.admit(sender(1), packet, now) == Admission::Read;
        for packet in [&b"key a-key\nundo"[..], b"key a-key", b"  key   a-key \r\nundo"] {
            assert!(admits(packet), "{packet:?}");
        }
        let message =
            super::super::osc::osc_keyed("a-key", &super::super::osc_packet(&super::super::Message::Undo));
        assert!(admits(&message));
        let strangers: [&[u8]; 8] = [
            b"undo",
            b"undo\nkey a-key",
            b"key a-kez\nundo",
            b"key a-ke\nundo",
            b"key a-keys\nundo",
            b"key a-key more\nundo",
            b"/osp/undo\0\0\0,\0\0\0",
            b"#bundle\0\0\0\0\0\0\0\0\x01",
        ];
        for packet in strangers {
            assert!(!admits(packet), "{packet:?}");
        }
    }

    #[test]
    fn a_flood_is_cut_off_and_strangers_do_not_count() {
        let mut admittance = Admittance::new(TrackerOptions::default());
        let start = Instant::now();
        admittance.note_understood(sender(2), start);
        for _ in 0..3 * DATAGRAMS_A_SECOND {
            assert_eq!(admittance.admit(sender(1), b"undo", start), Admission::Refused);
        }
        let read = (0..3 * DATAGRAMS_A_SECOND)
            .filter(|_| admittance.admit(sender(2), b"undo", start) == Admission::Read);
        assert_eq!(read.count() as u32, DATAGRAMS_A_SECOND);
        assert_eq!(
            admittance.admit(sender(2), b"undo", start + Duration::from_millis(999)),
            Admission::TooMany
        );
        assert_eq!(admittance.admit(sender(2), b"undo", start + Duration::from_secs(1)), Admission::Read);
    }

    #[test]
    fn keys_are_words() {
        for bad in ["", "two words", "tab\t", "umläut", &"x".repeat(65)] {
            assert!(bad.parse::<TrackerKey>().is_err(), "{bad}");
        }
        assert_eq!("x".repeat(64).parse::<TrackerKey>().expect("a key").as_str().len(), 64);
    }
}
