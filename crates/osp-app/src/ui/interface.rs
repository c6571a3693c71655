use std::path::{Path, PathBuf};

use egui::{Align2, Color32, Context, Key, Panel, Rect, ScrollArea, Sense, Ui, Window};
use glam::Vec3;

#[cfg(feature = "live")]
use super::others;
use super::{
    actions::Action,
    authors,
    brushes::BrushList,
    calibrating::Calibrating,
    canvas::PointerInput,
    dialog::{Answer, PathDialog},
    groups::GroupList,
    help::{Help, LESSON},
    keys, menu,
    numbers::{self, Measured},
    paint_layers::LayerList,
    panel_commands::PanelCommands,
    questions,
    recent::RecentList,
    replay_bar, room,
    selected::SelectionPanel,
    status, tools,
};
use crate::{
    command::Command,
    question::Question,
    settings::{KeptBrush, Settings, SettingsKeeper, Theme},
    stats::{FrameTimes, History, PassHistory},
    studio::Studio,
    tool::ToolChoice,
};
use osp::frame::StageClock;
use osp_render::PassTimes;

/// Width below which a window counts as narrow, points; windows on a desktop are wider.
const NARROW: f32 = 480.0;
/// Colours of hints on dark and on light panels.
const WEAK_ON_DARK: Color32 = Color32::from_gray(150);
const WEAK_ON_LIGHT: Color32 = Color32::from_gray(96);
/// Width of the panel with times and counts, points.
const NUMBERS_WIDTH: f32 = 268.0;

/// The whole user interface of the window, without the model.
#[derive(Debug, Default)]
pub struct Interface {
    history: History,
    passes: PassHistory,
    /// Resolution of the clock that measures frames, nanoseconds.
    clock_step_ns: u64,
    shows_panel: bool,
    /// Whether a narrow window, such as a phone's, shows the tools. The tools leave little space for the model.
    shows_tools: bool,
    shows_help: bool,
    is_fullscreen: bool,
    is_styled: bool,
    settings: Settings,
    /// The settings that were last written.
    kept: Settings,
    /// Writes the settings, if they are stored.
    keeper: Option<SettingsKeeper>,
    /// Path of the session in the last frame.
    shown: PathBuf,
    dialog: Option<PathDialog>,
    adapter: String,
    /// Whether the bar of a replay and the progress of work were shown in the last frame.
    lines: [bool; 2],
    /// The question in the last frame.
    asked: Option<Question>,
    /// Whether the user has drawn in this session; the first hint is then no longer shown.
    has_drawn: bool,
    recent: RecentList,
    brushes: BrushList,
    groups: GroupList,
    help: Help,
    /// Keys of shortcuts that are still pressed: they do not fly, even if the modifier is released first.
    shortcut_keys: Vec<Key>,
    layers: LayerList,
    selected: SelectionPanel,
    calibrating: Option<Calibrating>,
    /// The input of the last layout, until it is carried out.
    pointer: Option<PointerInput>,
    requested: PanelCommands,
}

impl Interface {
    /// The interface of a window; `adapter` is the name of the graphics adapter.
    pub fn new(adapter: String) -> Self {
        Self { adapter, clock_step_ns: StageClock::default().step_ns(), ..Self::default() }
    }

    /// Reads the settings from this file, and stores changes there from now on.
    pub fn keep_settings(&mut self, path: PathBuf, ctx: &Context, studio: &mut Studio) {
        self.settings = Settings::read(&path);
        self.settings.brush.give(&mut studio.input.brush);
        self.kept = self.settings.clone();
        ctx.set_zoom_factor(self.settings.zoom);
        self.keeper = Some(SettingsKeeper::new(path));
    }

    /// The settings, which are stored between runs.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether the user has chosen the full screen.
    pub fn is_fullscreen(&self) -> bool {
        self.is_fullscreen
    }

    pub fn note_frame(&mut self, times: FrameTimes) {
        self.history.push(times);
    }

    /// Adds the GPU's times of a frame, if they are measured.
    pub fn note_passes(&mut self, times: Option<PassTimes>) {
        self.passes.push(times);
    }

    /// Resolution of the clock that measures frames, nanoseconds.
    pub fn clock_step_ns(&self) -> u64 {
        self.clock_step_ns
    }

    /// The times of the last frames.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Whether the list of brushes was opened and its pictures are not set yet.
    pub fn wants_previews(&self) -> bool {
        self.brushes.wants_previews()
    }

    /// Sets the pictures of the brushes, in the layout of [`PreviewGrid`](super::PreviewGrid). Without pictures the
    /// list shows only names.
    pub fn set_previews(&mut self, previews: Option<egui::TextureHandle>) {
        self.brushes.set_previews(previews);
    }

