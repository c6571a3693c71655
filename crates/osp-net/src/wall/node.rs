//! A machine with one screen of a wall.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::{
    NodeCounts, WallError,
    follower::Follower,
    message::{self, Frame, FromHub, FromNode, Numbers},
    wire::{HUB, NODE, Received, Wire},
};
use crate::live::{Address, new_sender};
use osp::{frame::Pipeline, polygon::Change, view::View};
use osp_session::{
    rig::{Eye, Rig, Stereo},
    scene::Scene,
};

/// Interval of a computer's presence messages.
const PRESENCE_EVERY: Duration = Duration::from_millis(400);
/// Largest number of events that are applied in one call.
const EVENTS_AT_ONCE: u64 = 1 << 14;
/// Largest number of a hub's messages that are read in one call.
const MESSAGES_AT_ONCE: u32 = 1024;
/// Time for which a computer retries if another computer, which may be gone, has the screen.
const RETRY_FOR: Duration = Duration::from_secs(5);
/// Silence after which a computer no longer follows a hub.
const SILENCE: Duration = Duration::from_secs(1);
/// Interval of checks for the events that a frame waits for.
const CHECK_EVERY: Duration = Duration::from_micros(500);

/// Options of a computer.
#[derive(Clone, Debug)]
pub struct NodeOptions {
    /// A file of certificates (PEM) that are trusted in addition to the system's certificates.
    pub certificates: Option<PathBuf>,
    /// The rig with all screens of the wall.
    pub rig: Rig,
    /// Form of the pictures for the two eyes.
    pub stereo: Stereo,
    /// The name of the computer's screen.
    pub screen: String,
    /// The name of the machine.
    pub host: String,
}

/// The next step of a computer's program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// There is nothing to do.
    Nothing,
    /// Draw [`Node::views`] and, once the GPU has finished, call [`Node::ready`].
    Draw,
    /// Show the picture that was drawn last, then call [`Node::shown`].
    Show,
}

/// A computer of a wall; see the [module](self). Dropping it informs the hub.
#[derive(Debug)]
pub struct Node {
    number: u64,
    screen: String,
    host: String,
    rig: u64,
    /// The eyes of the computer's screen, each with its index in the hub's list of views.
    slots: Vec<(usize, Eye)>,
    /// Number of views of all screens and eyes.
    all: usize,
    wire: Wire,
    follower: Follower,
    /// Changes of the model since the last drawn frame.
    pub changes: Vec<Change>,
    views: Vec<View>,
    eyes: Vec<Eye>,
    /// Time of animated brushes, seconds.
    pub time_s: f32,
    /// The hub that the computer follows, and the time of the hub's last message.
    hub: Option<(u64, Instant)>,
    /// Number of the hub's newest frame.
    newest: Option<u64>,
    /// The newest frame, if it was not drawn yet.
    wanted: Option<Frame>,
    /// The hub and the number of the frame that was drawn last.
    drawn: Option<(u64, u64)>,
    /// The hub and the number of the last frame to be shown.
    swapped: Option<(u64, u64)>,
    is_ready: bool,
    is_shown: bool,
    reported_at: Option<Instant>,
    /// Time since which the hub refuses the computer, and time of the last refusal.
    refused: Option<(Instant, Instant)>,
    /// Last text about the hub and the session.
    last_report: String,
    frames: u64,
    garbage: u64,
}

