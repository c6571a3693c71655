use std::{collections::BTreeMap, path::Path};

use super::Event;
use crate::brush;

const MOST_NAMES: usize = 1000;
const MOST_NAMED: usize = 4;

/// The brushes without their own look, and whether it is at least a similar one.
#[derive(Debug, Default)]
pub(super) struct UnknownBrushes(BTreeMap<String, bool>);

impl UnknownBrushes {
    pub(super) fn note(&mut self, event: &Event) {
        if let Event::Begin { paint: Some(paint), .. } = event
            && self.0.len() < MOST_NAMES
            && !paint.brush.is_empty()
            && let found = brush::find(&paint.brush)
            && found.is_none_or(|brush| brush.is_approximate)
            && !self.0.contains_key(&paint.brush)
        {
            self.0.insert(paint.brush.clone(), found.is_some());
        }
    }

    /// Lines that list them.
    pub(super) fn warnings(&self, path: &Path) -> impl Iterator<Item = String> {
        let line = |is_similar: bool, drawn: &str| {
            let all = || self.0.iter().filter(|(_, similar)| **similar == is_similar).map(|(name, _)| name);
            let mut names: Vec<String> = all().take(MOST_NAMED).map(|name| format!("`{name}`")).collect();
            let count = all().count();
            if count > MOST_NAMED {
                names.push("…".to_owned());
            }
            let (path, names) = (path.display(), names.join(", "));
            match count {
                0 => None,
                1 => Some(format!("{path}: the brush {names} is {drawn}")),
                _ => Some(format!("{path}: {count} brushes are {drawn} ({names})")),
            }
        };
        let lines = [
            line(false, "unknown: strokes with it are plain ribbons"),
            line(true, "drawn as the nearest one that osp has"),
        ];
        lines.into_iter().flatten()
    }
}
