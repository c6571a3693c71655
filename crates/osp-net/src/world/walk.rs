use std::{sync::Arc, time::Instant};

use super::{ResidentConfig, World, WorldError, block::Block, resident::Residents};
use osp::{
    math::{Aabb, Frustum},
    polygon::VisibleBlocks,
    view::View,
};
use osp_session::replay::SetFingerprint;

/// Treatment of blocks in view that are not in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The frame continues without the missing blocks, counts them, and requests them for later frames.
    Count,
    /// The frame waits for the missing blocks.
    Wait,
}

/// The result of a frame of a walk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Number of the frame, from 0 on.
    pub number: u64,
    /// Number of blocks in view.
    pub blocks: u64,
    /// Number of polygons in view, in blocks in memory.
    pub visible: u64,
    /// Number of blocks in view that were not in memory when the frame began.
    pub late: u64,
    /// Number of blocks in view that the frame skipped.
    pub missing_blocks: u64,
    /// Number of polygons of the skipped blocks. This is an upper bound of the polygons in view that [`Frame::visible`]
    /// lacks.
    pub missing_polygons: u64,
    /// Time of the frame's thread without waiting and without the fingerprint, nanoseconds.
    pub work_ns: u64,
    /// Time spent waiting for blocks, nanoseconds.
    pub wait_ns: u64,
    /// Fingerprint of the polygons in view that are in memory, computed as by
    /// [`osp_session::replay::fingerprint_of_frame`].
    pub fingerprint: u64,
}

/// The cost of a walk so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WalkCounts {
    /// Number of bytes of blocks that were read.
    pub bytes_read: u64,
    /// Number of blocks that were read. A block that is dropped and read again counts again.
    pub blocks_read: u64,
    /// Largest memory of blocks, and of buffers that become blocks, at one time, bytes.
    pub most_resident_bytes: u64,
}

/// Culls a world frame by frame, while other threads load blocks.
pub struct Walk {
    world: Arc<World>,
    residents: Residents,
    frames: u64,
    // Working memory, kept from frame to frame.
    in_view: VisibleBlocks,
    ahead: VisibleBlocks,
    seen: VisibleBlocks,
    late: Vec<u32>,
}

impl std::fmt::Debug for Walk {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Walk")
            .field("world", &self.world)
            .field("frames", &self.frames)
            .finish_non_exhaustive()
    }
}

impl Walk {
    /// A walk before its first frame, without blocks in memory.
    ///
    /// # Errors
    /// [`WorldError::Memory`], or the system provides no threads.
    pub fn new(world: Arc<World>, config: ResidentConfig) -> Result<Self, WorldError> {
        let residents = Residents::new(Arc::clone(&world), config)?;
        Ok(Self {
            world,
            residents,
            frames: 0,
            in_view: VisibleBlocks::new(),
            ahead: VisibleBlocks::new(),
            seen: VisibleBlocks::new(),
            late: Vec::new(),
        })
    }

    /// Number of bytes and blocks read so far, and the peak memory of blocks.
    pub fn counts(&self) -> WalkCounts {
        WalkCounts {
            bytes_read: self.residents.bytes_read(),
            blocks_read: self.residents.blocks_read(),
            most_resident_bytes: self.residents.most_held(),
        }
    }

