//! Runs the steps on an index, through every way of asking that it has.

use osp::{
    glam::Mat4,
    index::{DrawList, SpatialIndex},
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
    view::{ClipDepth, View},
};

use super::{
    cases::is_perspective,
    file::Step,
    plain::{self, Boxes},
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

/// Compares the answers in the steps with those of the plainest loop.
pub(crate) fn check_answers(steps: &[(usize, Step)]) -> Result<usize, String> {
    let (mut boxes, mut checked) = (Boxes::new(), 0);
    walk(steps, |step| {
        match step {
            Event::Case => boxes.clear(),
            Event::Box(id, bounds) => {
                boxes.insert(id, *bounds);
            }
            Event::Remove(id) => {
                boxes.remove(&id).ok_or_else(|| format!("{id} is not there"))?;
            }
            Event::Ask(question, answer) => {
                checked += 1;
                let is_right = match (question, answer) {
                    (Question::View(matrix), Step::Visible(ids)) => {
                        plain::visible(&boxes, matrix).as_ref() == Some(ids)
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
    Ask(&'a Question<'a>, &'a Step),
}

/// Goes through the steps and pairs each question with its answer.
fn walk<'a>(
    steps: &'a [(usize, Step)],
    mut step: impl FnMut(Event<'_>) -> Result<(), String>,
) -> Result<(), String> {
    let mut asked: Option<Question<'a>> = None;
    for (line, now) in steps {
        let is_answer = matches!(now, Step::Visible(_) | Step::Found(_) | Step::Hit(_));
        let event = match now {
            Step::Case(_) => Event::Case,
            Step::Box(id, bounds) => Event::Box(*id, bounds),
            Step::Remove(id) => Event::Remove(*id),
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
                let view =
                    View::from_matrix(matrix, ClipDepth::ZeroToOne).ok_or("no view has this matrix")?;
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
    let mut list = DrawList::new();
    index.frustum_cull(frustum, &mut list);
    let listed = ascending(list.ids().to_vec());
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
