//! osp's errors as Python exceptions.

use osp_render::RenderError;
use osp_session::recording;
use pyo3::{
    create_exception,
    exceptions::{PyOSError, PyRuntimeError, PyValueError},
    prelude::*,
};

create_exception!(
    osp,
    RecordingError,
    PyValueError,
    "A recording is damaged, too large, or of a format that osp does not read.\n\n\
     The message names the file, the line or byte, and the expected form. The attributes `path`, `line` (from 1) and\n\
     `byte` (from 0) contain the same. `line` is None if the error has no line, and `byte` if it has no byte."
);

create_exception!(
    osp,
    AdapterError,
    PyRuntimeError,
    "There is no graphics adapter, it lacks a feature, or its driver has failed. The message gives the reason."
);

/// Returns the exception for an error of the renderer.
pub(crate) fn of_drawing(error: &RenderError) -> PyErr {
    match error {
        RenderError::Size { .. } => PyValueError::new_err(format!("size: {error}")),
        _ => AdapterError::new_err(error.to_string()),
    }
}

/// Returns the exception for an error of a reader. A refusal by the system becomes an `OSError` such as
/// `FileNotFoundError`.
pub(crate) fn of_recording(error: &recording::RecordingError) -> PyErr {
    use recording::{Excess, Place, RecordingError as Error};
    let (path, place) = match error {
        Error::Io { path, cause } => return of_io(path, cause),
        Error::Line { path, line, .. } => (path, Place::Line(*line)),
        Error::Byte { path, offset, .. } => (path, Place::Byte(*offset)),
        Error::Limit(excess) => (&excess.path, excess.place),
        Error::Unknown { path, .. } => (path, Place::File),
    };
    let (line, byte) = match place {
        Place::File => (None, None),
        Place::Line(line) => (Some(line), None),
        Place::Byte(byte) => (None, Some(byte)),
    };
    let text = match error {
        // In Python, the option has another name.
        Error::Limit(excess) if excess.option.starts_with("--max-polygons") => {
            Excess { option: "max_polygons=N", ..(**excess).clone() }.to_string()
        }
        _ => error.to_string(),
    };
    Python::attach(|py| {
        let exception = RecordingError::new_err(text);
        let value = exception.value(py);
        let attributes = value
            .setattr("path", path.as_os_str())
            .and_then(|()| value.setattr("line", line))
            .and_then(|()| value.setattr("byte", byte));
        attributes.err().unwrap_or(exception)
    })
}

fn of_io(path: &std::path::Path, cause: &std::io::Error) -> PyErr {
    let text = match cause.raw_os_error() {
        // Python appends the file's name to this text, and chooses the type of the exception by the number.
        Some(number) => {
            let text = cause.to_string();
            let text = text.strip_suffix(&format!(" (os error {number})")).unwrap_or(&text).to_owned();
            return PyOSError::new_err((number, text, path.as_os_str().to_owned()));
        }
        None => format!("{}: {cause}", path.display()),
    };
    PyOSError::new_err(text)
}

/// The exception for a lock that was held when a thread panicked. The guarded data may be half changed.
pub(crate) fn broken() -> PyErr {
    PyRuntimeError::new_err("an earlier call has failed in the middle of its work: make a new object")
}
