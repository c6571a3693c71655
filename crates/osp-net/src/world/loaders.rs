//! The threads that load blocks, and the requests for them.

use std::{
    collections::{BTreeSet, VecDeque},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use quick_cache::{Weighter, sync::Cache};

use super::{
    World, WorldError,
    block::{Block, MemoryShare, MemoryUse},
};
use osp::math::Aabb;

/// Requested blocks, the most important first.
type Requests = VecDeque<u32>;

/// Requested blocks, blocks that are being loaded, and blocks that a frame waits for.
pub(super) struct Queue {
    requests: Requests,
    /// Blocks that a thread is loading.
    loading: BTreeSet<u32>,
    /// Blocks that the frame waits for.
    awaited: BTreeSet<u32>,
    arrivals: VecDeque<(u32, Arc<Block>)>,
    /// Largest number of loaded blocks that wait for the frame.
    most_arrivals: usize,
    failure: Option<WorldError>,
    ends: bool,
}

impl Queue {
    pub(super) fn new(most_arrivals: usize) -> Self {
        Self {
            requests: Requests::new(),
            loading: BTreeSet::new(),
            awaited: BTreeSet::new(),
            arrivals: VecDeque::new(),
            most_arrivals,
            failure: None,
            ends: false,
        }
    }

    pub(super) fn request(&mut self, blocks: &[u32], awaited: usize) {
        self.requests.clear();
        self.requests.extend(blocks);
        self.awaited.clear();
        self.awaited.extend(&blocks[..awaited]);
    }

    pub(super) fn arrival(&mut self) -> Option<(u32, Arc<Block>)> {
        self.arrivals.pop_front()
    }

    pub(super) fn failure(&self) -> Option<WorldError> {
        self.failure.clone()
    }

    pub(super) fn end(&mut self) {
        self.ends = true;
    }

    /// The next requested block that no thread is loading.
    fn take(&mut self) -> Option<u32> {
        loop {
            let block = self.requests.pop_front()?;
            if self.loading.insert(block) {
                return Some(block);
            }
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct ByBytes;

impl Weighter<u32, Arc<Block>> for ByBytes {
    fn weight(&self, _number: &u32, block: &Arc<Block>) -> u64 {
        block.bytes as u64
    }
}

type BlockCache = Cache<u32, Arc<Block>, ByBytes>;

/// State that the threads share with the frame.
pub(super) struct Shared {
    pub(super) world: Arc<World>,
    pub(super) cache: BlockCache,
    pub(super) queue: Mutex<Queue>,
    /// Signals new requests, and that the frame has taken a loaded block.
    pub(super) requests: Condvar,
    /// Signals that a block for which a frame waits is loaded.
    pub(super) arrivals: Condvar,
    pub(super) held: Arc<MemoryUse>,
    pub(super) bytes_read: AtomicU64,
    pub(super) blocks_read: AtomicU64,
}

impl Shared {
    pub(super) fn queue(&self) -> MutexGuard<'_, Queue> {
        // A panic cannot leave the queue in an inconsistent state.
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn wait<'a>(&self, on: &Condvar, queue: MutexGuard<'a, Queue>) -> MutexGuard<'a, Queue> {
        on.wait(queue).unwrap_or_else(PoisonError::into_inner)
    }
}

/// The function that loads a block.
pub(super) type Load = fn(&Shared, u32) -> Result<Arc<Block>, WorldError>;

/// Reports a panic of this thread to the waiting frame.
struct Watch<'a>(&'a Shared);

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let stopped = self.0.world.unusable("the thread that loads blocks has stopped: it panicked");
            self.0.queue().failure.get_or_insert(stopped);
            self.0.arrivals.notify_all();
        }
    }
}

/// Loads requested blocks until the walk ends.
pub(super) fn run(shared: &Shared, load: Load) {
    let _watch = Watch(shared);
    loop {
        let mut queue = shared.queue();
        let block = loop {
            if queue.ends {
                return;
            }
            match queue.take() {
                Some(block) => break block,
                None => queue = shared.wait(&shared.requests, queue),
            }
        };
        drop(queue);
        // Another thread may have loaded the block meanwhile.
        let outcome = shared.cache.peek(&block).map_or_else(|| load(shared, block), Ok);
        let mut queue = shared.queue();
        while queue.arrivals.len() >= queue.most_arrivals && queue.awaited.contains(&block) && !queue.ends {
            queue = shared.wait(&shared.requests, queue);
        }
        queue.loading.remove(&block);
        match outcome {
            Ok(loaded) => {
                if queue.awaited.remove(&block) {
                    queue.arrivals.push_back((block, loaded));
                }
            }
            Err(error) => {
                queue.failure.get_or_insert(error);
            }
        }
        drop(queue);
        shared.arrivals.notify_all();
    }
}

pub(super) fn load(shared: &Shared, number: u32) -> Result<Arc<Block>, WorldError> {
    let entry = shared.world.entry(number);
    // The share covers the block's bytes, and its boxes before they are grouped by sixteen.
    let raw =
        MemoryShare::new(&shared.held, entry.bytes as usize + entry.polygons as usize * size_of::<Aabb>());
    let (block, bytes) = shared.world.load(number)?;
    let block = Arc::new(block.held_by(&shared.held));
    drop(raw);
    shared.bytes_read.fetch_add(bytes, Ordering::Relaxed);
    shared.blocks_read.fetch_add(1, Ordering::Relaxed);
    shared.cache.insert(number, Arc::clone(&block));
    Ok(block)
}
