//! Layers: named, hidden and locked, and the strokes on them.

use std::collections::BTreeMap;

use super::{Scene, edit::Arrangement};
use crate::recording::{Author, StrokeId};

/// What events have said of a layer; what they have not is as the session's header says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerState {
    /// Its name.
    pub name: Option<String>,
    /// Whether its strokes are not drawn.
    pub hidden: Option<bool>,
    /// Whether its strokes are to be left alone.
    pub locked: Option<bool>,
}

impl Scene {
    /// What events have said of the layers, by their numbers.
    pub fn layer_states(&self) -> &BTreeMap<u32, LayerState> {
        &self.layers
    }

    /// Whether strokes on this layer are to be left alone.
    pub fn is_locked(&self, layer: u32) -> bool {
        self.layers.get(&layer).is_some_and(|state| state.locked == Some(true))
    }

    pub(super) fn change_layer(
        &mut self,
        layer: u32,
        name: Option<&str>,
        hidden: Option<bool>,
        locked: Option<bool>,
    ) -> Option<()> {
        let state = self.layers.entry(layer).or_default();
        state.name = name.map(str::to_owned).or_else(|| state.name.take());
        state.locked = locked.or(state.locked);
        let was_hidden = state.hidden;
        state.hidden = hidden.or(was_hidden);
        // The strokes may say something else than the layer, so all are asked unless events have said the same before.
        if let Some(hidden) = hidden
            && was_hidden != Some(hidden)
        {
            for at in 0..self.strokes.len() as u32 {
                if self.strokes.get(at as usize).is_some_and(|stroke| stroke.layer == layer) {
                    self.set_hidden(at, hidden);
                }
            }
        }
        Some(())
    }

    fn set_hidden(&mut self, at: u32, hidden: bool) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let was = stroke.is_visible();
        stroke.is_hidden = hidden;
        self.follow_visibility(at, was);
    }

    pub(super) fn assign(&mut self, author: Author, layer: u32, strokes: &[StrokeId]) -> Option<()> {
        let strokes = self.named(strokes, |stroke| Some(stroke.layer));
        if strokes.is_empty() {
            return None;
        }
        strokes.iter().for_each(|named| self.set_layer(named.stroke, layer));
        self.arrange(author, Arrangement::Assign { layer, strokes });
        Some(())
    }

    pub(super) fn set_layer(&mut self, at: u32, layer: u32) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        stroke.layer = layer;
        let state = self.layers.get(&layer);
        let hidden = state.and_then(|state| state.hidden).unwrap_or(stroke.was_hidden);
        self.set_hidden(at, hidden);
    }
}
