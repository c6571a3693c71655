use std::fmt;

use egui::{
    Atom, Button, Color32, Image, Key, Modifiers, Popup, PopupCloseBehavior, Rect, RichText, Role,
    ScrollArea, SetOpenCommand, Shape, Stroke, StrokeKind, TextEdit, TextWrapMode, TextureHandle, Ui, Vec2,
    WidgetInfo, style::ScrollStyle, vec2,
};

use super::panel_commands::PanelCommands;
use crate::{command::Command, studio::Studio};
use osp_session::brush::{self, Brush, Draw, Family};

/// Size of a picture in the list, points.
const SHOWN: Vec2 = vec2(80.0, 24.0);
const LIST_WIDTH: f32 = 230.0;

/// A heading of the list, and the predicate for the brushes under it.
type Kind = (&'static str, fn(&Brush) -> bool);

const KINDS: [Kind; 4] = [
    ("Paint", |brush| is_ribbon(brush) && !is_light(brush)),
    ("Solids", |brush| !is_ribbon(brush) && !is_light(brush) && !is_spray(brush)),
    ("Light", |brush| is_light(brush) && !is_spray(brush)),
    ("Particles and sprays", |brush| is_spray(brush)),
];

fn is_light(brush: &Brush) -> bool {
    brush.draw == Draw::Additive
}

fn is_ribbon(brush: &Brush) -> bool {
    matches!(brush.family, Family::QuadStrip(_) | Family::Welded { .. } | Family::ThickRibbon)
}

fn is_spray(brush: &Brush) -> bool {
    matches!(brush.family, Family::Particles | Family::Spray { .. })
}

/// The layout of the brushes' pictures in one texture.
#[derive(Clone, Copy, Debug, Default)]
pub struct PreviewGrid(());

impl PreviewGrid {
    const COLUMNS: usize = 4;
    /// Size of a cell, pixels: twice the displayed size, for high-resolution screens.
    const CELL_PX: (usize, usize) = (160, 48);

    /// The brushes, row by row.
    pub fn brushes(&self) -> impl Iterator<Item = &'static Brush> + use<> {
        brush::all().iter().filter(|brush| brush.is_offered)
    }

    /// Number of cells in a row.
    pub fn columns(&self) -> usize {
        Self::COLUMNS
    }

    pub fn rows(&self) -> usize {
        self.brushes().count().div_ceil(Self::COLUMNS)
    }

    /// Width and height of a cell, pixels.
    pub fn cell_px(&self) -> (usize, usize) {
        Self::CELL_PX
    }

    /// Width and height of the texture, pixels.
    pub fn size_px(&self) -> (u32, u32) {
        ((self.columns() * Self::CELL_PX.0) as u32, (self.rows() * Self::CELL_PX.1) as u32)
    }

    /// The part of the texture with the picture of the brush at this index.
    fn part(&self, place: usize) -> Rect {
        let size = vec2(1.0 / self.columns() as f32, 1.0 / self.rows() as f32);
        let cell = vec2((place % self.columns()) as f32, (place / self.columns()) as f32);
        Rect::from_min_size((cell * size).to_pos2(), size)
    }
}

#[derive(Default)]
pub(super) struct BrushList {
    /// Whether the list has ever been opened.
    was_opened: bool,
    /// Whether the pictures are drawn, or have failed.
    are_previews_done: bool,
    previews: Option<TextureHandle>,
    is_open: bool,
    /// The filter text: the list shows brushes whose names contain it.
    typed: String,
    /// Index of the row that Return selects.
    at: usize,
}

impl fmt::Debug for BrushList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let has_previews = self.previews.is_some();
        f.debug_struct("BrushList").field("has_previews", &has_previews).finish_non_exhaustive()
    }
}

impl BrushList {
    pub(super) fn wants_previews(&self) -> bool {
        self.was_opened && !self.are_previews_done
    }

    pub(super) fn set_previews(&mut self, previews: Option<TextureHandle>) {
        (self.are_previews_done, self.previews) = (true, previews);
    }

    /// Shows the button and the list for the brush of ribbons.
    pub(super) fn show(&mut self, ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
        let chosen = studio.brush().paint();
        let name = chosen.map_or("plain", |brush| brush.name.as_str());
        let label = ui.label("brush (B)");
        let button = Button::new((
            RichText::new(name),
            Atom::grow(),
            Atom::paint(Vec2::splat(9.0), |ui, args| triangle(ui, args.rect)),
        ));
        let response = ui.add(button.min_size(vec2(ui.available_width(), 0.0)).truncate());
        response.widget_info(|| {
            let mut info = WidgetInfo::new(Role::ComboBox);
            (info.enabled, info.current_text_value) = (ui.is_enabled(), Some(name.to_owned()));
            info
        });
        let response = response.labelled_by(label.id);
        let toggle = panel_commands.brushes && ui.is_enabled();
        // A click into the filter text leaves the list open.
        let popup = Popup::from_toggle_button_response(&response)
            .close_behavior(PopupCloseBehavior::CloseOnClickOutside);
        let popup = match toggle {
            true => popup.open_memory(SetOpenCommand::Toggle),
            false => popup,
        };
        let room = ui.ctx().content_rect().height() - 40.0;
        let shown = popup.width(LIST_WIDTH).show(|ui| {
            let is_new = !self.is_open;
            let is_moved = self.take_keys(ui, chosen, is_new);
            ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
            ui.spacing_mut().scroll = ScrollStyle::solid();
            let list = ScrollArea::vertical().max_height((room - 30.0).min(560.0)).auto_shrink([false, true]);
            let choice = list.show(ui, |ui| self.rows(ui, studio, is_moved || is_new)).inner;
            if let Some(choice) = choice {
                panel_commands.commands.push(Command::Paint(choice));
                ui.close();
            }
        });
        self.is_open = shown.is_some();
        self.was_opened |= self.is_open;
    }

