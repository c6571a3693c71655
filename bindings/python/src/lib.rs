//! The Python module `osp._native`: osp's culler, readers and measurements for numpy arrays.
//!
//! What comes from Python is checked and copied first ([`arrays`]), so that the work itself needs neither the interpreter
//! nor memory that Python can change: it runs with the interpreter's lock released. The package around it is in `python/osp`.
//! What is public here is described in `python/osp/_native.pyi` and in the text of each item, which Python's `help` shows.

mod arrays;
mod camera;
mod culler;
mod errors;
mod mesh;
mod names;
mod recording;
mod render;
mod replay;
mod signals;
mod verify;
mod view;

use pyo3::prelude::*;

/// The part of osp that is compiled.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<view::View>()?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<culler::Culler>()?;
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<recording::Recording>()?;
    module.add_function(wrap_pyfunction!(recording::open_recording, module)?)?;
    module.add_function(wrap_pyfunction!(replay::replay_frames, module)?)?;
    module.add_function(wrap_pyfunction!(verify::verify_methods, module)?)?;
    module.add_function(wrap_pyfunction!(render::render_frame, module)?)?;
    module.add("RecordingError", module.py().get_type::<errors::RecordingError>())?;
    module.add("AdapterError", module.py().get_type::<errors::AdapterError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("INDEXES", names::index_names())?;
    module.add("OCCLUSION_METHODS", names::conservative_names())?;
    Ok(())
}

/// Python aligns its objects to 16 bytes; what needs more has to be in a box.
const _: () = {
    assert!(align_of::<view::View>() <= 16 && align_of::<camera::Camera>() <= 16);
    assert!(align_of::<culler::Culler>() <= 16);
    assert!(align_of::<mesh::Mesh>() <= 16 && align_of::<recording::Recording>() <= 16);
};
