//! Convex polygons and views: no sound method leaves out a polygon of which the oracle sees something, or draws one
//! twice or one that is not there.

use super::input::{self, Input, below, chance, signed, unit};
use osp::{
    frame::{PassConfig, Pipeline},
    glam::{DVec3, Vec2, Vec3},
    index::IndexConfig,
    occlusion::Occlusion,
    polygon::PolygonId,
    view::{View, ViewWindow},
};
use osp_lab::{Method, oracle::OracleConfig, verify::visible_polygons};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Author, Event, StrokeId},
    scene::Scene,
};
use osp_testkit::events::SOLE;

const MOST_FRAMES: usize = 4;
const MOST_POLYGONS: usize = 120;
/// Small pictures: the oracle asks about what falls between the pixels by rays.
const PIXELS: OracleConfig = OracleConfig { width: 96, height: 64 };

pub fn run(data: &[u8]) {
    let mut choices = Method::conservative_cullers();
    choices.extend([Occlusion::PreviousFrame, Occlusion::Auto].map(Method::Own));
    judge(data, choices);
}

/// Plays what the bytes say through these methods, and panics where one leaves out what can be seen. How many polygons
/// all of them together found hidden.
pub fn judge(data: &[u8], choices: Vec<Method>) -> usize {
    let mut hidden = 0;
    let mut u = Input::new(data);
    let index = [IndexKind::Osp, IndexKind::BvhSah, IndexKind::LooseOctree][below(&mut u, 3)];
    let mut lanes: Vec<(Method, Pipeline)> = choices
        .into_iter()
        .map(|choice| {
            let index = index.create(&IndexConfig { capacity: 16, ..IndexConfig::default() });
            // A polygon costs so much that every test is worth it.
            let pass = PassConfig { polygon_ns: 1.0e6, ..PassConfig::default() };
            let pipeline = Pipeline::new(index, 16);
            (choice, choice.add_to(pipeline, pass))
        })
        .collect();
    let mut scene = Scene::new();
    let mut changes = Vec::new();
    let mut view = input::view(&mut u);
    for frame in 0..MOST_FRAMES {
        if u.is_empty() {
            break;
        }
        changes.clear();
        for event in events(&mut u, &view, &scene) {
            assert_eq!(event.check(), Ok(()), "{event:?}");
            scene.apply(&event, &mut changes);
        }
        let Some(window) = inner_window(&view) else { return hidden };
        let ids: Vec<PolygonId> = scene.visible_ids().collect();
        let visible = visible_polygons(&scene, &window, &ids, PIXELS);
        for (choice, lane) in &mut lanes {
            lane.frame(&scene, &changes, &view);
            let place = format!("{} on {}, frame {frame}", choice.name(), index.name());
            let drawn = lane.draw_list().to_vec();
            hidden += lane.in_view().len() - drawn.len();
            assert_eq!(drawn.len(), lane.draw_list().len(), "{place}: a polygon counted twice");
            assert!(drawn.iter().all(|id| scene.is_visible(*id)), "{place}: one that is not there");
            for id in &visible {
                let polygon = scene.polygon(*id);
                assert!(drawn.binary_search(id).is_ok(), "{place}: {id:?} {polygon:?} is seen in {view:?}");
            }
        }
        view = next_view(&mut u, &view);
    }
    hidden
}

/// What the screen shows for certain: not widened as [`View::window`] is, but a little narrower. The near plane is that of the
/// window: an occluder between two near planes would be cut away from the truth, and hide in the methods.
fn inner_window(view: &View) -> Option<ViewWindow> {
    const LESS: f64 = 1.0e-5;
    let corners = view.corner_directions().map(|corner| corner.as_dvec3());
    let middle = corners.iter().sum::<DVec3>() * 0.25;
    let corners = corners.map(|corner| middle + (corner - middle) * (1.0 - LESS));
    let near_m = f64::from(view.projection.near_m) * (1.0 + osp::view::WINDOW_MARGIN);
    ViewWindow::new(view.eye_in_world.as_dvec3(), view.forward_in_world().as_dvec3(), corners, near_m)
}

fn next_view(u: &mut Input<'_>, view: &View) -> View {
    match below(u, 4) {
        0 => *view,
        1 => input::view(u),
        _ => {
            let by = Vec3::new(signed(u), signed(u), signed(u)) * 0.1;
            View { eye_in_world: view.eye_in_world + by, ..*view }
        }
    }
}

