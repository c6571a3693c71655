use std::path::{Path, PathBuf};

use osp::{
    math::Aabb,
    polygon::PolygonId,
    recording::{OpenOptions, Session, open},
    scene::Scene,
};

use crate::boxes::{drawn, shuffled};

/// Boxes in order of arrival.
pub struct Arrivals {
    pub name: String,
    pub boxes: Vec<Aabb>,
    /// Whether all rivals run on it, or only the flat ones.
    pub all_rivals: bool,
}

pub fn synthetic(count: usize) -> [Arrivals; 2] {
    let boxes = drawn(count, 1);
    let shuffled = shuffled(boxes.clone(), 2);
    [
        Arrivals { name: format!("drawn, {count}"), boxes, all_rivals: true },
        Arrivals { name: format!("shuffled, {count}"), boxes: shuffled, all_rivals: count <= 100_000 },
    ]
}

/// The recorded sessions in a folder, those of more than `at_least` polygons, scaled into the cube of 4 m; and all of
/// them one after the other in one space.
pub fn recorded(folder: &Path, at_least: usize) -> Vec<Arrivals> {
    let mut files = Vec::new();
    find(folder, &mut files);
    files.sort();
    let mut sessions = Vec::new();
    let mut together = Vec::new();
    for file in files {
        let Ok(session) = open(&file, &OpenOptions::default()) else { continue };
        let boxes = scaled(boxes_of(session));
        together.extend_from_slice(&boxes);
        if boxes.len() >= at_least {
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            sessions.push(Arrivals { name, boxes, all_rivals: false });
        }
    }
    if !together.is_empty() {
        sessions.push(Arrivals { name: "all of them".into(), boxes: together, all_rivals: false });
    }
    sessions
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            find(&path, files);
        } else if matches!(path.extension().and_then(|e| e.to_str()), Some("tilt" | "apa" | "json" | "ron")) {
            files.push(path);
        }
    }
}

fn boxes_of(session: Session) -> Vec<Aabb> {
    let mut scene = Scene::new();
    let mut changes = Vec::new();
    for event in session.map_while(Result::ok) {
        scene.apply(&event, &mut changes);
        changes.clear();
    }
    (0..scene.polygon_count()).map(|i| *scene.bounds(PolygonId(i as u32))).collect()
}

fn scaled(boxes: Vec<Aabb>) -> Vec<Aabb> {
    let all = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let (center, scale) = (all.center(), 3.9 / all.extent().max_element());
    if !scale.is_finite() {
        return Vec::new();
    }
    boxes.iter().map(|b| Aabb::new((b.min - center) * scale, (b.max - center) * scale)).collect()
}