    /// Plays the next frame. Blocks of `ahead`, a view that is expected later, are loaded after the blocks of this frame,
    /// if the memory has room for both.
    ///
    /// # Errors
    /// A block cannot be loaded: a block of this frame, or a block of an earlier frame that is loaded in the
    /// background.
    pub fn frame(
        &mut self,
        view: &View,
        ahead: Option<&View>,
        missing: Missing,
    ) -> Result<Frame, WorldError> {
        self.residents.check()?;
        let start = Instant::now();
        let mut tally = Tally::new(view.frustum());
        self.world.blocks_in_view(&tally.frustum, &mut self.in_view);
        self.late.clear();
        for id in self.in_view.ids() {
            match self.residents.get(id.0) {
                Some(block) => tally.add(&block, self.world.entry(id.0).bounds, &mut self.seen),
                None => self.late.push(id.0),
            }
        }
        let mut frame = Frame {
            number: self.frames,
            blocks: self.in_view.len() as u64,
            late: self.late.len() as u64,
            ..Frame::default()
        };
        let awaited = if missing == Missing::Wait { self.late.len() } else { 0 };
        self.request(view, ahead, awaited);
        if missing == Missing::Wait {
            for _ in 0..awaited {
                let waiting = Instant::now();
                let (number, block) = self.residents.next()?;
                frame.wait_ns += nanoseconds_since(waiting);
                tally.add(&block, self.world.entry(number).bounds, &mut self.seen);
            }
        } else {
            let world = &self.world;
            frame.missing_blocks = frame.late;
            let late = self.late[..frame.late as usize].iter();
            frame.missing_polygons = late.map(|&block| u64::from(world.entry(block).polygons)).sum();
        }
        let spent_ns = nanoseconds_since(start);
        frame.work_ns = spent_ns.saturating_sub(frame.wait_ns + tally.fingerprint_ns);
        frame.visible = tally.set.count();
        frame.fingerprint = tally.set.value();
        self.frames += 1;
        Ok(frame)
    }

    /// Requests missing blocks, the nearest first, then the blocks of the view ahead. If not all blocks in view fit into
    /// memory, a frame that does not wait requests only the nearest blocks. Otherwise blocks would displace each other in
    /// turns.
    fn request(&mut self, view: &View, ahead: Option<&View>, awaited: usize) {
        let world = &self.world;
        let room_of = |block: u32| Block::max_memory_of(world.entry(block).polygons as usize);
        let mut room = self.residents.cache_bytes;
        let in_view: u64 = self.in_view.ids().map(|id| room_of(id.0)).sum();
        let eye = view.eye_in_world;
        let distance = |block: &u32| world.entry(*block).bounds.distance_squared(eye);
        self.late.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
        if awaited == 0 && in_view > room && !self.late.is_empty() {
            // These are the nearest blocks that fit, whether they are in memory already or not.
            let mut nearest: Vec<u32> = self.in_view.ids().map(|id| id.0).collect();
            nearest.sort_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
            let fits = |&block: &u32| {
                let fits = room_of(block) <= room;
                room = room.saturating_sub(room_of(block));
                fits
            };
            let fitting = nearest.into_iter().take_while(fits);
            let wanted: Vec<u32> = fitting.filter(|&block| !self.residents.is_there(block)).collect();
            self.residents.request(&wanted, 0);
            return;
        }
        let late = self.late.len();
        let mut room = room.saturating_sub(in_view);
        if let Some(ahead) = ahead {
            self.world.blocks_in_view(&ahead.frustum(), &mut self.ahead);
            for id in self.ahead.ids().filter(|&id| !self.in_view.contains(id)) {
                room = room.saturating_sub(room_of(id.0));
                if room == 0 {
                    break;
                }
                if !self.residents.is_there(id.0) {
                    self.late.push(id.0);
                }
            }
        }
        self.residents.request(&self.late, awaited);
        self.late.truncate(late);
    }
}

/// The result of a frame so far.
struct Tally {
    frustum: Frustum,
    set: SetFingerprint,
    fingerprint_ns: u64,
}

impl Tally {
    fn new(frustum: Frustum) -> Self {
        Self { frustum, set: SetFingerprint::default(), fingerprint_ns: 0 }
    }

    fn add(&mut self, block: &Block, bounds: Aabb, seen: &mut VisibleBlocks) {
        let how = self.frustum.classify(&bounds);
        if block.cull(&self.frustum, how, seen) {
            let start = Instant::now();
            self.set.add(block.fingerprint_of(seen));
            self.fingerprint_ns += nanoseconds_since(start);
        } else {
            self.set.add(block.all);
        }
    }
}

fn nanoseconds_since(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX)
}
