#[cfg(not(target_arch = "wasm32"))]
mod signals;
mod start;
mod wall_windows;

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Arc, mpsc},
    time::Duration,
};

use glam::Vec2;
use winit::{
    application::ApplicationHandler,
    event::WindowEvent,
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy},
    window::{Fullscreen, Window, WindowId},
};

#[cfg(not(target_arch = "wasm32"))]
use signals::Signals;
pub(super) use start::open_event_loop;
pub use start::{MonitorInfo, WindowError, WindowOptions};
#[cfg(not(target_arch = "wasm32"))]
pub use wall_windows::monitors;
use wall_windows::open_walls;

use super::{
    painter::{Painter, Panels},
    previews,
    stats::{FrameStage, FrameTimes},
    studio::Studio,
    threads::{self, Wake},
    trace::Trace,
    tracker::Tracker,
    ui::{Interface, PreviewGrid},
};
use osp::frame::StageClock;
use osp_render::{Area, ComingImage, RenderError};
use osp_session::platform::time::Instant;

/// Largest number of recoveries from a lost device before the window closes.
const MAX_RECOVERIES: u32 = 5;

/// Interval between frames while only brushes are animated.
const ANIMATION_STEP: Duration = Duration::from_millis(33);

type Opened = (Arc<Window>, Result<Painter, RenderError>);

/// Opens a window for a studio and runs it until the user closes it.
///
/// # Errors
/// There is no display, no adapter can draw, an option cannot be fulfilled, or a part of the session could not be
/// written.
pub fn run(studio: Studio, options: WindowOptions) -> Result<(), WindowError> {
    let mut app = App {
        studio: Some(studio),
        options,
        trace: None,
        live: None,
        wake: None,
        #[cfg(not(target_arch = "wasm32"))]
        signals: None,
        opening: None,
        failure: None,
        recoveries: 0,
    };
    let prepared = app.prepare();
    #[cfg(target_arch = "wasm32")]
    {
        let event_loop = prepared?;
        super::page::listen(event_loop.create_proxy());
        winit::platform::web::EventLoopExtWebSys::spawn_app(event_loop, app);
        Ok(())
    }
    #[cfg(not(target_arch = "wasm32"))]
    {
        let outcome = prepared.and_then(|event_loop| app.run(event_loop));
        // An unwritten part of the session is the more important error.
        app.studio.take().map_or(Ok(()), Studio::close)?;
        outcome
    }
}

struct App {
    /// Present until the window closes.
    studio: Option<Studio>,
    options: WindowOptions,
    trace: Option<Trace>,
    live: Option<WindowParts>,
    /// Channel for the painter of a window that is being opened.
    opening: Option<mpsc::Receiver<Opened>>,
    /// Wakes the event loop from other threads.
    wake: Option<EventLoopProxy<Wake>>,
    #[cfg(not(target_arch = "wasm32"))]
    signals: Option<Signals>,
    failure: Option<WindowError>,
    recoveries: u32,
}

/// The parts that exist only while a window exists.
struct WindowParts {
    window: Arc<Window>,
    egui: egui_winit::State,
    interface: Interface,
    painter: Painter,
    clock: StageClock,
    last_frame: Instant,
    repaint_at: Option<Instant>,
    /// Whether the user has chosen the full screen.
    is_fullscreen: bool,
    /// Time of the next check of the session's file, independent of frames.
    tend_at: Instant,
    /// Channel for the pictures of brushes.
    previews: Option<mpsc::Receiver<Result<Vec<u8>, String>>>,
    /// A picture that will be saved, and its file.
    picture: Option<(PathBuf, ComingImage)>,
}

struct LaidOut {
    model: Area,
    panels: Panels,
    /// Time until the panels need the next frame.
    delay: Option<Duration>,
}

