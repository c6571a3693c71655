use std::path::Path;

use super::{Event, EventSource, Header, OpenOptions, RecordingError, limited::Limited};

pub struct Session {
    pub header: Header,
    /// Short name of the format, for `osp info`: `ron`, `ron.zst`, `tilt`, `apa`, `cassie`, `poses`, `obj`, `glb`, `gltf`.
    pub format: &'static str,
    pub events: Box<dyn EventSource>,
}

impl Session {
    /// A session that `source` reads from `path`, up to the limits of the options.
    pub fn new(
        header: Header,
        format: &'static str,
        source: Box<dyn EventSource>,
        path: &Path,
        options: &OpenOptions,
    ) -> Self {
        Self { header, format, events: Box::new(Limited::new(source, path, options)) }
    }
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session")
            .field("header", &self.header)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

impl Iterator for Session {
    type Item = Result<Event, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.events.next_event().transpose()
    }
}
