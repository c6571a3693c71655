use egui::{
    Align2, Color32, Frame, Grid, KeyboardShortcut, Panel, Rect, RichText, ScrollArea, Sense, Ui, Window,
};
use glam::Vec3;

use super::{
    brushes::BrushList,
    canvas,
    dialog::{Answer, Ask, PathDialog},
    groups::GroupList,
    keys::{Action, HINTS, SHORTCUTS},
    numbers, questions, replay_bar, tools,
    wishes::Wishes,
};
use crate::{
    app::{
        command::Command,
        layers::LayerChoice,
        question::Question,
        stats::{FrameTimes, History},
        studio::Studio,
        subject::Subject,
    },
    rivals::IndexKind,
};

/// Everything on the window beside the model.
#[derive(Debug, Default)]
pub struct Interface {
    history: History,
    hides_panel: bool,
    shows_help: bool,
    dialog: Option<PathDialog>,
    adapter: String,
    /// The question that was on the window in the last frame.
    asked: Option<Question>,
    /// Whether something was drawn: then the first hint is not shown any more.
    has_drawn: bool,
    brushes: BrushList,
    groups: GroupList,
}

impl Interface {
    /// The interface of a window that is drawn by the adapter of this name.
    pub fn new(adapter: String) -> Self {
        Self { adapter, ..Self::default() }
    }

    /// Adds the times of a frame.
    pub fn note_frame(&mut self, times: FrameTimes) {
        self.history.push(times);
    }

    /// The times of the last frames.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Whether the list of brushes is open and has no pictures yet: once, and not before somebody looks.
    pub fn wants_previews(&self) -> bool {
        self.brushes.wants_previews()
    }

    /// Takes the pictures of the brushes, laid out as [`PreviewGrid`](super::PreviewGrid) says; without them the list shows
    /// names alone.
    pub fn set_previews(&mut self, previews: Option<egui::TextureHandle>) {
        self.brushes.set_previews(previews);
    }

    /// Whether the window has just opened: the first frames settle the layout.
    pub fn is_fresh(&self) -> bool {
        self.history.frames().len() < 3
    }

    /// Lays everything out, does what was asked for, and returns the part of the window that is the model's, in points.
    pub fn show(&mut self, ui: &mut Ui, studio: &mut Studio) -> Rect {
        let mut wishes = Wishes { panel: !self.hides_panel, help: self.shows_help, ..Wishes::default() };
        self.shortcuts(ui, studio, &mut wishes);
        Panel::left("tools").resizable(false).exact_size(168.0).show(ui, |ui| {
            ScrollArea::vertical().show(ui, |ui| {
                tools::show(ui, studio, &mut self.brushes, &mut wishes);
                ui.separator();
                self.groups.show(ui, studio, &mut wishes);
            });
        });
        if wishes.panel {
            Panel::right("numbers").resizable(false).exact_size(268.0).show(ui, |ui| {
                ScrollArea::vertical()
                    .show(ui, |ui| numbers::show(ui, studio, &self.history, &self.adapter, &mut wishes));
            });
        }
        Panel::bottom("status").resizable(false).show(ui, |ui| {
            if let Subject::Replay(player) = studio.subject() {
                replay_bar::show(ui, player, studio.follows_replay_camera(), &mut wishes);
            }
            status(ui, studio);
        });
        let area = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(area, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsObject, true, "model"));
        canvas::take_pointer(ui, &response, ui.ctx().pixels_per_point(), studio);
        self.hint(ui, area, studio);
        if wishes.help {
            help(ui, &mut wishes.help);
        }
        if studio.question().is_none() {
            questions::trouble(ui.ctx(), studio, &mut wishes);
        }
        self.question(ui.ctx(), studio, &mut wishes);
        self.take_wishes(ui, studio, wishes);
        area
    }

    fn question(&mut self, ctx: &egui::Context, studio: &Studio, wishes: &mut Wishes) {
        let asked = studio.question();
        let is_new = self.asked.as_ref() != asked;
        if is_new {
            self.asked = asked.cloned();
        }
        if let Some(question) = asked {
            questions::question(ctx, question, is_new, wishes);
        }
    }

    fn take_wishes(&mut self, ui: &Ui, studio: &mut Studio, wishes: Wishes) {
        (self.hides_panel, self.shows_help) = (!wishes.panel, wishes.help);
        if let Some(ask) = wishes.ask {
            self.dialog = Some(PathDialog::new(ask));
        }
        let answer = self.dialog.as_mut().map(|dialog| dialog.show(ui.ctx()));
        match answer {
            None | Some(Answer::StillOpen) => {}
            Some(Answer::Closed) => self.dialog = None,
            Some(Answer::Chosen(command)) => {
                self.dialog = None;
                studio.command(command);
            }
        }
        if let Some(follow) = wishes.follow_camera {
            studio.follow_replay_camera(follow);
        }
        for command in wishes.commands {
            studio.command(command);
        }
    }

    fn shortcuts(&mut self, ui: &Ui, studio: &mut Studio, wishes: &mut Wishes) {
        if ui.ctx().egui_wants_keyboard_input() || self.dialog.is_some() || studio.question().is_some() {
            studio.set_flight(Vec3::ZERO);
            return;
        }
        for shortcut in SHORTCUTS {
            // Escape closes what is on top: an open list by itself, then the help.
            let is_escape = shortcut.keys.logical_key == egui::Key::Escape;
            if is_escape && egui::Popup::is_any_open(ui.ctx()) {
                continue;
            }
            if !ui.input_mut(|input| input.consume_shortcut(&shortcut.keys)) {
                continue;
            }
            if is_escape && wishes.help {
                wishes.help = false;
                continue;
            }
            match shortcut.action {
                Action::Do(command) => wishes.commands.push(command()),
                Action::ToggleFreeze => wishes.commands.push(Command::Freeze(!studio.is_frozen())),
                Action::NextIndex => {
                    let next = next_of(IndexKind::ALL, studio.culling().kind());
                    wishes.commands.push(Command::Index(next));
                }
                Action::NextOcclusion => {
                    let next = next_of(&numbers::sound_occlusion(), studio.culling().occlusion());
                    wishes.commands.push(Command::Occlusion(next));
                }
                Action::AskOpen => wishes.ask = Some(Ask::Open),
                Action::AskSaveAs => wishes.ask = Some(Ask::SaveAs),
                Action::AskExport => wishes.ask = Some(Ask::Export),
                Action::TogglePlay => {
                    if let Subject::Replay(player) = studio.subject() {
                        wishes.commands.push(Command::Play(!player.is_playing()));
                    }
                }
                Action::TogglePyramid => {
                    let layers = studio.layers();
                    wishes.commands.push(Command::Layers(LayerChoice { pyramid: !layers.pyramid, ..layers }));
                }
                Action::ToggleBrushes => wishes.brushes = true,
                Action::TogglePanel => wishes.panel = !wishes.panel,
                Action::ToggleHelp => wishes.help = !wishes.help,
            }
        }
        studio.set_flight(flight(ui));
    }

    /// The hint in an empty session.
    fn hint(&mut self, ui: &Ui, area: Rect, studio: &Studio) {
        self.has_drawn |= studio.scene().polygon_count() > 0;
        if self.has_drawn || !studio.can_draw() {
            return;
        }
        let at = area.center() - egui::vec2(0.0, area.height() * 0.22);
        let painter = ui.painter_at(area);
        let font = egui::FontId::proportional(22.0);
        painter.text(at, Align2::CENTER_CENTER, "Drag to draw", font, Color32::from_white_alpha(170));
        let rest = "right button: orbit    wheel: nearer, farther    F1: all keys";
        let font = egui::FontId::proportional(14.0);
        let below = at + egui::vec2(0.0, 26.0);
        painter.text(below, Align2::CENTER_CENTER, rest, font, Color32::from_white_alpha(120));
    }
}