impl WindowParts {
    fn lay_out(&mut self, studio: &mut Studio, wake: Option<&EventLoopProxy<Wake>>) -> LaidOut {
        #[cfg_attr(not(target_arch = "wasm32"), expect(unused_mut, reason = "a page adds to it"))]
        let mut input = self.egui.take_egui_input(&self.window);
        #[cfg(target_arch = "wasm32")]
        super::page::take_typed(&mut input.events);
        let context = self.egui.egui_ctx().clone();
        let mut area = egui::Rect::NOTHING;
        let output = context.run_ui(input, |ui| area = self.interface.show(ui, studio));
        #[cfg(target_arch = "wasm32")]
        super::page::note_text_field(output.platform_output.ime.is_some());
        self.egui.handle_platform_output(&self.window, output.platform_output);
        // Reading a picture back blocks, which a web page does not allow.
        let can_wait = !cfg!(target_arch = "wasm32");
        if let (true, Some(wake)) = (can_wait && self.interface.wants_previews(), wake) {
            self.take_previews(&context, studio, wake);
        }
        let viewport = output.viewport_output.get(&egui::ViewportId::ROOT);
        LaidOut {
            model: model_area(area, output.pixels_per_point),
            delay: viewport.map(|viewport| viewport.repaint_delay),
            panels: Panels {
                primitives: context.tessellate(output.shapes, output.pixels_per_point),
                textures: output.textures_delta,
                pixels_per_point: output.pixels_per_point,
            },
        }
    }

    /// Takes the picture of a frame that was presented. Another frame may not have been drawn.
    fn take_picture(&mut self, studio: &mut Studio) {
        if let Some(path) = studio.take_picture() {
            match self.painter.picture() {
                Ok(coming) => self.picture = Some((path, coming)),
                Err(error) => report_picture(studio, &path, Err(error)),
            }
        }
    }

    fn write_picture(&mut self, studio: &mut Studio) {
        let Some((path, coming)) = &self.picture else { return };
        if let Some(picture) = coming.take(self.painter.gpu()) {
            report_picture(studio, path, picture.and_then(|picture| picture.write_png(path)));
            self.picture = None;
        }
        self.window.request_redraw();
    }

