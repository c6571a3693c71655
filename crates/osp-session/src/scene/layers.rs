//! Layers: their properties, and the strokes on them.

use std::collections::BTreeMap;

use super::{Scene, edit::Arrangement};
use crate::recording::{Author, StrokeId};

/// Properties of a layer that events have set. Properties that are `None` are those of the session's header.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerState {
    pub name: Option<String>,
    pub hidden: Option<bool>,
    /// Whether the window refuses to edit the layer's strokes.
    pub locked: Option<bool>,
    /// The layer's owner: the first author who changed it. After the owner has left, the next author who closes the
    /// layer becomes its owner. Layer 0 has no owner.
    pub owner: Option<Author>,
}

impl Scene {
    pub fn layer_states(&self) -> &BTreeMap<u32, LayerState> {
        &self.layers
    }

    /// Whether the window refuses to edit strokes on this layer.
    pub fn is_locked(&self, layer: u32) -> bool {
        self.layers.get(&layer).is_some_and(|state| state.locked == Some(true))
    }

    /// The present author who has closed a layer. Only this author may draw on it.
    pub fn closed_by(&self, layer: u32) -> Option<Author> {
        self.closed_layers.get(&layer).copied()
    }

    /// Whether an author may draw on a layer, and change the layer and its strokes. The answer is `false` if another
    /// author has closed the layer ([`mine`](crate::recording::Event::Layer::mine)).
    ///
    /// Other authors' events about a closed layer are ignored and counted. Events that list several strokes skip the
    /// strokes on the layer. A group with a stroke on the layer can neither be placed nor get another parent. A stroke
    /// that began before the layer was closed may continue. Every author can undo and redo their own edits. The host
    /// ([`Author::SOLE`]) may change every layer.
    pub fn may_touch(&self, author: Author, layer: u32) -> bool {
        author.is_sole() || self.closed_by(layer).is_none_or(|owner| owner == author)
    }

    /// Whether an author may place a group: the author must be allowed to edit every stroke of the group's subtree.
    pub(super) fn may_place(&self, author: Author, group: usize) -> bool {
        if author.is_sole() || self.closed_layers.values().all(|owner| *owner == author) {
            return true;
        }
        let mut walk = vec![group];
        while let Some(group) = walk.pop() {
            if !self.groups.layers(group).all(|layer| self.may_touch(author, layer)) {
                return false;
            }
            walk.extend(self.groups.below(Some(group)));
        }
        true
    }

    /// Checks that an author may change a layer; returns `None` if not. Opens or closes the layer if `mine` is given.
    pub(super) fn claim_layer(&mut self, author: Author, layer: u32, mine: Option<bool>) -> Option<()> {
        if !self.may_touch(author, layer) {
            return None;
        }
        let known = self.layers.get(&layer).and_then(|state| state.owner);
        let is_free = known.is_none_or(|owner| owner.is_sole() || !self.is_there(owner));
        let is_own = !author.is_sole() && layer > 0 && (is_free || known == Some(author));
        if mine.is_some() && !is_own {
            return None;
        }
        match mine {
            Some(true) => _ = self.closed_layers.insert(layer, author),
            Some(false) => _ = self.closed_layers.remove(&layer),
            None => {}
        }
        if layer > 0 && (known.is_none() || mine == Some(true)) {
            self.layers.entry(layer).or_default().owner = Some(author);
        }
        Some(())
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
        if state.hidden != was_hidden {
            // The layers of a frame are hidden in one pass over all strokes.
            if self.to_hide.is_empty() {
                self.looked_at += self.strokes.len() as u64;
            }
            self.to_hide.insert(layer);
        }
        Some(())
    }

    /// Hides and shows the strokes of the layers that were hidden or shown in this frame.
    pub(super) fn hide_layers(&mut self) {
        let to_hide = std::mem::take(&mut self.to_hide);
        if to_hide.is_empty() {
            return;
        }
        for at in 0..self.strokes.len() as u32 {
            if let Some(layer) = self.strokes.get(at as usize).map(|stroke| stroke.layer)
                && to_hide.contains(&layer)
            {
                self.set_layer(at, layer);
            }
        }
    }

    pub(super) fn assign(&mut self, author: Author, layer: u32, strokes: &[StrokeId]) -> Option<()> {
        if !self.may_touch(author, layer) {
            return None;
        }
        let strokes = self.named(author, strokes, |stroke| Some(stroke.layer));
        if strokes.is_empty() {
            return None;
        }
        strokes.iter().for_each(|named| self.set_layer(named.stroke, layer));
        self.arrange(author, Arrangement::Assign { layer, strokes });
        Some(())
    }

    pub(super) fn set_layer(&mut self, at: u32, layer: u32) {
        let Some(stroke) = self.strokes.get_mut(at as usize).filter(|stroke| !stroke.is_gone) else { return };
        let before = std::mem::replace(&mut stroke.layer, layer);
        self.groups.change_layer(stroke.group, before, layer);
        let state = self.layers.get(&layer);
        let was = stroke.is_visible();
        stroke.is_hidden = state.and_then(|state| state.hidden).unwrap_or(stroke.was_hidden);
        self.follow_visibility(at, was);
    }
}
