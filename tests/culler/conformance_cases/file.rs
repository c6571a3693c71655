//! The file of cases: one line, one step. `bindings/conformance.txt` begins with what each kind of line means.

use std::fmt;

use osp::{
    glam::{Mat4, Vec3},
    math::{Aabb, Ray, Sphere},
};

/// A step: a change, a question, or the answer that the question before it must get.
#[derive(Debug)]
pub(crate) enum Step {
    Case(String),
    Box(u32, Aabb),
    Remove(u32),
    View(Mat4),
    Visible(Vec<u32>),
    BoxQuery(Aabb),
    Sphere(Sphere),
    Found(Vec<u32>),
    Ray { ray: Ray, t_max: f32 },
    Hit(Option<(u32, f32)>),
    Quad(u32, Quad),
    Unhidden(Vec<u32>),
}

/// The corners of an occluder, in order around it.
pub(crate) type Quad = [Vec3; 4];

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ids = |f: &mut fmt::Formatter<'_>, ids: &[u32]| ids.iter().try_for_each(|id| write!(f, " {id}"));
        match self {
            Self::Case(name) => write!(f, "case {name}"),
            Self::Box(id, bounds) => write!(f, "box {id}{}", Numbers(&corners(bounds))),
            Self::Remove(id) => write!(f, "remove {id}"),
            Self::View(clip_from_world) => write!(f, "view{}", Numbers(&clip_from_world.to_cols_array())),
            Self::Visible(found) => f.write_str("visible").and_then(|()| ids(f, found)),
            Self::BoxQuery(bounds) => write!(f, "boxquery{}", Numbers(&corners(bounds))),
            Self::Sphere(Sphere { center, radius_m }) => {
                write!(f, "sphere{}", Numbers(&[center.x, center.y, center.z, *radius_m]))
            }
            Self::Found(found) => f.write_str("found").and_then(|()| ids(f, found)),
            Self::Ray { ray: Ray { origin: o, direction: d, .. }, t_max } => {
                write!(f, "ray{}", Numbers(&[o.x, o.y, o.z, d.x, d.y, d.z, *t_max]))
            }
            Self::Hit(None) => f.write_str("hit none"),
            Self::Hit(Some((id, t))) => write!(f, "hit {id}{}", Numbers(&[*t])),
            Self::Quad(id, corners) => {
                write!(f, "quad {id}{}", Numbers(corners.map(|corner| corner.to_array()).as_flattened()))
            }
            Self::Unhidden(found) => f.write_str("unhidden").and_then(|()| ids(f, found)),
        }
    }
}

fn corners(bounds: &Aabb) -> [f32; 6] {
    let (low, high) = (bounds.min, bounds.max);
    [low.x, low.y, low.z, high.x, high.y, high.z]
}

struct Numbers<'a>(&'a [f32]);

impl fmt::Display for Numbers<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|number| {
            // Without the sign of a zero.
            let text = (number + 0.0).to_string();
            // Some readers have 64 bits only and round what they have read.
            let rounded_twice = text.parse::<f64>().map_or(f32::NAN, |number| number as f32);
            assert_eq!(rounded_twice, *number, "{text} is read as another number");
            write!(f, " {text}")
        })
    }
}
