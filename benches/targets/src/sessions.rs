use std::path::{Path, PathBuf};

use osp::{math::Aabb, polygon::PolygonId};
use osp_session::{
    recording::{OpenOptions, Session, open},
    scene::Scene,
};
use osp_testkit::boxes::{drawn, shuffled};

/// Boxes in order of arrival.
pub struct Arrivals {
    pub name: String,
    pub boxes: Vec<Aabb>,
    /// Whether to measure the trees of other crates.
    pub peers: bool,
    /// Whether to measure the project's own trees that rebuild.
    pub static_trees: bool,
}

pub fn synthetic(count: usize) -> [Arrivals; 2] {
    let boxes = drawn(count, 1);
    let shuffled = shuffled(boxes.clone(), 2);
    [
        Arrivals { name: format!("drawn, {count}"), boxes, peers: true, static_trees: true },
        Arrivals {
            name: format!("shuffled, {count}"),
            boxes: shuffled,
            peers: count <= 100_000,
            static_trees: true,
        },
    ]
}

/// Returns the recorded sessions and models of a folder that have at least `at_least` polygons, scaled into a cube of 4
/// m. Appends one entry with the polygons of all sessions. The faces of models (`.obj`) have no spatial order.
pub fn recorded(folder: &Path, at_least: usize) -> Vec<Arrivals> {
    let mut files = Vec::new();
    find(folder, &mut files);
    files.sort();
    let mut sessions = Vec::new();
    let mut together = Vec::new();
    for file in files {
        let Ok(session) = open(&file, &OpenOptions::default()) else { continue };
        let boxes = scaled(boxes_of(session));
        let is_model = is_model(&file);
        if !is_model {
            together.extend_from_slice(&boxes);
        }
        if boxes.len() >= at_least {
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            sessions.push(Arrivals { name, boxes, peers: false, static_trees: is_model });
        }
    }
    if !together.is_empty() {
        let name = "all sessions".into();
        sessions.push(Arrivals { name, boxes: together, peers: false, static_trees: false });
    }
    sessions
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            find(&path, files);
        } else if is_model(&path)
            || matches!(path.extension().and_then(|e| e.to_str()), Some("tilt" | "apa" | "json" | "ron"))
        {
            files.push(path);
        }
    }
}

fn is_model(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.ends_with(".obj") || name.ends_with(".obj.gz")
}

fn boxes_of(session: Session) -> Vec<Aabb> {
    let mut scene = Scene::new();
    let mut changes = Vec::new();
    for event in session.map_while(Result::ok) {
        scene.apply(&event, &mut changes);
        changes.clear();
    }
    (0..scene.polygon_count()).map(|i| scene.bounds(PolygonId(i as u32))).collect()
}

fn scaled(boxes: Vec<Aabb>) -> Vec<Aabb> {
    let all = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let (center, scale) = (all.center(), 3.9 / all.extent().max_element());
    if !scale.is_finite() {
        return Vec::new();
    }
    boxes.iter().map(|b| Aabb::new((b.min - center) * scale, (b.max - center) * scale)).collect()
}
