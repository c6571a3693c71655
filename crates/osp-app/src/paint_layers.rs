//! The layers of a session in the window, with their names and states. New strokes are drawn on the current layer.

use std::collections::BTreeMap;

use crate::{altering::assign, studio::Studio};
use osp_session::recording::{Author, Event, Paint};

/// A layer as the window shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LayerRow {
    pub layer: u32,
    pub name: String,
    /// Whether the layer's strokes are hidden.
    pub is_hidden: bool,
    /// Whether the layer's strokes can be neither selected nor erased.
    pub is_locked: bool,
    /// The layer's owner, by number and name, in a session of several authors.
    pub owner: Option<(Author, String)>,
    /// Whether only the owner may draw on the layer and change it.
    pub is_closed: bool,
}

/// A change of the layers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LayerEdit {
    /// Create a layer and make it the current layer.
    New,
    /// Make a layer the current layer.
    Choose(u32),
    Name(u32, String),
    /// Hide or show the current layer.
    ToggleHidden,
    /// Lock or unlock the current layer.
    ToggleLocked,
    /// Hide or show a layer.
    Hide(u32, bool),
    /// Lock or unlock a layer.
    Lock(u32, bool),
    /// Close a layer of the user to all other authors, or open it.
    Close(u32, bool),
    /// Move the selected strokes to the current layer.
    TakeSelection,
}

/// An author's name, or the number if the name is empty.
pub(super) fn name_or_number(author: Author, name: &str) -> String {
    if name.trim().is_empty() { format!("author {author}") } else { name.to_owned() }
}

/// Sets the layer of a new stroke. A stroke without a brush gets an empty brush, which stores the layer.
pub(super) fn on_layer(paint: Option<Box<Paint>>, layer: u32) -> Option<Box<Paint>> {
    if layer == 0 {
        return paint;
    }
    let mut paint = paint.unwrap_or_else(|| Box::new(Paint::new("", 0)));
    paint.layer = layer;
    Some(paint)
}

impl Studio {
    /// The layers in order. The list of a session without layers has one default layer.
    pub fn session_layers(&self) -> Vec<LayerRow> {
        let header = &self.session.header().layers;
        let states = self.scene().layer_states();
        let known = states.keys().next_back().map_or(0, |&last| last + 1);
        let count = known.max(header.len().min(Event::MAX_LAYERS as usize) as u32).max(1);
        (0..count).map(|layer| self.session_layer(layer)).collect()
    }

    pub(crate) fn session_layer(&self, layer: u32) -> LayerRow {
        let header = self.session.header().layers.get(layer as usize);
        let state = self.scene().layer_states().get(&layer);
        let of_header = header.map(|header| header.name.clone()).filter(|name| !name.is_empty());
        let name = state.and_then(|state| state.name.clone()).or(of_header);
        let hidden = state.and_then(|state| state.hidden);
        LayerRow {
            layer,
            name: name.unwrap_or_else(|| format!("layer {}", layer + 1)),
            is_hidden: hidden.unwrap_or_else(|| header.is_some_and(|header| header.hidden)),
            is_locked: self.scene().is_locked(layer),
            owner: state.and_then(|state| state.owner).and_then(|owner| {
                let info = self.scene().author(owner)?;
                Some((owner, info.name.clone()))
            }),
            is_closed: self.scene().closed_by(layer).is_some(),
        }
    }

    /// The current layer, on which new strokes are drawn.
    pub fn chosen_layer(&self) -> u32 {
        self.input.brush.layer
    }

    /// Whether this window's author may close a layer to other authors, or open it again.
    pub fn can_close_layer(&self, layer: u32) -> bool {
        let me = self.author();
        let owner = self.scene().layer_states().get(&layer).and_then(|state| state.owner);
        let is_there = |owner| self.scene().author(owner).is_some_and(|info| info.left_secs.is_none());
        let is_free = owner.is_some_and(|owner| owner == me || !is_there(owner));
        self.can_draw() && !me.is_sole() && layer > 0 && is_free
    }

    /// Whether another author has closed the layer to this window's author.
    pub fn is_layer_of_others(&self, layer: u32) -> bool {
        !self.scene().may_touch(self.author(), layer)
    }

    pub(crate) fn can_edit_layers(&self, edit: &LayerEdit) -> bool {
        let chosen = self.input.brush.layer;
        self.can_draw()
            && match edit {
                LayerEdit::Close(layer, _) => self.can_close_layer(*layer),
                LayerEdit::ToggleHidden | LayerEdit::ToggleLocked => !self.is_layer_of_others(chosen),
                LayerEdit::Name(layer, _) | LayerEdit::Hide(layer, _) | LayerEdit::Lock(layer, _) => {
                    !self.is_layer_of_others(*layer)
                }
                LayerEdit::TakeSelection if self.is_layer_of_others(chosen) => false,
                LayerEdit::New => self.session_layers().len() < Event::MAX_LAYERS as usize,
                LayerEdit::TakeSelection => !self.input.selection.is_empty(),
                _ => true,
            }
    }