    /// Shows the filter text, and handles the keys that move in the list. Returns whether the filter or the row may
    /// have changed.
    fn take_keys(&mut self, ui: &mut Ui, chosen: Option<&'static Brush>, is_new: bool) -> bool {
        if is_new {
            self.typed.clear();
            self.at = self.entries().position(|(_, _, brush)| same(brush, chosen)).unwrap_or(0);
        }
        let (down, up) = ui.input_mut(|input| {
            let mut times = |key| input.count_and_consume_key(Modifiers::NONE, key);
            (times(Key::ArrowDown), times(Key::ArrowUp))
        });
        let line =
            TextEdit::singleline(&mut self.typed).hint_text("name of a brush").desired_width(f32::INFINITY);
        let response = ui.add(line);
        response.request_focus();
        if response.changed() {
            // The name itself comes before longer names that contain it.
            let wanted = self.typed.trim().to_lowercase();
            let place = |fits: &dyn Fn(&str) -> bool| {
                self.entries().position(|(_, _, brush)| fits(&name_of(brush).to_lowercase()))
            };
            self.at = place(&|name| name == wanted).or(place(&|name| name.starts_with(&wanted))).unwrap_or(0);
        }
        let last = self.entries().count().saturating_sub(1);
        self.at = (self.at + down).saturating_sub(up).min(last);
        down + up > 0 || response.changed()
    }

    /// The rows of the list: index of the heading, index in the grid, and brush. The first row has no brush.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, Option<&'static Brush>)> + use<> {
        let wanted = self.typed.trim().to_lowercase();
        let kinds = KINDS.iter().enumerate();
        let brushes = kinds.flat_map(|(kind, (_, is_of))| {
            let of_kind = PreviewGrid::default().brushes().enumerate().filter(|(_, brush)| is_of(brush));
            of_kind.map(move |(place, brush)| (kind, place, Some(brush)))
        });
        let all = std::iter::once((0, 0, None)).chain(brushes);
        all.filter(move |(_, _, brush)| name_of(*brush).to_lowercase().contains(&wanted))
    }

    /// Shows the rows. Returns the chosen brush. If `shows_row`, scrolls to the row that Return selects.
    fn rows(&self, ui: &mut Ui, studio: &Studio, shows_row: bool) -> Option<Option<&'static Brush>> {
        let chosen = studio.brush().paint();
        let tint = shining(studio.brush().color);
        let returns = ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Enter));
        let (mut choice, mut heading) = (None, None);
        let grid = PreviewGrid::default();
        for (row, (kind, place, brush)) in self.entries().enumerate() {
            if brush.is_some() && heading != Some(kind) {
                heading = Some(kind);
                ui.separator();
                ui.weak(KINDS[kind].0);
            }
            let name = name_of(brush);
            let is_chosen = same(brush, chosen);
            let button = match &self.previews {
                Some(texture) if brush.is_some() => {
                    let picture = Image::from_texture((texture.id(), SHOWN));
                    let picture = picture.uv(grid.part(place)).fit_to_exact_size(SHOWN).tint(tint);
                    Button::selectable(is_chosen, (picture, name))
                }
                _ => Button::selectable(is_chosen, name),
            };
            let response = ui.add(button.min_size(vec2(ui.available_width(), 0.0)));
            if row == self.at {
                let stroke = ui.visuals().selection.stroke;
                ui.painter().rect_stroke(response.rect, 2.0, stroke, StrokeKind::Inside);
                if shows_row {
                    response.scroll_to_me(None);
                }
            }
            if response.clicked() || (returns && row == self.at) {
                choice = Some(brush);
            }
        }
        if self.entries().next().is_none() {
            ui.weak("no brush of this name");
        }
        choice
    }
}

fn name_of(brush: Option<&Brush>) -> &str {
    brush.map_or("plain", |brush| brush.name.as_str())
}

fn same(a: Option<&Brush>, b: Option<&Brush>) -> bool {
    a.map(std::ptr::from_ref) == b.map(std::ptr::from_ref)
}

/// The triangle at the right end of a button that opens a list.
fn triangle(ui: &Ui, rect: Rect) {
    let corners =
        vec![rect.left_top() + vec2(0.0, 1.0), rect.right_top() + vec2(0.0, 1.0), rect.center_bottom()];
    let color = ui.visuals().widgets.inactive.fg_stroke.color;
    ui.painter().add(Shape::convex_polygon(corners, color, Stroke::NONE));
}

/// The colour at full brightness, because a picture in a dark colour would be invisible.
fn shining([r, g, b, _]: [f32; 4]) -> Color32 {
    let most = r.max(g).max(b);
    if most <= 0.0 {
        return Color32::WHITE;
    }
    let [r, g, b] = [r, g, b].map(|c| (c / most * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
