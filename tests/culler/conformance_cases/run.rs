//! Runs the steps on a culler, as every binding does.

use osp::{Camera, Culler, Depth, Occluder, glam::Mat4, math::Sphere};

use super::file::Step;

/// Compares all answers. Returns their number.
pub(crate) fn run(steps: &[Step]) -> usize {
    let (mut culler, mut checked) = (Culler::<u64>::new(), 0);
    let mut asked = None;
    for (number, step) in steps.iter().enumerate() {
        match step {
            Step::Case(_) => culler = Culler::new(),
            Step::Box(id, bounds) => culler.set(u64::from(*id), [bounds.min, bounds.max]),
            Step::Remove(id) => culler.remove(u64::from(*id)),
            Step::Quad(id, corners) => {
                culler.set_occluder(u64::from(*id), Occluder::quad(*corners).expect("a sound quad"));
            }
            Step::View(_) | Step::BoxQuery(_) | Step::Sphere(_) | Step::Ray { .. } => asked = Some(step),
            answer => {
                checked += 1;
                check(&mut culler, asked.expect("a question"), answer, number);
            }
        }
    }
    checked
}

fn check(culler: &mut Culler<u64>, question: &Step, answer: &Step, number: usize) {
    let ascending = |keys: &mut dyn Iterator<Item = u64>| {
        let mut ids: Vec<u32> = keys.filter_map(|key| u32::try_from(key).ok()).collect();
        ids.sort_unstable();
        ids
    };
    culler.commit();
    match (question, answer) {
        (Step::View(matrix), Step::Visible(expected) | Step::Unhidden(expected)) => {
            let depths = [Depth::ZeroToOne, Depth::OneToZero, Depth::MinusOneToOne];
            let cameras = depths.map(|depth| {
                let matrix = if depth == Depth::MinusOneToOne { with_opengl_depth(matrix) } else { *matrix };
                let camera = Camera::from_matrix(matrix.to_cols_array(), depth).expect("a sound matrix");
                let is_hiding = matches!(answer, Step::Unhidden(_));
                if is_hiding { camera.hide_by_occluders() } else { camera }
            });
            for seen in culler.cull(&cameras).iter() {
                assert_eq!(ascending(&mut seen.iter()), *expected, "step {number}: {question}");
            }
        }
        (Step::BoxQuery(bounds), Step::Found(expected)) => {
            let found = ascending(&mut culler.in_box([bounds.min, bounds.max]));
            assert_eq!(found, *expected, "step {number}: {question}");
        }
        (Step::Sphere(Sphere { center, radius_m }), Step::Found(expected)) => {
            let found = ascending(&mut culler.in_sphere(*center, *radius_m));
            assert_eq!(found, *expected, "step {number}: {question}");
        }
        (Step::Ray { ray, t_max }, Step::Hit(expected)) => {
            let first = culler.on_ray(*ray, *t_max).next();
            let is_right = match (first, expected) {
                (Some((key, t)), Some((id, expected_t))) => {
                    key == u64::from(*id) && (t - expected_t).abs() <= 1.0e-4 * expected_t.abs()
                }
                (first, expected) => first.is_none() && expected.is_none(),
            };
            assert!(is_right, "step {number}: {question} enters {first:?}, expected {expected:?}");
        }
        _ => panic!("step {number}: {answer} answers another question"),
    }
}

/// The same view with depth from -1 to 1. What the numbers lose by it is far below the distances that the cases keep.
fn with_opengl_depth(clip_from_world: &Mat4) -> Mat4 {
    let mut rows = clip_from_world.transpose();
    rows.z_axis = rows.z_axis * 2.0 - rows.w_axis;
    rows.transpose()
}