    /// Whether the window has just opened, so that the layout is not stable yet.
    pub fn is_fresh(&self) -> bool {
        self.history.frames().len() < 3
    }

    /// Lays out the interface, and returns the model's part of the window, in points. The model changes in
    /// [`Interface::carry_out`].
    pub fn show(&mut self, ui: &mut Ui, studio: &mut Studio) -> Rect {
        let mut panel_commands = PanelCommands {
            panel: self.shows_panel,
            help: self.shows_help,
            fullscreen: self.is_fullscreen,
            ..PanelCommands::default()
        };
        self.settle(ui.ctx(), studio);
        self.shortcuts(ui, studio, &mut panel_commands);
        if self.dialog.is_none() && studio.question().is_none() {
            take_dropped(ui, &mut panel_commands);
        }
        let is_narrow = ui.available_width() < NARROW;
        let is_looking = studio.tool() == ToolChoice::Look;
        Panel::top("menu").resizable(false).show(ui, |ui| {
            ui.horizontal(|ui| {
                if is_narrow && !is_looking {
                    ui.toggle_value(&mut self.shows_tools, "Tools");
                }
                menu::show(ui, studio, &mut self.settings, &mut self.recent, &mut panel_commands);
                menu::mode(ui, studio, &mut panel_commands);
            });
        });
        // A panel keeps the height of its last layout for one frame.
        let lines = [studio.session().replay().is_some(), studio.work_shown().is_some()];
        if std::mem::replace(&mut self.lines, lines) != lines {
            ui.ctx().request_repaint();
        }
        Panel::bottom("status").resizable(false).show(ui, |ui| {
            if let Some(replay) = studio.session().replay() {
                replay_bar::show(ui, replay, studio.follows_replay_camera(), &mut panel_commands);
            }
            if !studio.is_reading() {
                work(ui, studio, &mut panel_commands);
            }
            status::show(ui, studio);
        });
        if studio.room().rig().is_some() || studio.tracker().is_some() {
            Panel::bottom("room").resizable(false).show(ui, |ui| {
                ScrollArea::horizontal()
                    .show(ui, |ui| room::show(ui, studio, &mut self.calibrating, &mut panel_commands));
            });
        }
        let is_aside = self.dialog.is_some() || studio.question().is_some();
        if let Some(calibrating) = self.calibrating.as_mut().filter(|_| !is_aside) {
            let goes_on = calibrating.show(ui.ctx(), studio, &mut panel_commands);
            if !goes_on {
                self.calibrating = None;
            }
        }
        studio.set_calibrating(self.calibrating.is_some());
        if (self.shows_tools || !is_narrow) && !is_looking && has_tools(studio) {
            Panel::left("tools").resizable(false).exact_size(168.0).show(ui, |ui| {
                ScrollArea::vertical().show(ui, |ui| {
                    tools::show(ui, studio, &mut self.brushes, &mut panel_commands);
                    ui.separator();
                    authors::show(ui, studio, &mut panel_commands);
                    self.selected.show(ui, studio, &mut panel_commands);
                    self.groups.show(ui, studio, &mut panel_commands);
                    ui.separator();
                    self.layers.show(ui, studio, &mut panel_commands);
                });
            });
        }
        let area = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(area, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsObject, true, "model"));
        self.pointer = Some(PointerInput::read(ui, &response));
        self.hint(ui, area, studio);
        if panel_commands.panel {
            self.numbers(ui, area, studio, &mut panel_commands);
        }
        #[cfg(feature = "live")]
        others::show(ui, area, studio);
        if panel_commands.help {
            self.help.show(ui, &mut panel_commands.help);
        }
        if studio.is_reading() && studio.work_shown().is_some() {
            egui::Modal::new(egui::Id::unique("reading"))
                .show(ui.ctx(), |ui| work(ui, studio, &mut panel_commands));
        }
        if studio.question().is_none() {
            questions::trouble(ui.ctx(), studio, &mut panel_commands);
        }
        self.question(ui.ctx(), studio, &mut panel_commands);
        self.dialog(ui, studio, &mut panel_commands);
        self.requested = panel_commands;
        area
    }

    /// Applies the pointer's input and the user's commands. Call it after the layout.
    pub fn carry_out(&mut self, studio: &mut Studio) {
        if let Some(pointer) = self.pointer.take() {
            pointer.give(studio);
        }
        let requested = std::mem::take(&mut self.requested);
        if let Some(follow) = requested.follow_camera {
            studio.follow_replay_camera(follow);
        }
        if let Some(chosen) = requested.chosen {
            studio.take_file_outcome();
            studio.command(chosen);
        }
        for command in requested.commands {
            // The dialog belonged to the previous session.
            if matches!(command, Command::New | Command::Open(_) | Command::OpenAs(..) | Command::PlayFile(_))
            {
                self.dialog = None;
            }
            studio.command(command);
        }
        match (studio.take_file_outcome(), &mut self.dialog) {
            (Some(Ok(())), dialog) => *dialog = None,
            (Some(Err(reason)), Some(dialog)) => dialog.fail(reason),
            _ => {}
        }
    }

    /// Shows times and counts over the right side of the model, which stays in place.
    fn numbers(&mut self, ui: &Ui, area: Rect, studio: &mut Studio, panel_commands: &mut PanelCommands) {
        let measured = Measured {
            history: &self.history,
            passes: self.passes.mean(),
            clock_step_ns: self.clock_step_ns,
            adapter: &self.adapter,
        };
        Window::new("numbers")
            .title_bar(false)
            .resizable(false)
            .fixed_pos(area.right_top() - egui::vec2(NUMBERS_WIDTH + 16.0, -4.0))
            .fixed_size([NUMBERS_WIDTH, area.height() - 24.0])
            .show(ui.ctx(), |ui| {
                ui.set_width(NUMBERS_WIDTH);
                ScrollArea::vertical()
                    .max_height(area.height() - 24.0)
                    .show(ui, |ui| numbers::show(ui, studio, &measured, panel_commands));
            });
    }

    fn question(&mut self, ctx: &Context, studio: &Studio, panel_commands: &mut PanelCommands) {
        let asked = studio.question();
        let is_new = self.asked.as_ref() != asked;
        if is_new {
            self.asked = asked.cloned();
        }
        if let Some(question) = asked {
            questions::question(ctx, question, is_new, panel_commands);
        }
    }

    /// Shows the dialog of a path, and copies text to the clipboard.
    fn dialog(&mut self, ui: &Ui, studio: &mut Studio, panel_commands: &mut PanelCommands) {
        (self.shows_panel, self.shows_help) = (panel_commands.panel, panel_commands.help);
        self.is_fullscreen = panel_commands.fullscreen;
        if let Some(ask) = panel_commands.ask {
            // An earlier result must not count as the result of this dialog.
            studio.take_file_outcome();
            self.dialog = Some(PathDialog::new(ask, studio));
        }
        // A question about the dialog's file is answered first; then the dialog gets the keyboard focus back.
        if let Some(dialog) = self.dialog.as_mut().filter(|_| studio.question().is_some()) {
            dialog.take_keyboard();
        }
        let is_aside = studio.question().is_some() || studio.is_reading();
        let dialog = self.dialog.as_mut().filter(|_| !is_aside);
        match dialog.map(|dialog| dialog.show(ui.ctx())) {
            None | Some(Answer::StillOpen) => {}
            Some(Answer::Closed) => self.dialog = None,
            Some(Answer::Chosen(command)) => panel_commands.chosen = Some(command),
        }
        if panel_commands.commands.iter().any(|command| matches!(command, Command::Copy | Command::Cut)) {
            // The text makes the clipboard non-empty, because an empty clipboard is never pasted. It does not contain
            // the strokes.
            ui.ctx().copy_text("strokes of osp".to_owned());
        }
    }

    /// Stores changed settings. Adds a session that was opened or saved under a name to the recent sessions.
    fn settle(&mut self, ctx: &Context, studio: &mut Studio) {
        let session = studio.session();
        let named = if session.journal().is_named() { session.path() } else { Path::new("") };
        if named != self.shown {
            named.clone_into(&mut self.shown);
            // A path that is not valid text cannot be stored. Autosave files have a separate list.
            if named.to_str().is_some_and(|name| !name.is_empty()) && !studio.autosaves.has(named) {
                self.settings.note_recent(named);
            }
        }
        self.settings.brush = KeptBrush::of(&studio.brush());
        self.settings.zoom = ctx.zoom_factor();
        if !std::mem::replace(&mut self.is_styled, true) {
            // The default grey of hints is too faint to read (WCAG 2.2, criterion 1.4.3).
            ctx.all_styles_mut(|style| {
                let grey = if style.visuals.dark_mode { WEAK_ON_DARK } else { WEAK_ON_LIGHT };
                style.visuals.weak_text_color = Some(grey);
            });
        }
        ctx.set_theme(match self.settings.theme {
            Theme::Dark => egui::ThemePreference::Dark,
            Theme::Light => egui::ThemePreference::Light,
            Theme::System => egui::ThemePreference::System,
        });
        if self.settings != self.kept {
            self.kept = self.settings.clone();
            if let Some(keeper) = &self.keeper {
                keeper.keep(&self.settings);
            }
        }
    }

    fn shortcuts(&mut self, ui: &Ui, studio: &mut Studio, panel_commands: &mut PanelCommands) {
        if studio.is_reading() {
            if ui.input(|input| input.key_pressed(Key::Escape)) {
                panel_commands.commands.push(Command::CancelWork);
            }
            return;
        }
        if ui.ctx().egui_wants_keyboard_input() || self.dialog.is_some() || studio.question().is_some() {
            studio.set_flight(Vec3::ZERO);
            return;
        }
        for shortcut in keys::shortcuts() {
            // An open list, menu or dialog handles Escape itself.
            let is_taken = shortcut.action == Action::Escape
                && (egui::Popup::is_any_open(ui.ctx()) || self.calibrating.is_some());
            // The shortcut is consumed even if it has no effect now, so that the same key with fewer modifiers does not
            // act.
            if !is_taken && ui.input_mut(|input| input.consume_shortcut(&shortcut.keys)) {
                shortcut.action.perform(studio, panel_commands);
            }
        }
        // A desktop reports these keys as separate events.
        let clipped = ui.input(|input| {
            input.events.iter().find_map(|event| match event {
                egui::Event::Copy => Some(Command::Copy),
                egui::Event::Cut => Some(Command::Cut),
                egui::Event::Paste(_) => Some(Command::Paste),
                _ => None,
            })
        });
        if let Some(command) = clipped {
            Action::Do(command).perform(studio, panel_commands);
        }
        studio.set_flight(flight(ui, &mut self.shortcut_keys));
    }

    fn hint(&mut self, ui: &Ui, area: Rect, studio: &Studio) {
        self.has_drawn |= studio.scene().polygon_count() > 0;
        self.settings.has_drawn |= self.has_drawn && studio.can_draw();
        if self.has_drawn || !studio.can_draw() || studio.is_reading() {
            return;
        }
        let at = area.center() - egui::vec2(0.0, area.height() * 0.22);
        let painter = ui.painter_at(area);
        let font = egui::FontId::proportional(22.0);
        painter.text(at, Align2::CENTER_CENTER, "Drag to draw", font, Color32::from_white_alpha(170));
        // A user who has drawn before needs no introduction.
        let rest = ["right button: orbit    wheel: nearer, farther    F1: all keys"];
        let lines: &[&str] = if self.settings.has_drawn { &rest } else { &LESSON };
        let mut below = at + egui::vec2(0.0, 26.0);
        for line in lines {
            let font = egui::FontId::proportional(14.0);
            painter.text(below, Align2::CENTER_CENTER, line, font, Color32::from_white_alpha(120));
            below.y += 20.0;
        }
    }
}

