//! The windows on a rig's monitors.

use std::sync::Arc;

use winit::{
    dpi::{LogicalSize, PhysicalSize},
    event_loop::ActiveEventLoop,
    monitor::MonitorHandle,
    window::{Fullscreen, Window},
};

use super::start::{MonitorInfo, WindowError};
use crate::{
    painter::Painter,
    studio::Studio,
    walls::{Wall, walls},
};

/// Height of a wall without a monitor, points.
const PLAIN_HEIGHT: f64 = 480.0;
/// Approximate height of a window's title bar, pixels.
const FRAME_PX: u32 = 48;

/// Walls, each with its window.
type WallWindows = Vec<(Wall, Arc<Window>)>;

/// The monitors, in order of their numbers.
fn numbered(event_loop: &ActiveEventLoop) -> Vec<(MonitorInfo, MonitorHandle)> {
    let mut monitors: Vec<MonitorHandle> = event_loop.available_monitors().collect();
    monitors.sort_by_key(|monitor| (monitor.position().x, monitor.position().y));
    let info = |(i, monitor): (usize, MonitorHandle)| {
        let info = MonitorInfo {
            number: i + 1,
            name: monitor.name().unwrap_or_default(),
            size_px: monitor.size().into(),
            at_px: monitor.position().into(),
        };
        (info, monitor)
    };
    monitors.into_iter().enumerate().map(info).collect()
}

fn find<'a>(
    monitors: &'a [(MonitorInfo, MonitorHandle)],
    wanted: &str,
) -> Result<&'a (MonitorInfo, MonitorHandle), WindowError> {
    let by_name = monitors.iter().find(|(info, _)| info.name == wanted);
    let by_number = || monitors.iter().find(|(info, _)| info.number.to_string() == wanted);
    by_name.or_else(by_number).ok_or_else(|| WindowError::NoMonitor {
        wanted: wanted.to_owned(),
        there: monitors.iter().map(|(info, _)| info.clone()).collect(),
    })
}

/// Opens a window for each wall; also returns the numbers of the covered monitors.
fn windows_of(
    event_loop: &ActiveEventLoop,
    monitors: &[(MonitorInfo, MonitorHandle)],
    walls: Vec<Wall>,
) -> Result<(WallWindows, Vec<usize>), WindowError> {
    let mut covered = Vec::new();
    let mut attributes_of = Vec::new();
    // All monitors are looked up before a window opens.
    for wall in &walls {
        let attributes = Window::default_attributes().with_title(&wall.title);
        attributes_of.push(match &wall.monitor {
            Some(name) => {
                let (info, monitor) = find(monitors, name)?;
                if covered.contains(&info.number) {
                    return Err(WindowError::SameMonitor(info.clone()));
                }
                covered.push(info.number);
                // Size and position are set, too, because a desktop without a window manager has no full screen.
                attributes
                    .with_decorations(false)
                    .with_position(monitor.position())
                    .with_inner_size(monitor.size())
                    .with_fullscreen(Some(Fullscreen::Borderless(Some(monitor.clone()))))
            }
            None => {
                let size = LogicalSize::new(PLAIN_HEIGHT * f64::from(wall.aspect), PLAIN_HEIGHT);
                attributes.with_inner_size(size)
            }
        });
    }
    let mut windows = Vec::new();
    for (wall, attributes) in walls.into_iter().zip(attributes_of) {
        let covers_monitor = wall.monitor.is_some();
        let window = event_loop
            .create_window(attributes)
            .map_err(|error| WindowError::NoDisplay(error.to_string()))?;
        window.set_cursor_visible(!covers_monitor);
        windows.push((wall, Arc::new(window)));
    }
    Ok((windows, covered))
}

/// Opens the windows of a rig, which have no panels. The control window moves to a monitor that no window of the rig
/// covers. Returns a remark if no such monitor exists.
pub(super) fn open_walls(
    event_loop: &ActiveEventLoop,
    studio: &Studio,
    control: &Window,
    painter: &mut Painter,
) -> Result<Option<String>, WindowError> {
    let walls = walls(studio.room());
    if walls.is_empty() {
        return Ok(None);
    }
    let monitors = numbered(event_loop);
    let (windows, covered) = windows_of(event_loop, &monitors, walls)?;
    for (wall, window) in windows {
        painter.add_wall(wall, window)?;
    }
    let free = monitors.iter().find(|(info, _)| !covered.contains(&info.number));
    if let (Some((_, monitor)), false) = (free, covered.is_empty()) {
        control.set_outer_position(monitor.position());
        // The window must fit on the monitor, including its title bar.
        let (own, room) = (control.inner_size(), monitor.size());
        let fitted = PhysicalSize::new(
            own.width.min(room.width),
            own.height.min(room.height.saturating_sub(FRAME_PX)),
        );
        if fitted != own {
            let _ = control.request_inner_size(fitted);
        }
    }
    control.focus_window();
    let is_covered = free.is_none() && !covered.is_empty();
    Ok(is_covered.then(|| "no monitor is left for this window: the rig covers them all".to_owned()))
}

/// The monitors of the desktop.
///
/// # Errors
/// There is no display.
#[cfg(not(target_arch = "wasm32"))]
pub fn monitors() -> Result<Vec<MonitorInfo>, WindowError> {
    use winit::{application::ApplicationHandler, event::WindowEvent, window::WindowId};

    /// Lists the monitors once, then ends the event loop.
    struct MonitorList(Vec<MonitorInfo>);

    impl ApplicationHandler<crate::threads::Wake> for MonitorList {
        fn resumed(&mut self, event_loop: &ActiveEventLoop) {
            self.0 = numbered(event_loop).into_iter().map(|(info, _)| info).collect();
            event_loop.exit();
        }

        fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, _: WindowEvent) {}
    }

    let event_loop = super::start::open_event_loop()?;
    let mut list = MonitorList(Vec::new());
    event_loop.run_app(&mut list).map_err(|error| WindowError::NoDisplay(error.to_string()))?;
    Ok(list.0)
}
