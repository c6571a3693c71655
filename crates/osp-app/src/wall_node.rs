//! The windows of a computer of a wall: they show the computer's screen, and present each frame at the time that the
//! hub specifies.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use glam::Vec2;
use thiserror::Error;
use winit::{
    application::ApplicationHandler,
    event::{KeyEvent, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow},
    keyboard::{Key, NamedKey},
    window::WindowId,
};

use super::{
    room::{Room, RoomView},
    wall_surface::{WallWindow, create_surface},
    window::{Wake, WindowError, open_event_loop, open_node_windows},
};
use osp_net::{
    live::Address,
    wall::{Node, NodeCounts, NodeOptions, Step, WallError},
};
use osp_render::{
    Eye, EyePicture, Gpu, GpuTimer, Layer, RenderError, Renderer, RendererConfig, Shown, Target, ViewSlot,
};
use osp_session::rig::Rig;

/// Interval between checks for work, if nothing wakes the windows.
const CHECK_INTERVAL: Duration = Duration::from_millis(10);
/// Interval between checks for events that a frame waits for.
const SHORT_CHECK_INTERVAL: Duration = Duration::from_millis(1);

/// Reason for which a computer has stopped.
#[derive(Debug, Error)]
pub enum ShowError {
    /// The window failed.
    #[error(transparent)]
    Window(#[from] WindowError),
    /// The connection to the wall failed.
    #[error(transparent)]
    Wall(#[from] WallError),
}

impl From<RenderError> for ShowError {
    fn from(error: RenderError) -> Self {
        Self::Window(error.into())
    }
}

/// Shows a computer's screen on its monitors in the rig, or in a plain window. Returns when a window is closed, Escape
/// is pressed, or `is_over` returns `true`. Messages about the hub and the session are passed to `tell`.
///
/// # Errors
/// There is no display, no adapter that can draw, or no such monitor or screen; or the hub refuses the computer.
pub fn show_node(
    address: &Address,
    options: &NodeOptions,
    is_over: impl Fn() -> bool,
    tell: impl Fn(&str),
) -> Result<NodeCounts, ShowError> {
    let event_loop = open_event_loop()?;
    let proxy = event_loop.create_proxy();
    let is_woken = Arc::new(AtomicBool::new(false));
    let of_thread = Arc::clone(&is_woken);
    let node = Node::open(address, options, move || {
        if !of_thread.swap(true, Ordering::SeqCst) {
            // Sending fails if the windows were closed.
            let _ = proxy.send_event(Wake);
        }
    })?;
    let screens =
        options.rig.screens.iter().filter(|screen| screen.name == options.screen).cloned().collect();
    let mut room = Room::new(Rig { screens, ..options.rig.clone() });
    room.stereo = options.stereo;
    let mut show = Show { node, room, is_over, tell, is_woken, display: None, failure: None };
    let outcome = event_loop.run_app(&mut show);
    if let Some(failure) = show.failure {
        return Err(failure);
    }
    outcome.map_err(|error| WindowError::NoDisplay(error.to_string()))?;
    Ok(show.node.counts())
}

struct Show<F, T> {
    node: Node,
    room: Room,
    is_over: F,
    tell: T,
    /// Whether data were received since the last check.
    is_woken: Arc<AtomicBool>,
    display: Option<Display>,
    failure: Option<ShowError>,
}

/// The windows and their renderer.
struct Display {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    eyes: Vec<Picture>,
    /// Drawn frames that are not presented yet, in the order of the windows. They must be dropped before the surfaces.
    frames: Vec<Option<wgpu::SurfaceTexture>>,
    windows: Vec<WallWindow>,
}

/// The picture of an eye.
struct Picture {
    slot: ViewSlot,
    target: Target,
    shown: Shown,
    timer: GpuTimer,
}

impl<F: Fn() -> bool, T: Fn(&str)> ApplicationHandler<Wake> for Show<F, T> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.display.is_none() {
            match Display::open(event_loop, &self.room) {
                Ok(display) => self.display = Some(display),
                Err(error) => self.fail(event_loop, error),
            }
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, _: Wake) {
        self.work(event_loop);
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        self.work(event_loop);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, window: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::KeyboardInput {
                event: KeyEvent { logical_key: Key::Named(NamedKey::Escape), .. },
                ..
            } => event_loop.exit(),
            WindowEvent::Resized(size) => {
                let Some(display) = &mut self.display else { return };
                // A drawn picture of the old size would not fit.
                display.frames.iter_mut().for_each(|frame| *frame = None);
                for wall in display.windows.iter_mut().filter(|wall| wall.window.id() == window) {
                    wall.surface.resize(size.width, size.height);
                }
            }
            _ => {}
        }
    }
}

impl<F: Fn() -> bool, T: Fn(&str)> Show<F, T> {
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: ShowError) {
        self.failure.get_or_insert(error);
        event_loop.exit();
    }

    fn work(&mut self, event_loop: &ActiveEventLoop) {
        self.is_woken.store(false, Ordering::SeqCst);
        if (self.is_over)() {
            event_loop.exit();
            return;
        }
        if let Some(news) = self.node.news() {
            (self.tell)(&news);
        }
        match self.step() {
            // The system's events are handled between two frames.
            Ok(Step::Draw | Step::Show) => event_loop.set_control_flow(ControlFlow::Poll),
            Ok(Step::Nothing) => {
                let look = if self.node.is_waiting() { SHORT_CHECK_INTERVAL } else { CHECK_INTERVAL };
                event_loop.set_control_flow(ControlFlow::WaitUntil(Instant::now() + look));
            }
            Err(error) => self.fail(event_loop, error),
        }
    }

    /// Performs the next step.
    fn step(&mut self) -> Result<Step, ShowError> {
        let Some(display) = &mut self.display else { return Ok(Step::Nothing) };
        let step = self.node.step(Duration::ZERO)?;
        match step {
            Step::Nothing => {}
            Step::Draw => {
                display.draw(&self.node, &self.room)?;
                self.node.ready();
            }
            Step::Show if display.show() => self.node.shown(),
            Step::Show => self.node.not_shown(),
        }
        Ok(step)
    }
}

