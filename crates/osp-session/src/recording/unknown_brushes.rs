use std::{collections::BTreeSet, path::Path};

use super::Event;
use crate::brush;

const MOST_NAMES: usize = 1000;
const MOST_NAMED: usize = 4;

#[derive(Debug, Default)]
pub(super) struct UnknownBrushes(BTreeSet<String>);

impl UnknownBrushes {
    pub(super) fn note(&mut self, event: &Event) {
        if let Event::Begin { paint: Some(paint), .. } = event
            && self.0.len() < MOST_NAMES
            && !paint.brush.is_empty()
            && brush::find(&paint.brush).is_none()
            && !self.0.contains(&paint.brush)
        {
            self.0.insert(paint.brush.clone());
        }
    }

    /// A line that lists them; `None` if all brushes are known.
    pub(super) fn warning(&self, path: &Path) -> Option<String> {
        let mut names: Vec<String> = self.0.iter().take(MOST_NAMED).map(|name| format!("`{name}`")).collect();
        if self.0.len() > MOST_NAMED {
            names.push("…".to_owned());
        }
        let (path, names) = (path.display(), names.join(", "));
        match self.0.len() {
            0 => None,
            1 => Some(format!("{path}: the brush {names} is unknown: its strokes are plain ribbons")),
            count => Some(format!(
                "{path}: {count} brushes are unknown ({names}): their strokes are plain ribbons"
            )),
        }
    }
}
