//! Runs the steps on an index, through every way of asking that it has.

use osp::{
    Camera, Culler, Depth, Occluder,
    glam::Mat4,
    index::SpatialIndex,
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
    view::View,
};

use super::{
    cases::is_perspective,
    file::{Quad, Step},
    plain::{self, Boxes, Quads},
};

/// A question that has not been answered yet.
enum Question<'a> {
    View(&'a Mat4),
    Box(&'a Aabb),
    Sphere(&'a Sphere),
    Ray(&'a Ray, f32),
}

/// Runs all steps; how many answers were compared, or the first that is wrong.
pub(crate) fn run(
    steps: &[(usize, Step)],
    make: &dyn Fn() -> Box<dyn SpatialIndex>,
) -> Result<usize, String> {
    let (mut index, mut boxes, mut checked) = (make(), Boxes::new(), 0);
    walk(steps, |step| match step {
        Event::Case => {
            (index, boxes) = (make(), Boxes::new());
            Ok(())
        }
        Event::Box(id, bounds) => {
            let outcome = match boxes.insert(id, *bounds) {
                Some(_) => index.update(PolygonId(id), bounds),
                None => index.insert(PolygonId(id), bounds),
            };
            outcome.map_err(|e| e.to_string())
        }
        Event::Remove(id) => {
            boxes.remove(&id);
            index.remove(PolygonId(id)).map_err(|e| e.to_string())
        }
        Event::Quad(..) | Event::Ask(_, Step::Unhidden(_)) => Ok(()),
        Event::Ask(question, answer) => {
            checked += 1;
            index.commit();
            index.validate()?;
            if index.len() != boxes.len() {
                return Err(format!("{} boxes, expected {}", index.len(), boxes.len()));
            }
            ask(&*index, &boxes, question, answer)
        }
    })
    .map(|()| checked)
}

/// Runs all steps on a culler, as every binding does; how many answers were compared, or the first that is wrong.
pub(crate) fn run_culler(steps: &[(usize, Step)]) -> Result<usize, String> {
    let (mut culler, mut checked) = (Culler::<u64>::new(), 0);
    walk(steps, |step| {
        match step {
            Event::Case => culler = Culler::new(),
            Event::Box(id, bounds) => culler.set(u64::from(id), [bounds.min, bounds.max]),
            Event::Remove(id) => culler.remove(u64::from(id)),
            Event::Quad(id, corners) => {
                let occluder = Occluder::quad(*corners).map_err(|e| e.to_string())?;
                culler.set_occluder(u64::from(id), occluder);
            }
            Event::Ask(question, answer) => {
                checked += 1;
                return ask_culler(&mut culler, question, answer);
            }
        }
        Ok(())
    })
    .map(|()| checked)
}

fn ask_culler(culler: &mut Culler<u64>, question: &Question<'_>, answer: &Step) -> Result<(), String> {
    let ascending = |keys: &mut dyn Iterator<Item = u64>| {
        let mut ids: Vec<u32> = keys.filter_map(|key| u32::try_from(key).ok()).collect();
        ids.sort_unstable();
        ids
    };
    culler.commit();
    match (question, answer) {
        (Question::View(matrix), Step::Visible(expected) | Step::Unhidden(expected)) => {
            let camera = |matrix: &Mat4, depth| {
                let camera = Camera::from_matrix(matrix.to_cols_array(), depth).map_err(|e| e.to_string())?;
                let is_hiding = matches!(answer, Step::Unhidden(_));
                Ok::<_, String>(if is_hiding { camera.hide_by_occluders() } else { camera })
            };
            let opengl = camera(&with_opengl_depth(matrix), Depth::MinusOneToOne)?;
            let cameras = [camera(matrix, Depth::ZeroToOne)?, camera(matrix, Depth::OneToZero)?, opengl];
            let frame = culler.cull(&cameras);
            frame.iter().try_for_each(|seen| same("a camera", &ascending(&mut seen.iter()), expected))
        }
        (Question::Box(bounds), Step::Found(expected)) => {
            same("the box", &ascending(&mut culler.in_box([bounds.min, bounds.max])), expected)
        }
        (Question::Sphere(Sphere { center, radius_m }), Step::Found(expected)) => {
            same("the sphere", &ascending(&mut culler.in_sphere(*center, *radius_m)), expected)
        }
        (Question::Ray(ray, t_max), Step::Hit(expected)) => {
            let first = culler.on_ray(**ray, *t_max).next();
            match (first, expected) {
                (None, None) => Ok(()),
                (Some((key, t)), Some((id, expected_t)))
                    if key == u64::from(*id) && (t - expected_t).abs() <= 1.0e-4 * expected_t.abs() =>
                {
                    Ok(())
                }
                _ => Err(format!("the ray enters {first:?}, expected {expected:?}")),
            }
        }
        _ => Err(format!("{answer} answers another question")),
    }
}

/// Compares the answers in the steps with those of the plainest loop.
pub(crate) fn check_answers(steps: &[(usize, Step)]) -> Result<usize, String> {
    let (mut boxes, mut quads, mut checked) = (Boxes::new(), Quads::new(), 0);
    walk(steps, |step| {
        match step {
            Event::Case => {
                boxes.clear();
                quads.clear();
            }
            Event::Box(id, bounds) => {
                if boxes.insert(id, *bounds).is_some() {
                    quads.remove(&id);
                }
            }
            Event::Quad(id, corners) => {
                quads.insert(id, *corners);
            }
            Event::Remove(id) => {
                quads.remove(&id);
                boxes.remove(&id).ok_or_else(|| format!("{id} is not there"))?;
            }
            Event::Ask(question, answer) => {
                checked += 1;
                let is_right = match (question, answer) {
                    (Question::View(matrix), Step::Visible(ids)) => {
                        plain::visible(&boxes, matrix).as_ref() == Some(ids)
                    }
                    (Question::View(matrix), Step::Unhidden(ids)) => {
                        plain::unhidden(&boxes, &quads, matrix).as_ref() == Some(ids)
                    }
                    (Question::Box(bounds), Step::Found(ids)) => {
                        plain::box_query(&boxes, bounds).as_ref() == Some(ids)
                    }
                    (Question::Sphere(sphere), Step::Found(ids)) => {
                        plain::sphere(&boxes, sphere).as_ref() == Some(ids)
                    }
                    (Question::Ray(ray, t_max), Step::Hit(hit)) => {
                        plain::ray(&boxes, ray, *t_max).as_ref() == Some(hit)
                    }
                    _ => false,
                };
                if !is_right {
                    return Err(format!("{answer} is not the answer"));
                }
            }
        }
        Ok(())
    })
    .map(|()| checked)
}

enum Event<'a> {
    Case,
    Box(u32, &'a Aabb),
    Remove(u32),
    Quad(u32, &'a Quad),
    Ask(&'a Question<'a>, &'a Step),
}

/// Goes through the steps and pairs each question with its answer.
fn walk<'a>(
    steps: &'a [(usize, Step)],
    mut step: impl FnMut(Event<'_>) -> Result<(), String>,
) -> Result<(), String> {
    let mut asked: Option<Question<'a>> = None;
    for (line, now) in steps {
        // What a view shows may be followed by what of it is not hidden.
        let is_answer = matches!(now, Step::Unhidden(_) | Step::Found(_) | Step::Hit(_));
        let event = match now {
            Step::Case(_) => Event::Case,
            Step::Box(id, bounds) => Event::Box(*id, bounds),
            Step::Remove(id) => Event::Remove(*id),
            Step::Quad(id, corners) => Event::Quad(*id, corners),
            Step::View(matrix) => {
                asked = Some(Question::View(matrix));
                continue;
            }
            Step::BoxQuery(bounds) => {
                asked = Some(Question::Box(bounds));
                continue;
            }
            Step::Sphere(sphere) => {
                asked = Some(Question::Sphere(sphere));
                continue;
            }
            Step::Ray { ray, t_max } => {
                asked = Some(Question::Ray(ray, *t_max));
                continue;
            }
            answer => {
                let question = asked.as_ref().ok_or_else(|| format!("line {line}: nothing was asked"))?;
                Event::Ask(question, answer)
            }
        };
        step(event).map_err(|e| format!("line {line}: {e}"))?;
        if is_answer {
            asked = None;
        }
    }
    Ok(())
}

fn ask(
    index: &dyn SpatialIndex,
    boxes: &Boxes,
    question: &Question<'_>,
    answer: &Step,
) -> Result<(), String> {
    match (question, answer) {
        (Question::View(matrix), Step::Visible(expected)) => {
            same("its planes", &in_frustum(index, &Frustum::from_matrix(matrix))?, expected)?;
            let opengl = Frustum::from_opengl_matrix(&with_opengl_depth(matrix));
            same("its planes with OpenGL's depth", &in_frustum(index, &opengl)?, expected)?;
            if is_perspective(matrix) {
                let view = View::from_matrix(matrix, Depth::ZeroToOne).ok_or("no view has this matrix")?;
                same("its view", &in_frustum(index, &view.frustum())?, expected)?;
            }
            Ok(())
        }
        (Question::Box(bounds), Step::Found(expected)) => {
            let mut found = Vec::new();
            index.box_query(bounds, &mut found);
            same("the box", &ascending(found), expected)
        }
        (Question::Sphere(sphere), Step::Found(expected)) => {
            let mut found = Vec::new();
            let mut is_in = |id: PolygonId| {
                let distance_squared = boxes[&id.0].distance_squared(sphere.center);
                distance_squared <= sphere.radius_m * sphere.radius_m
            };
            index.sphere_query(sphere, &mut is_in, &mut found);
            same("the sphere", &ascending(found), expected)
        }
        (Question::Ray(ray, t_max), Step::Hit(expected)) => {
            let mut enter = |id: PolygonId| ray.enter_box(&boxes[&id.0], *t_max);
            let nearest = index.ray_nearest(ray, *t_max, &mut enter);
            let any = index.ray_any(ray, *t_max, &mut enter);
            let is_right = match (nearest, expected) {
                (Some((id, t)), Some((expected_id, expected_t))) => {
                    id.0 == *expected_id && (t - expected_t).abs() <= 1.0e-4 * expected_t.abs()
                }
                (None, None) => true,
                _ => false,
            };
            if is_right && any.is_some() == expected.is_some() {
                Ok(())
            } else {
                Err(format!("the ray meets {nearest:?} ({any:?}), expected {expected:?}"))
            }
        }
        _ => Err(format!("{answer} answers another question")),
    }
}

/// The same view with depth from -1 to 1. What the numbers lose by it is far below the distances that the cases keep.
fn with_opengl_depth(clip_from_world: &Mat4) -> Mat4 {
    let mut rows = clip_from_world.transpose();
    rows.z_axis = rows.z_axis * 2.0 - rows.w_axis;
    rows.transpose()
}

/// The boxes that a frustum may see, found in three ways.
fn in_frustum(index: &dyn SpatialIndex, frustum: &Frustum) -> Result<Vec<u32>, String> {
    let mut list = Vec::new();
    index.frustum_cull(frustum, &mut list);
    let listed = ascending(list);
    let mut sets = [const { VisibleBlocks::new() }; 3];
    let [set, views @ ..] = &mut sets;
    index.frustum_cull_blocks(frustum, set);
    index.frustum_cull_views(&[*frustum; 2], views);
    for set in &sets {
        same("a set of blocks", &ascending(set.to_vec()), &listed)?;
    }
    Ok(listed)
}

fn ascending(found: Vec<PolygonId>) -> Vec<u32> {
    let mut ids: Vec<u32> = found.into_iter().map(|id| id.0).collect();
    ids.sort_unstable();
    ids
}

fn same(asked: &str, found: &[u32], expected: &[u32]) -> Result<(), String> {
    if found == expected {
        return Ok(());
    }
    let missing: Vec<u32> = expected.iter().filter(|id| !found.contains(id)).copied().collect();
    let extra: Vec<u32> = found.iter().filter(|id| !expected.contains(id)).copied().collect();
    Err(format!(
        "{asked} finds {} boxes, expected {}; missing {missing:?}, too many {extra:?}",
        found.len(),
        expected.len()
    ))
}
