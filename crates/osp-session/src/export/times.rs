use crate::{
    recording::{Event, StrokeId},
    scene::Scene,
};
use osp::polygon::PolygonId;

/// Time at which each polygon of a scene was drawn: four bytes a polygon.
///
/// The numbers of samples and polygons of a stroke may differ. In each call of [`note`](Self::note), the last polygon
/// of a stroke gets the time of the stroke's last sample. Earlier polygons get the times of earlier samples in
/// proportion.
#[derive(Clone, Debug, Default)]
pub struct PolygonTimes {
    /// Time stamp of the session's first event.
    first_secs: Option<f64>,
    /// For each polygon, the seconds since the session began.
    secs: Vec<f32>,
    /// Scratch memory of a call: the stroke and time of each sample.
    samples: Vec<(u64, f32)>,
    /// Scratch memory of a call: the stroke and number of each new polygon.
    added: Vec<(u64, PolygonId)>,
}

/// Key of the stroke that a sample belongs to; all faces without a stroke share one key.
fn key(stroke: Option<StrokeId>) -> u64 {
    stroke.map_or(1 << 32, |stroke| u64::from(stroke.0))
}

impl PolygonTimes {
    /// Records the times of the polygons that these events have added to the scene, including hidden ones.
    pub fn note(&mut self, events: &[Event], scene: &Scene) {
        let Some(first) = events.first() else { return };
        let first_secs = *self.first_secs.get_or_insert(first.time_secs());
        let since = |t: f64| (t - first_secs) as f32;
        let known = self.secs.len();
        if scene.polygon_count() <= known {
            return;
        }
        self.samples.clear();
        self.samples.extend(events.iter().filter_map(|event| match event {
            Event::Point { t, stroke, .. } => Some((key(Some(*stroke)), since(*t))),
            Event::Polygon { t, stroke, .. } => Some((key(*stroke), since(*t))),
            _ => None,
        }));
        self.samples.sort_by_key(|(stroke, _)| *stroke);
        let last_secs = events.last().map_or(0.0, |event| since(event.time_secs()));
        self.added.clear();
        self.added.extend((known..scene.polygon_count()).map(|id| {
            let id = PolygonId(id as u32);
            (key(scene.stroke_of(id).id()), id)
        }));
        self.secs.resize(scene.polygon_count(), last_secs);
        // Several hands may draw at once.
        self.added.sort_by_key(|(stroke, _)| *stroke);
        for of_stroke in self.added.chunk_by(|(a, _), (b, _)| a == b) {
            let stroke = of_stroke[0].0;
            let from = self.samples.partition_point(|(of, _)| *of < stroke);
            let to = self.samples.partition_point(|(of, _)| *of <= stroke);
            for (at, (_, id)) in of_stroke.iter().enumerate() {
                // The last polygon ends at the last sample.
                let sample = ((at + 1) * (to - from)).div_ceil(of_stroke.len()).saturating_sub(1);
                // Without a sample, the polygon keeps the time of the last event.
                if let Some((_, secs)) = self.samples[from..to].get(sample) {
                    self.secs[id.index()] = *secs;
                }
            }
        }
    }

    /// Seconds from the session's beginning until a polygon was drawn, by the polygon's number; 0 if unknown.
    pub(super) fn secs(&self, polygon: usize) -> f32 {
        self.secs.get(polygon).copied().unwrap_or(0.0)
    }
}