impl Node {
    /// Opens a computer: begins to follow a session and its hub. A thread calls `wake` whenever there may be something
    /// to do.
    ///
    /// # Errors
    /// The rig has no such screen, or the system provides no thread.
    pub fn open(
        address: &Address,
        options: &NodeOptions,
        wake: impl Fn() + Clone + Send + 'static,
    ) -> Result<Self, WallError> {
        let NodeOptions { certificates, rig, stereo, screen, host } = options.clone();
        let Some(own) = rig.screens.iter().position(|one| one.name == screen) else {
            let names: Vec<_> = rig.screens.iter().map(|one| format!("`{}`", one.name)).collect();
            return Err(WallError::NoScreen { rig: rig.name, there: names.join(", "), wanted: screen });
        };
        let eyes = stereo.eyes();
        Ok(Self {
            number: new_sender().0,
            screen,
            host,
            rig: message::rig_hash(&rig, stereo),
            slots: eyes.iter().enumerate().map(|(i, eye)| (own * eyes.len() + i, *eye)).collect(),
            all: rig.screens.len() * eyes.len(),
            wire: Wire::open(address, certificates.clone(), &[HUB], NODE, wake.clone())?,
            follower: Follower::open(address, certificates, wake)?,
            changes: Vec::new(),
            views: Vec::new(),
            eyes: Vec::new(),
            time_s: 0.0,
            hub: None,
            newest: None,
            wanted: None,
            drawn: None,
            swapped: None,
            is_ready: false,
            is_shown: false,
            reported_at: None,
            refused: None,
            last_report: String::new(),
            frames: 0,
            garbage: 0,
        })
    }

    /// Waits at most `wait` for the next step.
    ///
    /// # Errors
    /// The hub refuses this computer, or the session or the connection has ended permanently.
    pub fn step(&mut self, wait: Duration) -> Result<Step, WallError> {
        self.follower.take()?;
        self.announce_presence();
        let wait = if self.wanted.is_some() { wait.min(CHECK_EVERY) } else { wait };
        let mut heard = self.wire.receive(wait)?;
        for _ in 0..MESSAGES_AT_ONCE {
            let Some(one) = heard else { break };
            self.receive(one)?;
            heard = self.wire.receive(Duration::ZERO)?;
        }
        let is_swapped = match (self.swapped, self.drawn) {
            // A late computer shows its picture, because the other computers already show this frame or a later frame.
            (Some((hub, swapped)), Some((of, drawn))) => hub == of && swapped >= drawn,
            _ => false,
        };
        if self.is_ready && !self.is_shown && is_swapped {
            return Ok(Step::Show);
        }
        let Some(frame) = &self.wanted else { return Ok(Step::Nothing) };
        self.follower.take()?;
        if frame.events < self.follower.applied {
            // A hub that was started later than this computer has not read as many events yet.
            self.wanted = None;
            return Ok(Step::Nothing);
        }
        self.follower.advance(frame.events, EVENTS_AT_ONCE, &mut self.changes);
        if self.follower.applied < frame.events {
            return Ok(Step::Nothing);
        }
        let Some(frame) = self.wanted.take() else { return Ok(Step::Nothing) };
        self.eyes.clear();
        self.views.clear();
        for (slot, eye) in &self.slots {
            if let Some(view) = frame.views[*slot].and_then(Numbers::view) {
                self.eyes.push(*eye);
                self.views.push(view);
            }
        }
        self.follower.cull(&self.views);
        self.drawn = Some((frame.hub, frame.number));
        self.time_s = if frame.time_s.is_finite() { frame.time_s } else { 0.0 };
        (self.is_ready, self.is_shown) = (false, false);
        Ok(Step::Draw)
    }

    fn announce_presence(&mut self) {
        if self.reported_at.is_none_or(|reported_at| reported_at.elapsed() >= PRESENCE_EVERY) {
            self.reported_at = Some(Instant::now());
            self.wire.publish(message::write(&FromNode::Here {
                node: self.number,
                screen: self.screen.clone(),
                host: self.host.clone(),
                rig: self.rig,
                events: self.follower.applied,
            }));
        }
    }

