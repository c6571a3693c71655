//! Names of structures, methods and cameras, and the errors for unknown names.

use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::replay::CameraChoice;
use pyo3::{exceptions::PyValueError, prelude::*};

/// Returns the structures of a replay.
pub(crate) fn index_names() -> Vec<&'static str> {
    IndexKind::ALL.iter().map(|kind| kind.name()).collect()
}

/// Returns the methods of occlusion culling that never hide visible polygons and need no other frame.
pub(crate) fn conservative_names() -> Vec<&'static str> {
    Method::conservative_cullers().into_iter().map(Method::name).collect()
}

fn unknown(what: &str, name: &str, known: &[&str]) -> PyErr {
    PyValueError::new_err(format!("{what}: expected one of {}; found {name:?}", known.join(", ")))
}

pub(crate) fn index_kind(name: &str) -> PyResult<IndexKind> {
    IndexKind::from_name(name).ok_or_else(|| unknown("indexes", name, &index_names()))
}

/// Returns a method that builds a culler from the occluders of one view.
pub(crate) fn culler(name: &str) -> PyResult<Method> {
    let is_known = |method: &Method| conservative_names().contains(&method.name());
    Method::from_name(name).filter(is_known).ok_or_else(|| unknown("occlusion", name, &conservative_names()))
}

/// Returns a method that `verify` can test, including methods that are not conservative.
pub(crate) fn verified(name: &str) -> PyResult<Method> {
    let methods = Method::CULLERS.iter().copied().filter(|&method| method != Method::NONE);
    let known = methods.clone().map(Method::name).collect::<Vec<_>>();
    methods.into_iter().find(|method| method.name() == name).ok_or_else(|| unknown("occlusion", name, &known))
}

/// Returns a method of a replay, i.e. one that runs on the processor; `Method::NONE` counts, too.
pub(crate) fn replayed(name: &str) -> PyResult<Method> {
    let methods = Method::all().filter(|method| !method.is_while_drawing());
    let known = methods.clone().map(Method::name).collect::<Vec<_>>();
    methods.into_iter().find(|method| method.name() == name).ok_or_else(|| unknown("occlusion", name, &known))
}

/// Returns a method of a picture. Every method is permitted.
pub(crate) fn drawn(name: &str) -> PyResult<Method> {
    let known = || Method::all().map(Method::name).collect::<Vec<_>>();
    Method::all().find(|method| method.name() == name).ok_or_else(|| unknown("occlusion", name, &known()))
}

/// Returns the camera of a picture that moves as in a replay.
pub(crate) fn picture_camera(name: &str) -> PyResult<CameraChoice> {
    // A picture also has the view `whole`. Its `recorded` is the `auto` of a replay.
    let named = |choice: CameraChoice| if choice == CameraChoice::Auto { "recorded" } else { choice.name() };
    let choice = CameraChoice::ALL.iter().copied().find(|&choice| named(choice) == name);
    choice.ok_or_else(|| {
        let known = ["whole"].into_iter().chain(CameraChoice::ALL.iter().map(|&choice| named(choice)));
        unknown("view", name, &known.collect::<Vec<_>>())
    })
}

pub(crate) fn camera(name: &str) -> PyResult<CameraChoice> {
    let known = CameraChoice::ALL.iter().map(|choice| choice.name()).collect::<Vec<_>>();
    let choice = CameraChoice::ALL.iter().copied().find(|choice| choice.name() == name);
    choice.ok_or_else(|| unknown("camera", name, &known))
}
