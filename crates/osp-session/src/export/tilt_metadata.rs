//! Writes `metadata.json` of a `.tilt`: the fields of the sketch that was read, or new fields from the session's
//! header.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{Quat, Vec3};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json, value::RawValue};

use crate::{
    brush,
    recording::{
        Camera, Header,
        import::{axes, tilt_environment::preset_of, tilt_layout::METERS_PER_UNIT},
    },
    scene::Scene,
};

/// Vertical field of view of a thumbnail, degrees. The format does not store it.
const THUMBNAIL_FOV_DEGREES: f32 = 80.0;
/// Layers without strokes are written if all layers have numbers below this. All layers then keep their numbers.
const MOST_LAYERS: u32 = 1000;

/// The file's table of brushes: the GUIDs of the sketch that was read, then added GUIDs.
pub(super) struct Brushes {
    guids: Vec<String>,
    places: HashMap<String, u32>,
}

impl Brushes {
    pub(super) fn of(header: &Header) -> Self {
        let read = fields_read(header).and_then(|mut fields| fields.remove("BrushIndex"));
        let guids: Vec<String> = read.and_then(|guids| parsed(&guids)).unwrap_or_default();
        let mut places = HashMap::new();
        for (guid, at) in guids.iter().zip(0..) {
            places.entry(guid.clone()).or_insert(at);
        }
        // The GUID of an older brush is also found by the GUID of the brush that replaced it, unless the table has
        // both.
        for (guid, at) in guids.iter().zip(0..) {
            if let Some(brush) = brush::find(guid) {
                places.entry(brush.guid.clone()).or_insert(at);
            }
        }
        Self { guids, places }
    }

    /// Index of a brush in the table. A missing brush is added.
    pub(super) fn place(&mut self, guid: &str) -> u32 {
        if let Some(&at) = self.places.get(guid) {
            return at;
        }
        let at = self.guids.len() as u32;
        self.guids.push(guid.to_owned());
        self.places.insert(guid.to_owned(), at);
        at
    }
}

pub(super) struct Layers {
    /// For each layer of the session, its index in the file.
    places: BTreeMap<u32, u32>,
    states: Vec<LayerNow>,
    /// Whether the file needs no table of layers, because the session has a single layer without a name or a change.
    is_plain: bool,
}

/// The final state of a layer. `is_renamed` is whether an event set the name. `is_locked` is `None` if no event locked
/// or unlocked the layer.
struct LayerNow {
    name: String,
    is_renamed: bool,
    is_hidden: bool,
    is_locked: Option<bool>,
}

impl Layers {
    /// Returns the layers of a session whose strokes are on the layers `used`.
    pub(super) fn new(header: &Header, scene: &Scene, used: &BTreeSet<u32>) -> Self {
        let named = header.layers.len() as u32;
        let mut numbers: BTreeSet<u32> = (0..named).chain(scene.layer_states().keys().copied()).collect();
        numbers.extend(used);
        if let Some(&last) = numbers.last().filter(|last| **last < MOST_LAYERS) {
            numbers.extend(0..last);
        }
        let states = numbers.iter().map(|&number| {
            let read = header.layers.get(number as usize);
            let now = scene.layer_states().get(&number);
            let name = now.and_then(|now| now.name.clone()).or(read.map(|read| read.name.clone()));
            LayerNow {
                is_renamed: now.is_some_and(|now| now.name.is_some()),
                name: name.unwrap_or_else(|| match number {
                    0 => "Main Canvas".to_owned(),
                    _ => format!("Layer {number}"),
                }),
                is_hidden: now.and_then(|now| now.hidden).or(read.map(|read| read.hidden)) == Some(true),
                is_locked: now.and_then(|now| now.locked),
            }
        });
        Self {
            states: states.collect(),
            is_plain: named == 0 && scene.layer_states().is_empty() && numbers.iter().all(|&n| n == 0),
            places: numbers.into_iter().zip(0..).collect(),
        }
    }

    pub(super) fn place(&self, number: u32) -> u32 {
        self.places.get(&number).copied().unwrap_or(0)
    }