    fn receive(&mut self, heard: Received) -> Result<(), WallError> {
        match message::read(&heard.bytes) {
            Ok(FromHub::Frame(frame)) if frame.views.len() == self.all => {
                let now = Instant::now();
                match self.hub {
                    // This frame was received before.
                    Some((hub, _)) if hub == frame.hub && self.newest >= Some(frame.number) => return Ok(()),
                    Some((hub, _)) if hub == frame.hub => {}
                    // A computer follows one hub at a time.
                    Some(_) if self.has_hub() => return Ok(()),
                    _ => self.reported_at = None,
                }
                self.hub = Some((frame.hub, now));
                self.newest = Some(frame.number);
                self.wanted = Some(frame);
            }
            Ok(FromHub::Swap { hub, frame }) => {
                if self.hub.is_some_and(|(own, _)| own == hub) {
                    self.swapped = Some((hub, frame));
                }
            }
            // The message may come from another hub, which runs by mistake.
            Ok(FromHub::Refused { hub, node, why, is_for_good })
                if node == self.number
                    && (!self.has_hub() || self.hub.is_some_and(|(own, _)| own == hub)) =>
            {
                let now = Instant::now();
                let goes_on = |(_, last): &(Instant, Instant)| now.duration_since(*last) < 3 * PRESENCE_EVERY;
                let since = self.refused.filter(goes_on).map_or(now, |(since, _)| since);
                self.refused = Some((since, now));
                if is_for_good || now.duration_since(since) > RETRY_FOR {
                    return Err(WallError::Refused(why));
                }
            }
            Ok(FromHub::Refused { .. }) => {}
            Ok(FromHub::Frame(_)) | Err(_) => self.garbage += 1,
        }
        Ok(())
    }

    /// Informs the hub that the frame is drawn. The hub then determines when the frame is shown.
    pub fn ready(&mut self) {
        let Some((hub, frame)) = self.drawn else { return };
        let answer = self.follower.answer(0..self.views.len());
        self.is_ready = true;
        self.frames += 1;
        self.changes.clear();
        self.follower.free_unreachable();
        self.wire.publish(message::write(&FromNode::Ready {
            node: self.number,
            hub,
            frame,
            log: answer.log,
            seen: answer.seen,
        }));
    }

    /// Informs the hub that the frame is on the screen.
    pub fn shown(&mut self) {
        let Some((hub, frame)) = self.drawn else { return };
        self.is_shown = true;
        self.wire.publish(message::write(&FromNode::Shown { node: self.number, hub, frame }));
    }

    /// Records that the frame cannot be shown, because the window is hidden or has just changed.
    pub fn not_shown(&mut self) {
        self.is_shown = true;
    }

    /// Text about the hub and the session, if it has changed since the last call.
    pub fn news(&mut self) -> Option<String> {
        let status = self.follower.link.status();
        let text = match (status.trouble, self.has_hub()) {
            (Some(trouble), _) => trouble,
            (None, false) => "no hub sends frames (osp wall --hub)".to_owned(),
            (None, true) => "a hub sends frames".to_owned(),
        };
        if text == self.last_report {
            return None;
        }
        self.last_report.clone_from(&text);
        Some(text)
    }

    /// The model of the frame to draw.
    pub fn scene(&self) -> &Scene {
        &self.follower.state.scene
    }

    /// The computer's culling pipeline. Its lists of polygons are in the order of [`Node::views`].
    pub fn pipeline(&self) -> &Pipeline {
        &self.follower.pipeline
    }

    /// The views of the frame to draw, one for each eye. Eyes that see nothing are skipped.
    pub fn views(&self) -> impl Iterator<Item = (Eye, &View)> {
        self.eyes.iter().copied().zip(&self.views)
    }

    /// Whether a frame waits for events of the session.
    pub fn is_waiting(&self) -> bool {
        self.wanted.is_some()
    }

    /// Whether a hub has sent frames within the last second.
    fn has_hub(&self) -> bool {
        self.hub.is_some_and(|(_, heard)| heard.elapsed() < SILENCE)
    }

    /// Counts so far.
    pub fn counts(&self) -> NodeCounts {
        NodeCounts { frames: self.frames, events: self.follower.applied, garbage: self.garbage }
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.wire.publish(message::write(&FromNode::Leaving { node: self.number }));
    }
}