impl Display {
    fn open(event_loop: &ActiveEventLoop, room: &Room) -> Result<Self, ShowError> {
        let opened = open_node_windows(event_loop, room)?;
        let display = Box::new(event_loop.owned_display_handle());
        let mut description = wgpu::InstanceDescriptor::new_with_display_handle_from_env(display);
        description.flags = osp_render::instance_flags();
        let instance = wgpu::Instance::new(description);
        let first = opened.first().map(|(_, window)| create_surface(&instance, window)).transpose()?;
        let Some(first) = first else {
            return Err(RenderError::Surface("the screen has no window".to_owned()).into());
        };
        let gpu = Arc::new(pollster::block_on(Gpu::for_surface_later(instance, &first))?);
        // Each window creates its own surface.
        drop(first);
        let windows = opened.into_iter().map(|(wall, window)| WallWindow::new(&gpu, wall, window));
        let windows: Vec<_> = windows.collect::<Result<_, _>>()?;
        let renderer = Renderer::new(Arc::clone(&gpu), &RendererConfig::default());
        gpu.check()?;
        let frames = windows.iter().map(|_| None).collect();
        Ok(Self { gpu, renderer, eyes: Vec::new(), frames, windows })
    }

    /// Draws a frame, and waits until the GPU has finished it.
    fn draw(&mut self, node: &Node, room: &Room) -> Result<(), ShowError> {
        self.renderer.follow(&node.changes);
        self.renderer.set_time(node.time_s);
        self.renderer.send(node.scene());
        let of = |(eye, view): (_, &_)| RoomView {
            view: *view,
            screen: 0,
            eye,
            from: Vec2::ZERO,
            to: Vec2::ONE,
            channels: room.channels_at(room.shown_at(eye)),
            is_clamped: false,
        };
        let views: Vec<RoomView> = node.views().map(of).collect();
        for (i, view) in views.iter().enumerate() {
            self.fit(room, i, view)?;
        }
        let layers: Vec<_> = node.pipeline().draw_lists().iter().map(Layer::plain).collect();
        let seen = views.iter().zip(&layers);
        let mut eyes: Vec<_> = self
            .eyes
            .iter_mut()
            .zip(seen)
            .map(|(eye, (view, layer))| {
                let layers = std::slice::from_ref(layer);
                Eye { slot: &mut eye.slot, view: &view.view, layers }
            })
            .collect();
        self.renderer.prepare_all(node.scene(), &mut eyes);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let eyes = self.eyes[..views.len()].iter_mut();
        let mut pictures: Vec<_> =
            eyes.map(|Picture { target, slot, timer, .. }| EyePicture { target, slot, timer }).collect();
        self.renderer.encode_all(&mut encoder, &mut pictures, &mut |_, _| {});
        for (wall, held) in self.windows.iter_mut().zip(&mut self.frames) {
            // A frame that was drawn but never presented is overwritten.
            let frame = match held.take() {
                Some(frame) => Some(frame),
                None => wall.acquire(&self.gpu)?,
            };
            if let Some(frame) = &frame {
                let shown = self.eyes.iter().map(|picture| &picture.shown);
                wall.draw(&mut encoder, frame, room, shown.zip(&views));
            }
            *held = frame;
        }
        self.gpu.queue.submit([encoder.finish()]);
        for picture in &mut self.eyes[..views.len()] {
            picture.timer.submitted();
            picture.slot.submitted();
        }
        Ok(self.gpu.wait()?)
    }

    /// Fits the picture of an eye to its window.
    fn fit(&mut self, room: &Room, i: usize, view: &RoomView) -> Result<(), ShowError> {
        let Some((wall, area)) =
            self.windows.iter().find_map(|wall| Some((wall, wall.area_of(room, view)?.0)))
        else {
            return Err(RenderError::Surface(
                "no window of this computer shows the view of one eye; check `outputs` in the rig".to_owned(),
            )
            .into());
        };
        let size = ((area.width as u32).max(1), (area.height as u32).max(1));
        if self.eyes.get(i).is_none_or(|picture| picture.target.size() != size) {
            let target = Target::new(&self.gpu, size.0, size.1)?;
            let shown = wall.show.bind(&self.gpu, &target);
            match self.eyes.get_mut(i) {
                Some(picture) => (picture.target, picture.shown) = (target, shown),
                None => self.eyes.push(Picture {
                    slot: self.renderer.create_view_slot(),
                    target,
                    shown,
                    timer: GpuTimer::new(&self.gpu),
                }),
            }
        }
        Ok(())
    }

    /// Presents the drawn frames. Returns whether every window had a drawn frame.
    fn show(&mut self) -> bool {
        let is_whole = self.frames.iter().all(Option::is_some);
        for frame in self.frames.iter_mut().filter_map(Option::take) {
            self.gpu.queue.present(frame);
        }
        is_whole
    }
}
