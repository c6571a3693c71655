//! A session that is read to its end before it is played.

use std::path::Path;

use glam::Vec3;

use super::{reading::ReadArgs, session::OpenSession};
use osp_session::{
    recording::{Event, Header, Pace, RecordingError},
    replay::{ArtistSide, Summary, summarize},
    scene::Scene,
};

/// Contents of a session.
pub(super) struct ReadSession {
    pub(super) header: Header,
    pub(super) summary: Summary,
    /// The finished model.
    pub(super) model: Scene,
    /// Direction from the model to the session's own camera; without a camera, to the artist's first head poses.
    pub(super) direction_to_artist: Option<Vec3>,
}

impl ReadSession {
    /// Reads a file and prints the warnings.
    pub(super) fn at(file: &Path, reading: &ReadArgs, pace: Pace) -> anyhow::Result<Self> {
        let mut session = OpenSession::open(file, reading)?.counted();
        let (read_session, read) = Self::of(session.header.clone(), &mut session, pace);
        session.warn();
        read?;
        Ok(read_session)
    }

    /// Reads the events of an open session.
    pub(super) fn of(
        header: Header,
        events: impl Iterator<Item = Result<Event, RecordingError>>,
        pace: Pace,
    ) -> (Self, Result<(), RecordingError>) {
        let mut artist = ArtistSide::default();
        let events = events.inspect(|event| event.iter().for_each(|event| artist.note(event)));
        let (summary, model, read) = summarize(events, pace);
        let direction_to_artist = artist.direction_to_artist(header.camera);
        (Self { header, summary, model, direction_to_artist }, read)
    }
}
