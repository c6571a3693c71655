use std::path::{Path, PathBuf};

use super::{
    Event, EventSource, Notes, OpenOptions, Place, RecordingError, error::beyond, tally::Tally,
    unknown_brushes::UnknownBrushes,
};

/// A source that ends where the session exceeds its limits. It also collects unknown brushes.
pub(super) struct Limited {
    source: Box<dyn EventSource>,
    path: PathBuf,
    options: OpenOptions,
    read: Tally,
    /// Message about the limit at which a lenient reader ended.
    warning: Option<String>,
    unknown_brushes: UnknownBrushes,
    is_over: bool,
}

impl Limited {
    pub(super) fn new(source: Box<dyn EventSource>, path: &Path, options: &OpenOptions) -> Self {
        Self {
            source,
            path: path.to_owned(),
            options: *options,
            read: Tally::default(),
            warning: None,
            unknown_brushes: UnknownBrushes::default(),
            is_over: false,
        }
    }

    fn stop(&mut self, mut error: RecordingError) -> Result<Option<Event>, RecordingError> {
        self.is_over = true;
        // The source has ended, so the data about open strokes can be freed.
        let read = std::mem::take(&mut self.read);
        if let RecordingError::Limit(excess) = &mut error {
            excess.read = Some(read.to_string());
        }
        if !self.options.lenient {
            return Err(error);
        }
        self.warning = Some(format!("{error}; reading ended there"));
        Ok(None)
    }
}

impl EventSource for Limited {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        if self.is_over {
            return Ok(None);
        }
        let event = match self.source.next_event() {
            Ok(Some(event)) => event,
            Err(error @ RecordingError::Limit { .. }) => return self.stop(error),
            other => return other,
        };
        if let Err((most, what)) = self.read.count(&event, &self.options.limits) {
            return self.stop(beyond(&self.path, self.source.place(), most, what));
        }
        self.unknown_brushes.note(&event);
        Ok(Some(event))
    }

    fn line(&self) -> Option<&str> {
        self.source.line()
    }

    fn notes(&self) -> Notes {
        let mut notes = self.source.notes();
        notes.skipped += u64::from(self.warning.is_some());
        notes.warnings.extend(self.warning.clone());
        notes.warnings.extend(self.unknown_brushes.warnings(&self.path));
        notes
    }

    fn place(&self) -> Place {
        self.source.place()
    }
}
