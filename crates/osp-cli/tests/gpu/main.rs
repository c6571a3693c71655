//! Pictures and windows.

mod render;
#[cfg(all(feature = "window", target_os = "linux"))]
mod window;
