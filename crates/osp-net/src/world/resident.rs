//! The blocks in memory: a cache of bounded size, and the threads that fill it.

use std::{
    sync::{
        Arc, Condvar, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread::JoinHandle,
};

use quick_cache::{DefaultHashBuilder, OptionsBuilder, sync::Cache, sync::DefaultLifecycle};

use super::{
    World, WorldError,
    block::Block,
    loaders::{self, ByBytes, Load, Queue, Shared},
};

/// Memory for blocks, and number of loading threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResidentConfig {
    /// Memory for blocks, bytes, including blocks that are being loaded. The manifest and the index of the blocks take
    /// additional memory ([`World::bytes`]).
    pub memory: u64,
    /// Number of threads that load blocks.
    pub loaders: usize,
}

impl Default for ResidentConfig {
    /// One gibibyte, two threads.
    fn default() -> Self {
        Self { memory: 1 << 30, loaders: 2 }
    }
}

/// The blocks of a world that are in memory.
pub(super) struct Residents {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    /// Size of the cache, bytes.
    pub(super) cache_bytes: u64,
}

impl std::fmt::Debug for Residents {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Residents").field("cache_bytes", &self.cache_bytes).finish_non_exhaustive()
    }
}

impl Residents {
    pub(super) fn new(world: Arc<World>, config: ResidentConfig) -> Result<Self, WorldError> {
        Self::with(world, config, loaders::load)
    }

    fn with(world: Arc<World>, config: ResidentConfig, load: Load) -> Result<Self, WorldError> {
        let threads = config.loaders.max(1);
        let blocks = &world.manifest.blocks;
        let (mut largest, mut raw, mut all) = (0, 0, 0);
        for block in blocks {
            let most = Block::max_memory_of(block.polygons as usize);
            (largest, raw, all) = (most.max(largest), u64::from(block.bytes).max(raw), all + most);
        }
        // Besides the cache, memory is needed for the block that each thread loads, for the arrivals, and for the block
        // that the frame reads.
        let in_hand = threads as u64 * (raw + 2 * largest) + largest;
        let least = in_hand + largest;
        if config.memory < least {
            return Err(WorldError::Memory { least, given: config.memory });
        }
        let cache_bytes = config.memory - in_hand;
        let items = (cache_bytes.min(all) / (all / blocks.len().max(1) as u64).max(1)).max(1);
        // Few threads need only one shard. With one shard, `cache_bytes` limits the total size of all blocks.
        let options = OptionsBuilder::new()
            .shards(1)
            .estimated_items_capacity(items as usize)
            .weight_capacity(cache_bytes)
            .build()
            .map_err(|error| world.unusable(&error.to_string()))?;
        let cache =
            Cache::with_options(options, ByBytes, DefaultHashBuilder::default(), DefaultLifecycle::default());
        let shared = Arc::new(Shared {
            world,
            cache,
            queue: Mutex::new(Queue::new(threads)),
            requests: Condvar::new(),
            arrivals: Condvar::new(),
            held: Arc::default(),
            bytes_read: AtomicU64::new(0),
            blocks_read: AtomicU64::new(0),
        });
        let mut this = Self { shared, threads: Vec::new(), cache_bytes };
        for number in 0..threads {
            let shared = Arc::clone(&this.shared);
            let thread = std::thread::Builder::new()
                .name(format!("blocks {number}"))
                .spawn(move || loaders::run(&shared, load))
                .map_err(|error| this.shared.world.unusable(&format!("a thread to load blocks: {error}")))?;
            this.threads.push(thread);
        }
        Ok(this)
    }

    /// A block, if it is in memory.
    pub(super) fn get(&self, block: u32) -> Option<Arc<Block>> {
        self.shared.cache.get(&block)
    }

    pub(super) fn is_there(&self, block: u32) -> bool {
        self.shared.cache.contains_key(&block)
    }

    /// Replaces the previous frame's requests by these blocks, the most important first. [`Residents::next`] returns
    /// the first `awaited` blocks, for which the frame waits.
    pub(super) fn request(&self, blocks: &[u32], awaited: usize) {
        let mut queue = self.shared.queue();
        queue.request(blocks, awaited);
        drop(queue);
        if !blocks.is_empty() {
            self.shared.requests.notify_all();
        }
    }

    /// Waits for the blocks that this frame still needs, and returns the first block that is loaded.
    pub(super) fn next(&self) -> Result<(u32, Arc<Block>), WorldError> {
        let mut queue = self.shared.queue();
        loop {
            if let Some(error) = queue.failure() {
                return Err(error);
            }
            if let Some(arrival) = queue.arrival() {
                drop(queue);
                self.shared.requests.notify_all();
                return Ok(arrival);
            }
            queue = self.shared.wait(&self.shared.arrivals, queue);
        }
    }

    /// Returns the first error of any thread.
    pub(super) fn check(&self) -> Result<(), WorldError> {
        self.shared.queue().failure().map_or(Ok(()), Err)
    }

    pub(super) fn bytes_read(&self) -> u64 {
        self.shared.bytes_read.load(Ordering::Relaxed)
    }

    pub(super) fn blocks_read(&self) -> u64 {
        self.shared.blocks_read.load(Ordering::Relaxed)
    }

    /// Largest memory of blocks at one time, bytes.
    pub(super) fn most_held(&self) -> u64 {
        self.shared.held.most()
    }
}

impl Drop for Residents {
    fn drop(&mut self) {
        self.shared.queue().end();
        self.shared.requests.notify_all();
        for thread in self.threads.drain(..) {
            // A thread that panicked has printed its panic and informed the waiting frame.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::world::{PackOrder, Place, Replacing, WorldWriter};
    use osp_session::{
        recording::{SynthKind, synthesize},
        scene::Scene,
    };

    #[test]
    fn a_thread_that_panics_is_an_error_for_whoever_waits_for_it() {
        let (mut scene, mut changes) = (Scene::new(), Vec::new());
        for event in synthesize(SynthKind::Scribble, 500, 1) {
            scene.apply(&event.expect("an event"), &mut changes);
            scene.free_unreachable();
        }
        let folder = tempfile::tempdir().expect("a folder");
        let text = folder.path().to_str().expect("UTF-8");
        let place = Place::to_write(text).expect("a folder");
        let mut writer = WorldWriter::create(place, Replacing::Never, PackOrder::Space).expect("begun");
        writer.add("session", &scene, &[Vec3::ZERO]).expect("blocks");
        writer.finish().expect("packed");
        let world = Arc::new(World::open(Place::to_read(text).expect("a folder")).expect("a world"));
        let panics: Load = |_, number| panic!("block {number}: of the test");
        let residents = Residents::with(world, ResidentConfig::default(), panics).expect("threads");
        residents.request(&[0], 1);
        let error = residents.next().expect_err("nobody brings it").to_string();
        assert!(error.ends_with("the thread that loads blocks has stopped: it panicked"), "{error}");
        assert!(residents.check().is_err(), "a frame that does not wait is told, too");
    }
}
