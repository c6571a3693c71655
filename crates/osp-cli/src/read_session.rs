//! A session that has been read to its end. No command reads a session twice.

use glam::Vec3;

#[cfg(any(feature = "bench", feature = "render"))]
use super::{reading::ReadArgs, session::OpenSession};
use osp::index::IndexConfig;
use osp_session::{
    recording::{Event, Header, Pace, RecordingError},
    replay::{ArtistSide, Player, SessionState, Summary, root_cube, summarize_each},
};

/// What remains in memory of the events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Keep {
    /// Only the finished model. Frames that cost more than reading their events are merged.
    Model,
    /// Only the finished model, after each frame.
    Frames,
    Events,
}

pub(super) struct ReadSession {
    pub(super) header: Header,
    pub(super) summary: Summary,
    /// The finished model, and the last poses.
    pub(super) end: SessionState,
    /// Direction from the model to the session's own camera; without a camera, to the artist's first head poses.
    pub(super) direction_to_artist: Option<Vec3>,
    pub(super) pace: Pace,
    /// Size and place of an index for all polygons that the session ever shows.
    pub(super) index: IndexConfig,
    events: Option<Vec<Event>>,
}

type Read = Result<Event, RecordingError>;

impl ReadSession {
    #[cfg(any(feature = "bench", feature = "render"))]
    pub(super) fn at(
        file: &std::path::Path,
        reading: &ReadArgs,
        pace: Pace,
        keep: Keep,
    ) -> anyhow::Result<Self> {
        let mut session = OpenSession::open(file, reading)?.counted();
        let (read_session, read) = Self::of(session.header.clone(), &mut session, pace, keep, |_, _| {});
        session.warn_losses();
        read?;
        Ok(read_session)
    }

    /// Reads the events of an open session. `each` gets the events of every frame, and the state after them.
    pub(super) fn of(
        header: Header,
        events: impl Iterator<Item = Read>,
        pace: Pace,
        keep: Keep,
        each: impl FnMut(&[Event], &SessionState),
    ) -> (Self, Result<(), RecordingError>) {
        let mut artist = ArtistSide::default();
        let mut kept = (keep == Keep::Events).then(Vec::new);
        let events = events.inspect(|event| {
            let Ok(event) = event else { return };
            artist.note(event);
            if let Some(kept) = &mut kept {
                kept.push(event.clone());
            }
        });
        let player = Player::new(events, pace);
        let player = if keep == Keep::Model { player.merging_frames() } else { player };
        let (summary, end, read) = summarize_each(player, each);
        let direction_to_artist = artist.direction_to_artist(header.camera);
        let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
        let index = IndexConfig { root: root_cube(&header, &summary.bounds), capacity };
        (Self { header, summary, end, direction_to_artist, pace, index, events: kept }, read)
    }

    #[cfg(feature = "bench")]
    pub(super) fn events(&self) -> impl Iterator<Item = Read> {
        self.events.iter().flatten().cloned().map(Ok)
    }

    /// Plays the session frame by frame. If its events were not kept, one frame has the finished model.
    pub(super) fn into_player(self) -> Player<impl Iterator<Item = Read>> {
        let Self { events, end, pace, .. } = self;
        let is_at_once = events.is_none();
        let player = Player::new(events.unwrap_or_default().into_iter().map(Ok), pace);
        if is_at_once { player.at_once(end) } else { player }
    }
}
