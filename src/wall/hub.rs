//! The machine that says which moment of the session a wall shows, and when.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use glam::{Quat, Vec3};

use super::{
    Said, WallError, WallReport,
    barrier::{Answer, Barrier},
    follower::Follower,
    message::{self, Frame, FromHub, FromNode, MAX_NAME_BYTES, Numbers},
    wire::{HUB, Heard, NODE, STATUS, Wire},
};
use crate::{
    live::{Address, Connection, new_sender},
    math::Aabb,
    polygon::Change,
    replay::{RigPath, RigView, RoomMotion},
    view::{Projection, Rig, Stereo, View},
};

/// Events of the session that a frame takes at most: so many take a few milliseconds.
const EVENTS_A_FRAME: usize = 1 << 12;
/// As far as one sees at least, metres.
const LEAST_FAR_M: f32 = 100.0;

/// An eye that comes nearer to a screen sees what it would see from here, metres.
const NEAREST_EYE_M: f32 = 0.05;

/// Animated brushes start again after this time, seconds, before a shader's numbers become too coarse.
const MOST_TIME_S: f64 = 1000.0;

/// What a hub shows.
#[derive(Clone, Debug)]
pub struct HubOptions {
    /// A file of certificates (PEM) to trust beside those of the system.
    pub certificates: Option<PathBuf>,
    /// The screens.
    pub rig: Rig,
    /// How the pictures reach the two eyes.
    pub stereo: Stereo,
    /// What the room does while the session's head moves. A tracked head moves in a room that stands.
    pub motion: RoomMotion,
    /// Frames a second, at most.
    pub rate_hz: f64,
}

/// See the [module](self).
#[derive(Debug)]
pub struct Hub {
    number: u64,
    session: String,
    rig_number: u64,
    rate_hz: f64,
    wire: Wire,
    follower: Follower,
    barrier: Barrier,
    path: RigPath,
    bounds: Aabb,
    changes: Vec<Change>,
    views: Vec<RigView>,
    started: Instant,
    /// When the next frame begins.
    due: Duration,
    frame: u64,
    garbage: u64,
}

impl Hub {
    /// Begins to follow a session and to listen to nodes.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn open(address: &Address, options: &HubOptions) -> Result<Self, WallError> {
        let HubOptions { certificates, rig, stereo, motion, rate_hz } = options.clone();
        let screens = rig.screens.iter().map(|screen| screen.name.clone()).collect();
        let mut path = RigPath::new(rig, stereo, motion).keeping_eyes_in_front(NEAREST_EYE_M);
        let mut views = Vec::new();
        // A room that stands stands where its own place for the head is that of the world.
        path.views_into(&camera(path.rig().head, Quat::IDENTITY, LEAST_FAR_M), &mut views);
        Ok(Self {
            number: new_sender().0,
            session: address.session().to_owned(),
            rig_number: message::of_rig(path.rig(), stereo),
            rate_hz,
            wire: Wire::open(address, certificates.clone(), &[NODE, STATUS], HUB, || {})?,
            follower: Follower::open(address, certificates, || {})?,
            barrier: Barrier::new(screens),
            path,
            bounds: Aabb::EMPTY,
            changes: Vec::new(),
            views,
            started: Instant::now(),
            due: Duration::ZERO,
            frame: 0,
            garbage: 0,
        })
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// Waits until it is time, and has the nodes show the next frame. `head` is the tracked head in the room, if there is a
    /// tracker; otherwise it is that of the session's artist.
    ///
    /// # Errors
    /// The session or the connection has ended for good.
    pub fn frame(&mut self, head: Option<(Vec3, Quat)>) -> Result<Vec<Said>, WallError> {
        self.hear_until(self.due, |_| false)?;
        // A frame that is late does not hurry those that follow.
        self.due = self.due.max(self.now()) + Duration::from_secs_f64(1.0 / self.rate_hz);
        self.follower.take()?;
        self.changes.clear();
        self.follower.advance(EVENTS_A_FRAME, &mut self.changes);
        for change in &self.changes {
            if let Change::Insert(id) | Change::Update(id) = change {
                self.bounds = self.bounds.union(&self.follower.state().scene.bounds(*id));
            }
        }
        let recorded = self.follower.state().moment.head;
        let (eye, turn) = head.or(recorded).unwrap_or((self.path.rig().head, Quat::IDENTITY));
        let far_m = (self.bounds.is_empty())
            .then_some(0.0)
            .unwrap_or_else(|| (self.bounds.max - eye).abs().max((self.bounds.min - eye).abs()).length());
        self.path.views_into(&camera(eye, turn, far_m.max(LEAST_FAR_M)), &mut self.views);

        let views = self.views.iter().map(|seen| seen.view.as_ref().map(Numbers::of)).collect();
        let (hub, number, events) = (self.number, self.frame, self.follower.applied());
        let began = self.now();
        let time_s = (began.as_secs_f64() % MOST_TIME_S) as f32;
        self.wire.say(message::write(&FromHub::Frame(Frame { hub, number, events, time_s, views })));
        let expected = self.cull();
        self.barrier.begin(number, expected, began);
        self.hear_until(self.barrier.deadline(), Barrier::is_complete)?;
        self.wire.say(message::write(&FromHub::Swap { hub, frame: number }));
        self.barrier.swap(self.now());
        self.frame += 1;
        Ok(self.barrier.take_said())
    }

