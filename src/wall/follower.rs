//! The session up to a position of its log: what hub and nodes have in common.

use std::collections::VecDeque;
use std::path::PathBuf;

use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::{WallError, barrier::Answer};
use crate::{
    frame::{Pipeline, StageClock},
    index::{IndexConfig, Osp},
    live::{Address, Link, LinkOptions, News, Role},
    polygon::Change,
    recording::{Event, push_event},
    replay::{SessionState, fingerprint_of_views},
    view::View,
};

/// Events that wait for their frame; the rest waits at the link.
const MOST_WAITING: usize = 1 << 18;

/// See the [module](self).
#[derive(Debug)]
pub(super) struct Follower {
    link: Link,
    waiting: VecDeque<Event>,
    applied: u64,
    /// A number for all events that were applied.
    log: u64,
    line: String,
    state: SessionState,
    pipeline: Pipeline,
    recent: Vec<Event>,
    changes: Vec<Change>,
}

impl Follower {
    pub(super) fn open(
        address: &Address,
        certificates: Option<PathBuf>,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, WallError> {
        let options = LinkOptions { role: Role::Watcher, certificates };
        let index = Osp::new(&IndexConfig::default());
        Ok(Self {
            link: Link::open(address, &options, wake)?,
            waiting: VecDeque::new(),
            applied: 0,
            log: 0,
            line: String::new(),
            state: SessionState::default(),
            pipeline: Pipeline::new(Box::new(index), 0, StageClock::default()),
            recent: Vec::new(),
            changes: Vec::new(),
        })
    }

    pub(super) fn link(&self) -> &Link {
        &self.link
    }

    pub(super) fn state(&self) -> &SessionState {
        &self.state
    }

    pub(super) fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    /// Takes the events that have come.
    pub(super) fn take(&mut self) -> Result<(), WallError> {
        while self.waiting.len() < MOST_WAITING
            && let Some(news) = self.link.news()?
        {
            if let News::Events { events, .. } = news {
                self.waiting.extend(events);
            }
        }
        Ok(())
    }

    /// Events that were applied.
    pub(super) fn applied(&self) -> u64 {
        self.applied
    }

    /// Applies so many of the next events, or all that are here; what they change is appended to `changes`.
    pub(super) fn advance(&mut self, events: usize, changes: &mut Vec<Change>) {
        self.recent.clear();
        if self.waiting.is_empty() {
            return;
        }
        self.recent.extend(self.waiting.drain(..events.min(self.waiting.len())));
        for event in &self.recent {
            self.line.clear();
            // An event that came as a line has one.
            push_event(&mut self.line, event);
            self.log = xxh3_64_with_seed(self.line.as_bytes(), self.log);
        }
        self.applied += self.recent.len() as u64;
        self.changes.clear();
        self.state.play(&self.recent, &mut self.changes);
        self.pipeline.skip(&self.state.scene, &self.changes);
        changes.extend_from_slice(&self.changes);
    }

    /// Culls the views of a frame.
    pub(super) fn cull(&mut self, views: &[View]) {
        self.pipeline.frame_of_views(&self.state.scene, &[], views);
    }

    /// The answer for some of the views that were culled last.
    pub(super) fn answer(&self, views: std::ops::Range<usize>) -> Answer {
        let lists = &self.pipeline.draw_lists()[views];
        Answer { log: self.log, seen: fingerprint_of_views(lists.iter().map(|list| list.ids())) }
    }
}
