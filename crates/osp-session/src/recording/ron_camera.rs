//! A camera as text, as in a recording's header.

use std::{fmt, str::FromStr};

use super::{Camera, ron_line};

impl fmt::Display for Camera {
    /// Writes the camera as in a recording's header. The text can be read back without loss.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&ron_line::options().to_string(self).map_err(|_| fmt::Error)?)
    }
}

impl FromStr for Camera {
    type Err = String;

    /// Reads a camera as in a recording's header: `(p: (x, y, z), q: (x, y, z, w), fov_degrees: 60)`.
    fn from_str(text: &str) -> Result<Self, String> {
        let camera: Self = ron_line::options().from_str(text).map_err(|e| {
            let expected = ron_line::explain(text, &e).expected;
            format!("expected a camera, `(p: (x, y, z), q: (x, y, z, w), fov_degrees: 60)`: {expected}")
        })?;
        camera.check().map_err(|expected| format!("expected {expected}"))?;
        Ok(camera)
    }
}
