//! The Python module `osp._native`: osp's culler, readers and measurements for numpy arrays.
//!
//! Each function first checks and copies the data from Python ([`arrays`]). Its work then needs neither the interpreter
//! nor memory that Python can change, so it releases the interpreter's lock. The package around this module is in
//! `python/osp`. The public items are declared in `python/osp/_native.pyi` and described in their comments, which
//! Python's `help` shows.

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

/// The compiled part of osp.
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

/// Python aligns its objects to 16 bytes, so types with a larger alignment must be boxed.
const _: () = {
    assert!(align_of::<view::View>() <= 16 && align_of::<camera::Camera>() <= 16);
    assert!(align_of::<culler::Culler>() <= 16);
    assert!(align_of::<mesh::Mesh>() <= 16 && align_of::<recording::Recording>() <= 16);
};
