//! Fields that several panels have: choices, switches, numbers, names.

use egui::{ComboBox, DragValue, Response, TextEdit, Ui, WidgetText};

use osp_session::recording::Event;

/// Shows a list of choices. Returns the user's choice.
pub(super) fn choice<T: Copy + PartialEq>(
    ui: &mut Ui,
    list: ComboBox<'_>,
    now: T,
    all: impl IntoIterator<Item = T>,
    name: impl Fn(T) -> String,
) -> Option<T> {
    let mut chosen = None;
    list.selected_text(name(now)).show_ui(ui, |ui| {
        for one in all {
            if ui.selectable_label(one == now, name(one)).clicked() {
                chosen = Some(one);
            }
        }
    });
    chosen
}

/// Shows a check box. Returns its new state after a click.
pub(super) fn switch(ui: &mut Ui, is_on: bool, text: impl Into<WidgetText>, hint: &str) -> Option<bool> {
    let mut is_now_on = is_on;
    let mut response = ui.checkbox(&mut is_now_on, text.into());
    if !hint.is_empty() {
        response = response.on_hover_text(hint);
    }
    response.changed().then_some(is_now_on)
}

/// Shows a number with its label before it.
pub(super) fn number(ui: &mut Ui, label: &str, value: DragValue<'_>) -> Response {
    let label = ui.label(label);
    ui.add(value).labelled_by(label.id)
}

/// An angle, degrees.
pub(super) fn degrees(value: &mut f32) -> DragValue<'_> {
    DragValue::new(value).speed(1.0).range(-360.0..=360.0).suffix("°")
}

/// A scale factor, percent.
pub(super) fn percent(value: &mut f32) -> DragValue<'_> {
    DragValue::new(value).speed(1.0).range(1.0..=1.0e4).suffix(" %")
}

/// A field for the name of a group or a layer, with the name that is being typed.
#[derive(Debug)]
pub(super) struct NameField<T>(Option<(T, String)>);

impl<T> Default for NameField<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T: PartialEq> NameField<T> {
    /// Shows the name of `of`. Returns the field, and the new name once the user has typed it.
    pub(super) fn show(&mut self, ui: &mut Ui, of: T, known: &str) -> (Response, Option<String>) {
        let mut name = match self.0.take() {
            Some((typed_for, name)) if typed_for == of => name,
            _ => known.to_owned(),
        };
        let edit = TextEdit::singleline(&mut name).char_limit(Event::MAX_GROUP_NAME_BYTES / 4);
        let response = ui.add(edit.desired_width(140.0));
        if response.lost_focus() && name != known {
            return (response, Some(name));
        }
        if response.has_focus() {
            self.0 = Some((of, name));
        }
        (response, None)
    }
}