    /// What each screen's node should answer.
    fn cull(&mut self) -> Vec<Answer> {
        let views: Vec<View> = self.views.iter().filter_map(|seen| seen.view).collect();
        self.follower.cull(&views);
        let mut first = 0;
        (0..self.path.rig().screens.len())
            .map(|screen| {
                let count =
                    self.views.iter().filter(|seen| seen.screen == screen && seen.view.is_some()).count();
                first += count;
                self.follower.answer(first - count..first)
            })
            .collect()
    }

    fn hear_until(&mut self, until: Duration, is_enough: impl Fn(&Barrier) -> bool) -> Result<(), WallError> {
        loop {
            if is_enough(&self.barrier) {
                return Ok(());
            }
            let left = until.saturating_sub(self.now());
            match self.wire.hear(left)? {
                Some(heard) => self.take(heard),
                None if left.is_zero() => return Ok(()),
                None => {}
            }
        }
    }

    fn take(&mut self, heard: Heard) {
        if let Some(reply) = heard.reply {
            self.wire.answer(reply, message::write(&self.report()));
            return;
        }
        let now = self.now();
        match message::read(&heard.bytes) {
            Ok(FromNode::Here { node, screen, host, rig, events })
                if screen.len() <= MAX_NAME_BYTES && host.len() <= MAX_NAME_BYTES =>
            {
                self.here(node, &screen, &host, rig, events, now);
            }
            Ok(FromNode::Ready { node, hub, frame, log, seen }) if hub == self.number => {
                self.barrier.ready(node, frame, Answer { log, seen }, now);
            }
            Ok(FromNode::Shown { node, hub, frame }) if hub == self.number => {
                self.barrier.shown(node, frame, now);
            }
            Ok(FromNode::Leaving { node }) => self.barrier.leaves(node),
            // To a hub before this one.
            Ok(FromNode::Ready { .. } | FromNode::Shown { .. }) => {}
            Ok(FromNode::Here { .. }) | Err(_) => self.garbage += 1,
        }
    }

    fn here(&mut self, node: u64, screen: &str, host: &str, rig: u64, events: u64, now: Duration) {
        let is_same = rig == self.rig_number;
        let outcome = match is_same {
            true => self.barrier.here(node, screen, host, events, now),
            false => Err("its rig has other screens or eyes than the hub's".to_owned()),
        };
        if let Err(why) = outcome {
            self.wire.say(message::write(&FromHub::Refused { node, why, is_for_good: !is_same }));
        }
    }

    /// What is wrong with the connection to the session, if something is.
    pub fn trouble(&self) -> Option<String> {
        let status = self.follower.link().status();
        match (&status.connection, status.trouble) {
            (_, Some(trouble)) => Some(trouble),
            (Connection::Silent, None) => Some("the server does not answer".to_owned()),
            (Connection::Connecting, None) => Some("there is no such session yet".to_owned()),
            _ => None,
        }
    }

    /// The state of the wall.
    pub fn report(&self) -> WallReport {
        let trouble = self.trouble();
        let [frame, period, skew] = self.barrier.times();
        WallReport {
            session: self.session.clone(),
            rig: self.path.rig().name.clone(),
            trouble,
            rate_hz: self.rate_hz,
            frames_a_second: self.barrier.frames_a_second(self.now()),
            frames: self.barrier.frames(),
            events: self.follower.applied(),
            polygons: self.follower.pipeline().polygon_count() as u64,
            garbage: self.garbage,
            frame,
            period,
            skew,
            nodes: self.barrier.nodes(self.follower.applied()),
        }
    }
}

/// An eye from which the rig's views are made.
fn camera(eye: Vec3, turn: Quat, far_m: f32) -> View {
    let projection = Projection { far_m, ..Projection::symmetric(60.0, 1.0, 0.01, LEAST_FAR_M) };
    View { eye_in_world: eye, world_from_view: turn, projection }
}