/// Whether the left panel has anything to show. In a replay it lists authors and layers only.
fn has_tools(studio: &Studio) -> bool {
    // The window opens with a file: it is no empty drawing.
    if studio.is_reading() && studio.session().event_count() == 0 {
        return false;
    }
    let has_lists = || studio.scene().authors().next().is_some() || studio.session_layers().len() > 1;
    !studio.session().is_replay() || has_lists()
}

fn take_dropped(ui: &Ui, panel_commands: &mut PanelCommands) {
    let dropped = ui.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
    panel_commands.commands.extend(dropped.map(Command::Open));
}

/// The flight direction from the pressed keys: right, up, back. Updates the pressed keys of shortcuts.
fn flight(ui: &Ui, shortcut_keys: &mut Vec<Key>) -> Vec3 {
    ui.input(|input| {
        for event in &input.raw.events {
            if let egui::Event::Key { key, pressed: true, modifiers, .. } = event
                && (modifiers.command || modifiers.alt)
            {
                shortcut_keys.push(*key);
            }
        }
        shortcut_keys.retain(|key| input.key_down(*key));
        if input.modifiers.command || input.modifiers.alt {
            return Vec3::ZERO;
        }
        let is_down = |key| input.key_down(key) && !shortcut_keys.contains(&key);
        let axis =
            |forth: Key, back: Key| f32::from(u8::from(is_down(forth))) - f32::from(u8::from(is_down(back)));
        Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::S, Key::W))
    })
}

fn work(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let Some(shown) = studio.work_shown() else { return };
    ui.horizontal(|ui| {
        // A spinner would request continuous frames, which take time from the work.
        if let Some(part) = shown.part {
            ui.add(egui::ProgressBar::new(part).desired_width(120.0).show_percentage());
        }
        if ui.button("Cancel").clicked() {
            panel_commands.commands.push(Command::CancelWork);
        }
        ui.label(shown.text);
    });
}
