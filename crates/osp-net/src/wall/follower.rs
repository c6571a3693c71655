//! The session up to a position in its log, for hub and computers.

use std::collections::VecDeque;
use std::path::PathBuf;

use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::{WallError, barrier::Answer};
use crate::live::{Address, Link, LinkOptions, News, Role};
use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp},
    polygon::Change,
    view::View,
};
use osp_session::{
    recording::{Event, push_event},
    replay::{SessionState, fingerprint_of_views},
};

/// Largest number of events that wait for their frame. Further events stay in the link.
const MOST_WAITING: u64 = 1 << 18;

/// The model of the session up to a position; see the [module](self).
#[derive(Debug)]
pub(super) struct Follower {
    pub(super) link: Link,
    /// Messages of the log. Hub and computers apply each message as a whole, because polygon numbers and the shape of
    /// an unfinished stroke depend on the division into messages.
    waiting: VecDeque<Vec<Event>>,
    /// Number of events in the waiting messages.
    events_waiting: u64,
    /// Number of applied events.
    pub(super) applied: u64,
    /// A hash of all applied events.
    log: u64,
    line: String,
    pub(super) state: SessionState,
    pub(super) pipeline: Pipeline,
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
            events_waiting: 0,
            applied: 0,
            log: 0,
            line: String::new(),
            state: SessionState::default(),
            pipeline: Pipeline::new(Box::new(index), 0),
            changes: Vec::new(),
        })
    }

    /// Reads the events that were received.
    pub(super) fn take(&mut self) -> Result<(), WallError> {
        while self.events_waiting < MOST_WAITING
            && let Some(news) = self.link.news()?
        {
            if let News::Events { events, .. } = news {
                self.events_waiting += events.len() as u64;
                self.waiting.push_back(events);
            }
        }
        Ok(())
    }

    /// Applies the next messages, up to `up_to` applied events in total. Stops after `at_once` events. Appends the changes
    /// of the model to `changes`.
    pub(super) fn advance(&mut self, up_to: u64, at_once: u64, changes: &mut Vec<Change>) {
        let before = self.applied;
        while self.applied - before < at_once
            && self.waiting.front().is_some_and(|next| self.applied + next.len() as u64 <= up_to)
            && let Some(message) = self.waiting.pop_front()
        {
            for event in &message {
                self.line.clear();
                push_event(&mut self.line, event);
                self.log = xxh3_64_with_seed(self.line.as_bytes(), self.log);
            }
            self.applied += message.len() as u64;
            self.events_waiting -= message.len() as u64;
            self.changes.clear();
            self.state.play(&message, &mut self.changes);
            self.pipeline.skip(&self.state.scene, &self.changes);
            changes.extend_from_slice(&self.changes);
        }
    }

    /// Frees strokes that undo and redo cannot reach. Changes that were not processed yet may refer to such strokes.
    pub(super) fn free_unreachable(&mut self) {
        self.state.scene.free_unreachable();
    }

    /// Culls the views of a frame.
    pub(super) fn cull(&mut self, views: &[View]) {
        self.pipeline.frame_of_views(&self.state.scene, &[], views);
    }

    /// Hashes of the applied events, and of the polygons visible in these views of the last frame.
    pub(super) fn answer(&self, views: std::ops::Range<usize>) -> Answer {
        let lists = &self.pipeline.draw_lists()[views];
        Answer { log: self.log, seen: fingerprint_of_views(lists.iter().map(|list| list.ids())) }
    }
}