    pub(crate) fn edit_layers(&mut self, edit: LayerEdit) {
        self.finish_gestures();
        if !self.can_edit_layers(&edit) {
            return;
        }
        let t = self.now_secs();
        let chosen = self.session_layer(self.input.brush.layer);
        let change = |layer, name, hidden, locked, mine| Event::Layer {
            author: Author::SOLE,
            t,
            layer,
            name,
            hidden,
            locked,
            mine,
        };
        let hide = |layer, hidden| change(layer, None, Some(hidden), None, None);
        let lock = |layer, locked| change(layer, None, None, Some(locked), None);
        match edit {
            LayerEdit::New => {
                let layer = self.session_layers().len() as u32;
                let name = Some(format!("layer {}", layer + 1));
                self.events.push(change(layer, name, Some(false), None, None));
                self.input.brush.layer = layer;
            }
            LayerEdit::Choose(layer) => self.input.brush.layer = layer,
            LayerEdit::Name(layer, mut name) => {
                name.truncate(name.floor_char_boundary(Event::MAX_GROUP_NAME_BYTES));
                self.events.push(change(layer, Some(name), None, None, None));
            }
            LayerEdit::ToggleHidden => self.events.push(hide(chosen.layer, !chosen.is_hidden)),
            LayerEdit::ToggleLocked => self.events.push(lock(chosen.layer, !chosen.is_locked)),
            LayerEdit::Hide(layer, hidden) => self.events.push(hide(layer, hidden)),
            LayerEdit::Lock(layer, locked) => self.events.push(lock(layer, locked)),
            LayerEdit::Close(layer, is_closed) => {
                self.events.push(change(layer, None, None, None, Some(is_closed)));
            }
            LayerEdit::TakeSelection => {
                // An event repeats the header's setting of the layer, so that the setting also applies to new strokes.
                let state = self.scene().layer_states().get(&chosen.layer);
                if state.is_none_or(|state| state.hidden.is_none()) {
                    self.events.push(hide(chosen.layer, chosen.is_hidden));
                }
                let layers = BTreeMap::from([(chosen.layer, self.input.selection.strokes().to_vec())]);
                assign(t, layers, &mut self.events);
            }
        }
        self.apply_events();
        self.deselect_locked();
    }

    pub(crate) fn deselect_locked(&mut self) {
        let scene = self.session.scene();
        let is_loose = |id: &osp_session::recording::StrokeId| {
            let stroke = scene.stroke(*id);
            stroke.is_some_and(|stroke| stroke.is_visible() && !self.is_layer_held(stroke.layer()))
        };
        let strokes: Vec<_> = self.input.selection.strokes().iter().copied().filter(is_loose).collect();
        self.input.selection.set(strokes);
    }

    /// Whether the strokes of a layer must not change: the layer is locked, or another author has closed it.
    pub(crate) fn is_layer_held(&self, layer: u32) -> bool {
        self.scene().is_locked(layer) || self.is_layer_of_others(layer)
    }

    /// Whether a layer is neither hidden nor locked, and not closed by another author.
    pub(crate) fn is_layer_open(&self, layer: u32) -> bool {
        !self.session_layer(layer).is_hidden && !self.is_layer_held(layer)
    }

    /// The reason for which the user cannot draw on the current layer; `None` if drawing is possible.
    pub(crate) fn why_layer_is_closed(&self) -> Option<String> {
        let LayerRow { name, is_hidden, is_locked, owner, .. } = self.session_layer(self.input.brush.layer);
        if self.is_layer_of_others(self.input.brush.layer) {
            let owner = owner.map_or_else(String::new, |(author, name)| name_or_number(author, &name));
            return Some(format!("only {owner} may edit {name}"));
        }
        let why = if is_locked { "locked" } else { "hidden" };
        (is_hidden || is_locked).then(|| format!("{name} is {why}"))
    }

    /// Whether the current layer accepts strokes. If not, shows the reason.
    pub(crate) fn may_draw_on_layer(&mut self) -> bool {
        let Some(why) = self.why_layer_is_closed() else { return true };
        if !self.session.is_replay() {
            let or = if self.is_layer_of_others(self.input.brush.layer) {
                ""
            } else {
                ", or show and unlock this one"
            };
            self.show_once(&format!("{why}: choose another layer to draw on{or}"));
        }
        false
    }
}
