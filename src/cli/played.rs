//! A session played up to a frame, for commands that look at that frame alone.

use std::path::Path;

use anyhow::bail;

use super::{
    frame_choice::FrameChoice,
    output::complain,
    reading::ReadArgs,
    session::{OpenSession, root_cube},
};
use crate::{
    frame::{Pipeline, StageClock},
    index::IndexConfig,
    recording::{Header, Pace},
    replay::{Moment, Player, Summary, summarize},
    rivals::IndexKind,
    scene::Scene,
};

/// The model and an index after a frame.
pub(super) struct Played {
    pub(super) header: Header,
    pub(super) summary: Summary,
    pub(super) scene: Scene,
    pub(super) pipeline: Pipeline,
    /// Number of the frame, and the poses of head and hand then.
    pub(super) moment: Moment,
}

impl Played {
    pub(super) fn up_to(
        frame: FrameChoice,
        file: &Path,
        pace: Pace,
        index: IndexKind,
        reading: &ReadArgs,
    ) -> anyhow::Result<Self> {
        let mut session = OpenSession::open(file, reading)?;
        let (summary, _, read) = summarize(&mut session, pace);
        for warning in &session.notes().warnings {
            complain(&format!("warning: {warning}"));
        }
        read?;
        let last = frame.number(file, &summary, pace)?;
        let session = OpenSession::open(file, reading)?;
        let header = session.header.clone();
        let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
        let config = IndexConfig { root: root_cube(&header, &summary.bounds), capacity };
        let mut pipeline = Pipeline::new(index.create(&config), capacity, StageClock::default());
        let mut player = Player::new(session, pace);
        for _ in 0..=last {
            if !player.step()? {
                bail!("{}: it has become shorter while it was read", file.display());
            }
            pipeline.skip(player.scene(), player.changes());
        }
        pipeline.commit();
        let moment = player.moment();
        Ok(Self { header, summary, scene: player.into_scene(), pipeline, moment })
    }
}