    /// Writes the layers into a table. Existing entries keep their other fields.
    fn fill(&self, fields: &mut Fields) {
        if self.is_plain {
            return;
        }
        let read: Option<Vec<Box<RawValue>>> = fields.remove("Layers").and_then(|read| parsed(&read));
        let mut read = read.unwrap_or_default().into_iter();
        let layers = self.states.iter().map(|state| {
            let mut layer: Fields = read.next().and_then(|layer| parsed(&layer)).unwrap_or_default();
            // A reader may have shortened a name.
            if state.is_renamed || !layer.contains_key("Name") {
                layer.insert("Name".to_owned(), raw(&state.name));
            }
            layer.insert("Visible".to_owned(), raw(&!state.is_hidden));
            if let Some(is_locked) = state.is_locked {
                layer.insert("Locked".to_owned(), raw(&is_locked));
            }
            raw(&layer)
        });
        let mut layers: Vec<Box<RawValue>> = layers.collect();
        layers.extend(read);
        fields.insert("Layers".to_owned(), raw(&layers));
    }
}

/// Fields of a JSON object. A value stays the text that was read, so no number is rounded and no nesting is too deep.
type Fields = BTreeMap<String, Box<RawValue>>;

fn raw(value: &impl Serialize) -> Box<RawValue> {
    serde_json::value::to_raw_value(value).expect("texts, numbers, lists and objects of them")
}

fn parsed<T: DeserializeOwned>(value: &RawValue) -> Option<T> {
    serde_json::from_str(value.get()).ok()
}

/// Returns the text of the metadata, and a line for each part of the header that the metadata lack.
pub(super) fn metadata(
    header: &Header,
    scene: &Scene,
    brushes: Brushes,
    layers: &Layers,
) -> (String, Vec<String>) {
    let (mut fields, notes) = match fields_read(header) {
        Some(fields) => (fields, Vec::new()),
        None => {
            let (fields, mut notes) = fields_made(header, scene);
            if header.sketch_metadata.is_some() {
                notes.push(
                    "the metadata of the sketch that was read are no JSON object: they are not written"
                        .to_owned(),
                );
            }
            (fields, notes)
        }
    };
    fields.insert("BrushIndex".to_owned(), raw(&brushes.guids));
    layers.fill(&mut fields);
    (raw(&fields).get().to_owned(), notes)
}

/// The metadata of the sketch that the session comes from.
fn fields_read(header: &Header) -> Option<Fields> {
    serde_json::from_str(header.sketch_metadata.as_deref()?).ok()
}

/// Makes the metadata of a session that does not come from a sketch. Room, scene and canvas have the same space.
fn fields_made(header: &Header, scene: &Scene) -> (Fields, Vec<String>) {
    let mut fields = Fields::new();
    let mut notes = Vec::new();
    let mut put = |name: &str, value: Value| _ = fields.insert(name.to_owned(), raw(&value));
    put("ApplicationName", "osp".into());
    put("ApplicationVersion", env!("CARGO_PKG_VERSION").into());
    put("SchemaVersion", 2.into());
    let mut authors: Vec<&str> = Vec::new();
    for (_, info) in scene.authors().filter(|(_, info)| !info.name.is_empty()) {
        if !authors.contains(&info.name.as_str()) {
            authors.push(&info.name);
        }
    }
    if !authors.is_empty() {
        put("Authors", json!(authors));
    }
    put("SceneTransformInRoomSpace", transform(Vec3::ZERO, Quat::IDENTITY));
    if let Some(Camera { p, q, fov_degrees, .. }) = header.camera {
        put("ThumbnailCameraTransformInRoomSpace", transform(p, q));
        if fov_degrees != THUMBNAIL_FOV_DEGREES {
            notes.push(format!(
                "the camera's field of view of {fov_degrees} degrees is not written: .tilt has no place for it"
            ));
        }
    }
    if let Some(environment) = &header.environment {
        let preset = preset_of(environment);
        if let Some((guid, _)) = preset {
            put("EnvironmentPreset", guid.into());
        }
        if preset.is_none_or(|(_, is_unchanged)| !is_unchanged) {
            notes.push(
                "changes of light and background are not written: the session has no .tilt metadata"
                    .to_owned(),
            );
        }
    }
    (fields, notes)
}

/// Converts a pose to the format: position in units, rotation, scale, in Unity's axes.
fn transform(p: Vec3, q: Quat) -> Value {
    let p = axes::position_from_unity(p / METERS_PER_UNIT);
    json!([p.to_array(), axes::rotation_from_unity(q).to_array(), 1.0])
}
