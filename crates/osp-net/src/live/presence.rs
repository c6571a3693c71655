//! The time of each author's last presence message, by this member's clock. A silent author counts as gone after some time.

use std::collections::BTreeMap;
use std::time::Duration;

use osp_session::recording::{Author, Event, Sender};

/// Silence after which an author counts as gone.
pub(super) const SILENCE: Duration = Duration::from_secs(10);

/// Interval of the presence messages of each author.
pub(super) const PRESENCE_EVERY: Duration = Duration::from_secs(2);

/// Interval between two reports that an author is gone.
const TRY_EVERY: Duration = Duration::from_secs(1);

/// The time of each author's last message; see the [module](self).
#[derive(Debug, Default)]
pub(super) struct Presence {
    received: BTreeMap<Sender, (Author, Duration)>,
    /// Time since which the connection carries messages of other members.
    up_since: Duration,
    tried: Option<Duration>,
}

impl Presence {
    pub(super) fn authors(&self) -> usize {
        self.received.len()
    }

    /// Records a message of a sender. Senders that are not present are ignored.
    pub(super) fn receive(&mut self, sender: Sender, now: Duration) {
        if let Some((_, received)) = self.received.get_mut(&sender) {
            *received = now;
        }
    }

    /// Records a message of a sender that counts in the log.
    pub(super) fn taken(&mut self, sender: Sender, author: Author, events: &[Event], now: Duration) {
        self.receive(sender, now);
        for event in events {
            match event {
                Event::Join { .. } => _ = self.received.insert(sender, (author, now)),
                Event::Leave { author, .. } => self.received.retain(|_, (of, _)| of != author),
                _ => {}
            }
        }
    }

    /// Records that no messages could be received until now, so that silence until now does not count.
    pub(super) fn interrupted(&mut self, now: Duration) {
        self.up_since = now;
    }

    /// Returns an author who has been silent too long, except `me`. After each such author it returns `None` for a
    /// while, so that the caller does not report authors too often.
    pub(super) fn gone(&mut self, now: Duration, me: Option<Sender>) -> Option<Author> {
        if self.tried.is_some_and(|tried| now.saturating_sub(tried) < TRY_EVERY) {
            return None;
        }
        let is_silent = |&(sender, (_, received)): &(&Sender, &(Author, Duration))| {
            Some(*sender) != me && now.saturating_sub((*received).max(self.up_since)) > SILENCE
        };
        let gone = self.received.iter().find(is_silent).map(|(_, (author, _))| *author)?;
        self.tried = Some(now);
        Some(gone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn secs(secs: u64) -> Duration {
        Duration::from_secs(secs)
    }

    fn join(author: u32) -> [Event; 1] {
        [Event::Join { t: 0.0, author: Author(author), name: String::new(), color: None }]
    }

    #[test]
    fn who_is_silent_is_gone_and_who_speaks_is_not() {
        let mut presence = Presence::default();
        presence.taken(Sender(1), Author(1), &join(1), secs(0));
        presence.taken(Sender(2), Author(2), &join(2), secs(0));
        presence.receive(Sender(9), secs(1));
        assert_eq!(presence.authors(), 2);
        presence.receive(Sender(2), secs(8));
        assert_eq!(presence.gone(secs(10), None), None);
        assert_eq!(presence.gone(secs(11), Some(Sender(1))), None, "one is never gone oneself");
        assert_eq!(presence.gone(secs(11), None), Some(Author(1)));
        assert_eq!(presence.gone(secs(11), None), None, "said once a second");
        assert_eq!(presence.gone(secs(12), None), Some(Author(1)));
        let leave = [Event::Leave { t: 0.0, author: Author(1) }];
        presence.taken(Sender::HOST, Author::SOLE, &leave, secs(12));
        assert_eq!((presence.gone(secs(18), None), presence.authors()), (None, 1));
        // After an interruption every author has time to send a message.
        presence.interrupted(secs(30));
        assert_eq!(presence.gone(secs(40), None), None);
        assert_eq!(presence.gone(secs(41), None), Some(Author(2)));
    }
}