    /// Receives the pictures of the brushes, which another thread draws. Until the pictures are finished, or if drawing
    /// fails, the list has only names.
    fn take_previews(&mut self, context: &egui::Context, studio: &mut Studio, wake: &EventLoopProxy<Wake>) {
        let Some(drawing) = &self.previews else {
            let (gpu, wake) = (Arc::clone(self.painter.gpu()), wake.clone());
            let (drawn, drawing) = mpsc::channel();
            let _ = threads::in_background("previews", move || {
                let pictures = previews::draw(&gpu, &PreviewGrid::default());
                // A closing window has no receiver. The pictures are sent first, so that the window finds them when it
                // is woken.
                let _ = drawn.send(pictures.map_err(|error| error.to_string()));
                let _ = wake.send_event(Wake);
            });
            self.previews = Some(drawing);
            return;
        };
        let outcome = match drawing.try_recv() {
            Ok(outcome) => outcome,
            Err(mpsc::TryRecvError::Empty) => return,
            Err(mpsc::TryRecvError::Disconnected) => Err("drawing them failed".to_owned()),
        };
        self.previews = None;
        let texture = match outcome {
            Ok(texture) => {
                let (width, height) = PreviewGrid::default().size_px();
                let image =
                    egui::ColorImage::from_rgba_unmultiplied([width as usize, height as usize], &texture);
                Some(context.load_texture("brushes", image, egui::TextureOptions::LINEAR))
            }
            Err(error) => {
                studio.show_message(format!("no pictures of brushes: {error}"));
                None
            }
        };
        self.interface.set_previews(texture);
        self.window.request_redraw();
    }
}

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.live.is_some() || self.opening.is_some() {
            return;
        }
        if let Err(error) = self.open_window(event_loop) {
            self.fail(event_loop, error);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, Wake: Wake) {
        #[cfg(not(target_arch = "wasm32"))]
        self.settle_on_signal(event_loop);
        if let Err(error) = self.take_painter(event_loop) {
            self.fail(event_loop, error);
        }
        if let Some(live) = &self.live {
            live.window.request_redraw();
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        let Some(live) = &mut self.live else { return };
        if id != live.window.id() {
            match &event {
                WindowEvent::Resized(size) => live.painter.resize_wall(id, size.width, size.height),
                // A desktop may give a wall's window the keyboard focus.
                WindowEvent::KeyboardInput { .. }
                | WindowEvent::ModifiersChanged(_)
                | WindowEvent::Focused(_) => {
                    let _ = live.egui.on_window_event(&live.window, &event);
                }
                _ => {}
            }
            live.window.request_redraw();
            if event == WindowEvent::CloseRequested {
                self.ask_to_close(event_loop);
            }
            return;
        }
        // egui must not get the redraw event, because egui would request the next redraw.
        if !matches!(event, WindowEvent::RedrawRequested)
            && live.egui.on_window_event(&live.window, &event).repaint
        {
            live.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => {
                live.window.request_redraw();
                self.ask_to_close(event_loop);
            }
            WindowEvent::Resized(size) => {
                live.painter.resize(size.width, size.height);
                live.window.request_redraw();
            }
            WindowEvent::Occluded(false) => live.window.request_redraw(),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.frame(event_loop) {
                    self.fail(event_loop, error);
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(live) = &mut self.live else { return };
        let now = Instant::now();
        if live.tend_at <= now {
            let Some(studio) = &mut self.studio else { return };
            if studio.tend() {
                live.window.request_redraw();
            }
            live.tend_at = now + studio.tend_within();
        }
        if live.repaint_at.is_some_and(|at| at <= now) {
            live.repaint_at = None;
            live.window.request_redraw();
        }
        let next = live.repaint_at.map_or(live.tend_at, |at| at.min(live.tend_at));
        event_loop.set_control_flow(ControlFlow::WaitUntil(next));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        self.live = None;
    }
}

impl App {
    fn prepare(&mut self) -> Result<EventLoop<Wake>, WindowError> {
        let event_loop = open_event_loop()?;
        self.wake = Some(event_loop.create_proxy());
        #[cfg(not(target_arch = "wasm32"))]
        {
            self.signals = Some(Signals::watch(event_loop.create_proxy()));
        }
        if let Some(studio) = &mut self.studio {
            studio.work_in_background();
        }
        if let Some(path) = &self.options.trace {
            let trace = Trace::create(path);
            self.trace = Some(trace.map_err(|cause| WindowError::Trace { path: path.clone(), cause })?);
        }
        if let (Some(address), Some(studio)) = (&self.options.tracker, &mut self.studio) {
            let proxy = event_loop.create_proxy();
            // A closing window has no receiver.
            let tracker = Tracker::open(address, &self.options.tracker_options, move || {
                let _ = proxy.send_event(Wake);
            })?;
            if let Some(address) = tracker.local_address {
                studio.show_message(format!("listening to a tracker at udp://{address}"));
            }
            if let Some(warning) = address.warning(&self.options.tracker_options) {
                studio.show_message(warning);
            }
            studio.set_tracker(tracker);
        }
        Ok(event_loop)
    }

    /// Writes the session before a signal ends the program. If that fails, the window closes with an error instead.
    #[cfg(not(target_arch = "wasm32"))]
    fn settle_on_signal(&mut self, event_loop: &ActiveEventLoop) {
        let answer = self.signals.as_ref().and_then(Signals::next);
        let (Some(answer), Some(studio)) = (answer, &mut self.studio) else { return };
        match studio.settle() {
            // The signal's default action follows.
            Ok(()) => _ = answer.send(()),
            Err(unwritten) => self.fail(event_loop, unwritten.into()),
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn run(&mut self, event_loop: EventLoop<Wake>) -> Result<(), WindowError> {
        let outcome = event_loop.run_app(self);
        match (self.failure.take(), outcome) {
            (Some(failure), _) => Err(failure),
            (None, Err(error)) => Err(WindowError::NoDisplay(error.to_string())),
            (None, Ok(())) => Ok(()),
        }
    }

    /// Writes a trace line. If writing fails, the trace ends, because the session is more important.
    fn trace(&mut self, times: &FrameTimes, is_shown: bool, window: (u32, u32)) {
        let (Some(trace), Some(studio)) = (&mut self.trace, &mut self.studio) else { return };
        if let Err(error) = trace.write(studio, times, is_shown, window) {
            let path = self.options.trace.clone().unwrap_or_default();
            let warning = format!("{}: {error}: no trace from here on", path.display());
            // A closed standard error is ignored.
            let _ = writeln!(io::stderr().lock(), "warning: {warning}");
            studio.show_message(warning);
            self.trace = None;
        }
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, error: WindowError) {
        #[cfg(target_arch = "wasm32")]
        super::page::fail(&error);
        self.failure.get_or_insert(error);
        event_loop.exit();
    }

    fn ask_to_close(&mut self, event_loop: &ActiveEventLoop) {
        let Some(studio) = &mut self.studio else { return };
        studio.ask_to_close();
        if studio.is_closing() {
            event_loop.exit();
        }
    }

    /// Opens a window and creates its painter. On a web page the painter is available later.
    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), WindowError> {
        let attributes = Window::default_attributes().with_title("osp");
        #[cfg(target_arch = "wasm32")]
        // The page's style sheet determines the size.
        let attributes = winit::platform::web::WindowAttributesExtWebSys::with_append(attributes, true);
        #[cfg(not(target_arch = "wasm32"))]
        let attributes = {
            use winit::dpi::LogicalSize;
            let (width, height) = self.options.size.unwrap_or_else(|| first_size(event_loop));
            let size = LogicalSize::new(width, height);
            attributes.with_inner_size(size).with_min_inner_size(LogicalSize::new(480, 320))
        };
        let window = event_loop
            .create_window(attributes)
            .map_err(|error| WindowError::NoDisplay(error.to_string()))?;
        let window = Arc::new(window);
        let painter = Painter::new(Arc::clone(&window), Box::new(event_loop.owned_display_handle()));
        let (opened, opening) = mpsc::channel();
        let wake = self.wake.clone();
        threads::when_done(painter, move |painter| {
            // A closing window has no receiver.
            let _ = opened.send((window, painter));
            let _ = wake.map(|wake| wake.send_event(Wake));
        });
        self.opening = Some(opening);
        self.take_painter(event_loop)
    }

    /// Completes the opening of a window once its painter exists.
    fn take_painter(&mut self, event_loop: &ActiveEventLoop) -> Result<(), WindowError> {
        let Some(Ok((window, painter))) = self.opening.as_ref().map(mpsc::Receiver::try_recv) else {
            return Ok(());
        };
        self.opening = None;
        let mut painter = painter?;
        if let Some(studio) = &mut self.studio {
            match open_walls(event_loop, studio, &window, &mut painter) {
                Ok(remark) => remark.into_iter().for_each(|remark| studio.show_message(remark)),
                // Drawing continues if a monitor was removed.
                Err(error) if self.recoveries > 0 => studio.show_message(error.to_string()),
                Err(error) => return Err(error),
            }
        }
        let context = egui::Context::default();
        let side = painter.max_texture_side();
        let egui = egui_winit::State::new(
            context,
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            Some(side),
        );
        let mut interface = Interface::new(painter.adapter());
        if let (Some(path), Some(studio)) = (&self.options.settings, &mut self.studio) {
            interface.keep_settings(path.clone(), egui.egui_ctx(), studio);
        }
        window.request_redraw();
        self.live = Some(WindowParts {
            interface,
            window,
            egui,
            painter,
            clock: StageClock::default(),
            last_frame: Instant::now(),
            repaint_at: None,
            is_fullscreen: false,
            tend_at: Instant::now(),
            previews: None,
            picture: None,
        });
        Ok(())
    }

    /// Processes one frame in this order: input, change, cull, occlude, draw, panel.
    fn frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), WindowError> {
        let (Some(live), Some(studio)) = (&mut self.live, &mut self.studio) else { return Ok(()) };
        #[cfg(target_arch = "wasm32")]
        super::page::before_frame(studio);
        let window_size = live.window.inner_size();
        let frame_secs = live.last_frame.elapsed().as_secs_f32();
        live.last_frame = Instant::now();

        // Input: everything up to here is part of this frame. The layout finds what belongs to the panels.
        let start = live.clock.start();
        let LaidOut { model, panels, delay } = live.lay_out(studio, self.wake.as_ref());
        let panel_ns = live.clock.since(start).ns;
        // Change: pointer and commands, then keys, tracker and replay. Cull and occlude: the index follows the changes.
        live.interface.carry_out(studio);
        let size_px = Vec2::new(model.width, model.height);
        let report = studio.frame(size_px, frame_secs);
        // Draw the model, and the panels over it.
        let painted = match live.painter.paint(studio, model, panels) {
            Ok(painted) => painted,
            Err(error) => return self.recover(event_loop, error),
        };

        if painted.is_shown {
            studio.note_drawing(painted.draw_ns);
            studio.note_shown();
            live.take_picture(studio);
        }
        live.write_picture(studio);
        // The window changes only when the user's choice changes, because the desktop has its own keys for full screen.
        let wants_screen = live.interface.is_fullscreen();
        if std::mem::replace(&mut live.is_fullscreen, wants_screen) != wants_screen {
            live.window.set_fullscreen(wants_screen.then_some(Fullscreen::Borderless(None)));
        }
        let mut times = FrameTimes::default();
        times.set(FrameStage::Strokes, report.strokes_ns);
        times.set(FrameStage::Insert, report.record.insert.ns);
        times.set(FrameStage::Cull, report.record.cull.ns);
        times.set(FrameStage::Occlusion, report.record.occlusion.total_ns());
        times.set(FrameStage::Send, painted.send_ns);
        times.set(FrameStage::Draw, painted.draw_ns);
        times.set(FrameStage::Panel, panel_ns);
        live.interface.note_frame(times);
        live.interface.note_passes(studio.while_drawing().and_then(|(_, times)| times));
        set_title(&live.window, studio);

        if studio.is_moving() || live.interface.is_fresh() {
            live.window.request_redraw();
        } else {
            let by_itself = live.painter.is_animated().then_some(ANIMATION_STEP);
            let delay = delay.into_iter().chain(studio.next_frame_in()).chain(by_itself).min();
            live.repaint_at = delay.and_then(|delay| Instant::now().checked_add(delay));
        }
        if studio.is_closing() {
            event_loop.exit();
        }
        #[cfg(target_arch = "wasm32")]
        super::page::after_frame(
            studio,
            live.painter.adapter(),
            live.interface.clock_step_ns(),
            painted.is_shown,
        );
        self.trace(&times, painted.is_shown, (window_size.width, window_size.height));
        Ok(())
    }

    /// Creates the device again after a loss. The scene is complete; only the GPU's copy is lost.
    fn recover(&mut self, event_loop: &ActiveEventLoop, error: RenderError) -> Result<(), WindowError> {
        self.recoveries += 1;
        if self.recoveries > MAX_RECOVERIES {
            return Err(error.into());
        }
        self.live = None;
        if let Some(studio) = &mut self.studio {
            studio.show_message(format!("{error}; drawing continues"));
            studio.send_all_again();
        }
        self.open_window(event_loop)
    }
}

fn report_picture(studio: &mut Studio, path: &Path, outcome: Result<(), RenderError>) {
    let said = outcome.map(|()| format!("the picture is in {}", path.display()));
    studio.report_file(said.map_err(|error| match error {
        RenderError::Write { .. } => error.to_string(),
        _ => format!("{}: {error}", path.display()),
    }));
}

/// The model's part of the window in whole pixels.
fn model_area(area: egui::Rect, pixels_per_point: f32) -> Area {
    let (from, to) = (area.min * pixels_per_point, area.max * pixels_per_point);
    let (x, y) = (from.x.round().max(0.0), from.y.round().max(0.0));
    Area { x, y, width: (to.x.round() - x).max(1.0), height: (to.y.round() - y).max(1.0) }
}

/// Size of the first window, points: it fits the screen, with a title and the desktop's bars.
#[cfg(not(target_arch = "wasm32"))]
fn first_size(event_loop: &ActiveEventLoop) -> (u32, u32) {
    let monitor = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
    let room = monitor.map(|monitor| monitor.size().to_logical::<u32>(monitor.scale_factor()));
    match room {
        Some(room) if room.width > 0 => (
            1280.min(room.width.saturating_sub(16)).max(480),
            800.min(room.height.saturating_sub(96)).max(320),
        ),
        _ => (1280, 800),
    }
}

fn set_title(window: &Window, studio: &Studio) {
    let (session, journal) = (studio.session(), studio.session().journal());
    let name = session.path().file_name().unwrap_or_default().to_string_lossy();
    let title = match (journal.is_read_only(), journal.trouble().is_some(), journal.is_named()) {
        _ if studio.is_reading() && session.event_count() == 0 => "opening… - osp".to_owned(),
        _ if session.is_replay() => format!("{name} (replay) - osp"),
        (true, ..) => format!("{name} (read-only) - osp"),
        (_, true, _) => format!("*{name} (NOT saved) - osp"),
        (.., true) => format!("{name} - osp"),
        _ => match session.original().and_then(Path::file_name) {
            Some(original) => format!("{} (a copy) - osp", original.to_string_lossy()),
            None => "no name yet - osp".to_owned(),
        },
    };
    if window.title() != title {
        window.set_title(&title);
    }
}