/// The entry after `now`; after the last one, the first.
fn next_of<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let next = all.iter().position(|&one| one == now).map_or(0, |at| at + 1);
    all.get(next).or(all.first()).copied().unwrap_or(now)
}

/// The direction in which the held keys fly: right, up, back.
fn flight(ui: &Ui) -> Vec3 {
    use egui::Key;
    ui.input(|input| {
        if input.modifiers.command || input.modifiers.alt {
            return Vec3::ZERO;
        }
        let axis = |forth: Key, back: Key| {
            f32::from(u8::from(input.key_down(forth))) - f32::from(u8::from(input.key_down(back)))
        };
        Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::S, Key::W))
    })
}

fn status(ui: &mut Ui, studio: &Studio) {
    ui.horizontal(|ui| match studio.messages().last() {
        Some(message) => {
            let earlier = studio.messages().join("\n");
            ui.label(message).on_hover_text(earlier);
        }
        None => {
            let hint = match studio.subject() {
                Subject::Sketch(_) => {
                    "left button: draw    right button: orbit    wheel: nearer    W A S D Q E: fly    Ctrl+Z: undo    F1: all keys"
                }
                Subject::Replay(_) => {
                    "Space: play    right button: orbit    wheel: nearer    W A S D Q E: fly    C: freeze culling    F1: all keys"
                }
            };
            ui.label(RichText::new(hint).weak());
        }
    });
}

fn help(ui: &Ui, is_open: &mut bool) {
    Window::new("Keys and pointer")
        .open(is_open)
        .collapsible(false)
        .resizable(false)
        .frame(Frame::window(ui.style()))
        .anchor(Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            // On a small window one list stands below the other, and they are scrolled.
            let room = ui.ctx().content_rect().size() - egui::vec2(40.0, 60.0);
            let is_wide = room.x > HELP_WIDTH;
            ui.set_min_width(room.x.min(if is_wide { HELP_WIDTH } else { HELP_WIDTH * 0.6 }));
            ui.spacing_mut().scroll = egui::style::ScrollStyle::solid();
            ScrollArea::vertical().max_height(room.y).show(ui, |ui| match is_wide {
                true => ui.columns(2, |columns| {
                    pointer_hints(&mut columns[0]);
                    keys_of_shortcuts(&mut columns[1]);
                }),
                false => {
                    pointer_hints(ui);
                    ui.separator();
                    keys_of_shortcuts(ui);
                }
            });
        });
}

/// Both lists of the help side by side, points.
const HELP_WIDTH: f32 = 700.0;

fn pointer_hints(ui: &mut Ui) {
    Grid::new("pointer").num_columns(2).show(ui, |ui| {
        for (how, what) in HINTS {
            ui.strong(*how);
            ui.label(*what);
            ui.end_row();
        }
    });
}

fn keys_of_shortcuts(ui: &mut Ui) {
    Grid::new("keys").num_columns(2).show(ui, |ui| {
        for shortcut in SHORTCUTS {
            let KeyboardShortcut { modifiers, logical_key } = shortcut.keys;
            let is_plain = modifiers.is_none();
            ui.strong(match is_plain {
                true => logical_key.symbol_or_name().to_owned(),
                false => ui.ctx().format_shortcut(&shortcut.keys),
            });
            ui.label(shortcut.what);
            ui.end_row();
        }
    });
}