fn events(u: &mut Input<'_>, view: &View, scene: &Scene) -> Vec<Event> {
    let mut polygons: Vec<Vec<Vec3>> = Vec::new();
    let room = MOST_POLYGONS.saturating_sub(scene.polygon_count());
    for _ in 0..1 + below(u, 8) {
        let at = ahead(u, view);
        let size_m = [0.02, 0.2, 1.0, 4.0][below(u, 4)] * (0.1 + unit(u));
        let (a, b) = axes(u, view);
        let (a, b) = (a * size_m, b * size_m * if chance(u, 8) { 1.0e-3 } else { 0.2 + unit(u) });
        match below(u, 9) {
            0 => polygons.push(vec![at, at + a, at + b]),
            1 => polygons.push(vec![at, at + a, at + a + b, at + b]),
            // Trapezoids, and quads that are bent less than a ribbon's may be.
            2 => polygons.push(vec![at, at + a, at + a * 0.8 + b, at + a * 0.2 + b]),
            3 => {
                let bend = a.cross(b).normalize_or_zero() * size_m.min(b.length()) * 0.009 * signed(u);
                polygons.push(vec![at, at + a, at + a + b + bend, at + b]);
            }
            // A wall of tiles that share corners bit for bit; every other row may be shifted, so that corners meet edges.
            4 => {
                let shift = [0.0, 0.5][below(u, 2)];
                let (columns, rows) = (1 + below(u, 4), 1 + below(u, 3));
                for row in 0..rows {
                    for column in 0..columns {
                        let corner = |x: usize, y: usize| {
                            at + a * ((column + x) as f32 + shift * (row % 2) as f32) + b * (row + y) as f32
                        };
                        polygons.push(vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
                    }
                }
            }
            // What lies behind, on or before the plane of another.
            5 => {
                let away = (at - view.eye_in_world) * [1.0, 1.0e-6, 0.2, -0.1][below(u, 4)];
                polygons.push(vec![at, at + a, at + a + b, at + b]);
                let (at, a, b) = (at + away + a * 0.25 + b * 0.25, a * 0.5, b * 0.5);
                polygons.push(vec![at, at + a, at + a + b, at + b]);
            }
            _ => polygons.extend(wall_and_crumbs(u, view)),
        }
    }
    polygons.truncate(room);
    let mut told: Vec<Event> = polygons
        .into_iter()
        .map(|vertices| {
            let opacity = if chance(u, 6) { 0.5 } else { 1.0 };
            let stroke = chance(u, 3).then(|| StrokeId(below(u, 6) as u32));
            Event::Polygon {
                author: Author::SOLE,
                t: 0.0,
                stroke,
                vertices,
                shading: None,
                color: (0.5, 0.5, 0.5, opacity),
            }
        })
        .collect();
    if chance(u, 3) {
        let stroke = StrokeId(below(u, 6) as u32);
        told.push(match below(u, 4) {
            0 => SOLE.erase(stroke),
            1 => SOLE.moved([stroke], input::near_point(u) * 0.2),
            2 => SOLE.undo(),
            _ => SOLE.redo(),
        });
    }
    told
}

/// A polygon across the view, and small ones behind it, most of them about its border.
fn wall_and_crumbs(u: &mut Input<'_>, view: &View) -> Vec<Vec<Vec3>> {
    let [lower_left, lower_right, _, upper_left] = view.corner_directions();
    let (right, up) = ((lower_right - lower_left).normalize(), (upper_left - lower_left).normalize());
    let ray = view.ray_through(Vec2::new(signed(u), signed(u)) * 0.8);
    let t = 0.3 + 3.0 * unit(u);
    let tilt = view.forward_in_world() * signed(u);
    let (a, b) =
        ((right + tilt) * t * (0.1 + 0.5 * unit(u)), (up + tilt * signed(u)) * t * (0.1 + 0.5 * unit(u)));
    let at = ray.origin + ray.direction * t;
    let corners = match below(u, 3) {
        0 => vec![at - a - b, at + a - b, at + b],
        1 => vec![at - a, at - b, at + a, at + b],
        _ => vec![at - a - b, at + a - b, at + a + b, at - a + b],
    };
    let mut polygons = Vec::new();
    for _ in 0..1 + below(u, 8) {
        let (i, along) = (below(u, corners.len()), unit(u));
        let on_border = corners[i].lerp(corners[(i + 1) % corners.len()], along);
        let inwards = [0.0, 0.01, 0.1, 0.5][below(u, 4)] * (signed(u) + 0.5);
        let to_crumb = (on_border.lerp(at, inwards) - view.eye_in_world) * (1.0 + 2.0 * unit(u));
        let size_m = to_crumb.length() * [0.002, 0.02, 0.1][below(u, 3)];
        let (c, d) = axes(u, view);
        let (from, c, d) = (view.eye_in_world + to_crumb, c * size_m, d * size_m);
        polygons.push(vec![from, from + c, from + c + d, from + d]);
    }
    polygons.push(corners);
    polygons
}

/// A point that is mostly in view.
fn ahead(u: &mut Input<'_>, view: &View) -> Vec3 {
    let at = Vec2::new(signed(u), signed(u)) * 1.2;
    let ray = view.ray_through(at);
    // The near plane's distance, just beyond it, close, and far.
    let near_m = view.projection.near_m;
    let t = [near_m, near_m * 1.001, 0.5, 1.0, 2.0, 3.0 + 20.0 * unit(u)][below(u, 6)];
    ray.origin + ray.direction * t
}

/// Two directions across each other: the world's, the screen's, or any.
fn axes(u: &mut Input<'_>, view: &View) -> (Vec3, Vec3) {
    match below(u, 4) {
        0 => [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)][below(u, 3)],
        1 => {
            let [lower_left, lower_right, _, upper_left] = view.corner_directions();
            ((lower_right - lower_left).normalize(), (upper_left - lower_left).normalize())
        }
        _ => {
            let a = Vec3::new(signed(u), signed(u), signed(u)).normalize_or(Vec3::X);
            let b =
                a.cross(Vec3::new(signed(u), signed(u), signed(u))).normalize_or(a.any_orthonormal_vector());
            (a, b)
        }
    }
}
