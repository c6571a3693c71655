use egui::{Button, Color32, ComboBox, RichText, Slider, Ui, Vec2};

use super::{brushes::BrushList, dialog::Ask, questions::ALARM, wishes::Wishes};
use crate::{
    app::{
        command::Command,
        document::{Access, Opening},
        pen::{Brush, Snap},
        studio::Studio,
        subject::Subject,
        tool::{Span, ToolChoice},
    },
    recording::Tool,
};

/// The colours that have buttons, sRGB.
const SWATCHES: [[u8; 3]; 12] = [
    [242, 158, 51],
    [230, 84, 64],
    [214, 72, 132],
    [142, 88, 200],
    [72, 104, 214],
    [64, 168, 214],
    [60, 178, 150],
    [110, 176, 70],
    [236, 208, 84],
    [240, 238, 230],
    [140, 140, 146],
    [44, 44, 50],
];

/// Tools, brush, and the buttons for the session's file.
pub(super) fn show(ui: &mut Ui, studio: &Studio, brushes: &mut BrushList, wishes: &mut Wishes) {
    let is_replay = matches!(studio.subject(), Subject::Replay(_));
    ui.add_space(4.0);
    ui.add_enabled_ui(studio.can_draw(), |ui| {
        tool_buttons(ui, studio, wishes);
        ui.separator();
        brushes.show(ui, studio, wishes);
        brush(ui, studio, wishes);
        ui.separator();
        let scene = studio.scene();
        ui.horizontal(|ui| {
            if ui.add_enabled(scene.can_undo(), Button::new("Undo")).clicked() {
                wishes.commands.push(Command::Undo);
            }
            if ui.add_enabled(scene.can_redo(), Button::new("Redo")).clicked() {
                wishes.commands.push(Command::Redo);
            }
        });
    });
    ui.separator();
    file_buttons(ui, studio, is_replay, wishes);
    ui.separator();
    if ui.button("Show whole model (H)").clicked() {
        wishes.commands.push(Command::ShowAll);
    }
    ui.horizontal(|ui| {
        ui.toggle_value(&mut wishes.panel, "Times (F2)");
        ui.toggle_value(&mut wishes.help, "Keys (F1)");
    });
    session(ui, studio, wishes);
}

fn tool_buttons(ui: &mut Ui, studio: &Studio, wishes: &mut Wishes) {
    let tools = [
        (ToolChoice::Draw(Tool::Ribbon), "Ribbon (1)", "drag to draw a band"),
        (ToolChoice::Draw(Tool::Wall), "Wall (2)", "drag along the outline of a flat surface"),
        (ToolChoice::Draw(Tool::Tube), "Tube (3)", "drag to draw a round tube"),
        (ToolChoice::Erase, "Erase (X)", "touch a stroke to erase it"),
        (ToolChoice::Select, "Select (V)", "click strokes, then drag them; Delete erases them"),
        (
            ToolChoice::Span(Span::Box),
            "Select in a box (R)",
            "drag from one corner on the model to the other",
        ),
        (
            ToolChoice::Span(Span::Sphere),
            "Select in a sphere (G)",
            "drag from its middle on the model outwards",
        ),
        (ToolChoice::Span(Span::Distance), "Measure (M)", "drag from one point of the model to another"),
    ];
    for (tool, name, hint) in tools {
        let button =
            Button::selectable(studio.tool() == tool, name).min_size(Vec2::new(ui.available_width(), 24.0));
        if ui.add(button).on_hover_text(hint).clicked() {
            wishes.commands.push(Command::Tool(tool));
        }
    }
    if let Some((from, to)) = studio.measured() {
        ui.label(format!("distance {:.4} m", from.distance(to)));
    }
}

fn brush(ui: &mut Ui, studio: &Studio, wishes: &mut Wishes) {
    let brush = studio.brush();
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = Vec2::splat(3.0);
        for [r, g, b] in SWATCHES {
            let color = Color32::from_rgb(r, g, b);
            let button = Button::new("").fill(color).min_size(Vec2::splat(20.0));
            let response = ui.add(button);
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Button, true, format!("colour {r} {g} {b}"))
            });
            if response.clicked() {
                let [r, g, b] = [r, g, b].map(|c| f32::from(c) / 255.0);
                wishes.commands.push(Command::Color([r, g, b, brush.color[3]]));
            }
        }
    });
    ui.horizontal(|ui| {
        let [r, g, b, a] = brush.color.map(|c| (c * 255.0).round() as u8);
        let mut color = Color32::from_rgba_unmultiplied(r, g, b, a);
        if ui.color_edit_button_srgba(&mut color).on_hover_text("any colour and opacity").changed() {
            let color = color.to_srgba_unmultiplied().map(|c| f32::from(c) / 255.0);
            wishes.commands.push(Command::Color(color));
        }
        ui.label("colour");
    });
    let mut width_cm = brush.width_m * 100.0;
    let slider = Slider::new(&mut width_cm, 0.1..=200.0).logarithmic(true).suffix(" cm").max_decimals(1);
    ui.spacing_mut().slider_width = 84.0;
    let label = ui.label("width ([ and ])");
    if ui.add(slider).labelled_by(label.id).changed() {
        let (narrowest, widest) = Brush::WIDTHS_M;
        wishes.commands.push(Command::Width((width_cm / 100.0).clamp(narrowest, widest)));
    }
    let snap_name = |snap| match snap {
        Snap::Start => "start on surfaces",
        Snap::Surface => "follow surfaces",
        Snap::Off => "free",
    };
    let label = ui.label("depth of strokes");
    let choice = ComboBox::from_id_salt("snap").selected_text(snap_name(studio.snap())).width(140.0);
    let shown = choice.show_ui(ui, |ui| {
        for snap in [Snap::Start, Snap::Surface, Snap::Off] {
            if ui.selectable_label(studio.snap() == snap, snap_name(snap)).clicked() {
                wishes.commands.push(Command::Snap(snap));
            }
        }
    });
    shown.response.labelled_by(label.id);
}

fn file_buttons(ui: &mut Ui, studio: &Studio, is_replay: bool, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        if ui.button("New").clicked() {
            wishes.commands.push(Command::New);
        }
        if ui.button("Open…").clicked() {
            wishes.ask = Some(Ask::Open);
        }
    });
    ui.horizontal(|ui| {
        if ui.add_enabled(!is_replay, Button::new("Save as…")).clicked() {
            wishes.ask = Some(Ask::SaveAs);
        }
        if ui.button("Export…").clicked() {
            wishes.ask = Some(Ask::Export);
        }
    });
    let is_changed = match studio.subject() {
        Subject::Sketch(document) => document.journal().is_changed(),
        Subject::Replay(_) => false,
    };
    let discard = ui.add_enabled(is_changed, Button::new("Discard…"));
    let hint = "throw away everything drawn since the session was opened or saved under a name";
    if discard.on_hover_text(hint).clicked() {
        wishes.commands.push(Command::Discard);
    }
}

/// Where the session is saved, and whether all of it is.
fn session(ui: &mut Ui, studio: &Studio, wishes: &mut Wishes) {
    let Subject::Sketch(document) = studio.subject() else { return };
    let journal = document.journal();
    let name = journal.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let whole = journal.path().display().to_string();
    ui.add_space(6.0);
    let line = |ui: &mut Ui, text: String| {
        ui.label(RichText::new(text).weak()).on_hover_text(&whole);
    };
    if journal.is_read_only() {
        line(ui, format!("read-only: {name}"));
        if ui.button("Draw on a copy").clicked() {
            let copy = Opening::with(Access::Copy);
            wishes.commands.push(Command::OpenAs(journal.path().to_owned(), copy));
        }
    } else if journal.trouble().is_some() {
        let text = match (journal.shelter(), journal.missing()) {
            (Some(_), _) => format!("not saved in {name}, but in another file"),
            (None, missing) => format!("{missing} events are NOT saved"),
        };
        ui.label(RichText::new(text).color(ALARM).small());
    } else if document.event_count() == 0 || !(journal.is_changed() || journal.is_named()) {
        line(ui, "saves itself as you draw".to_owned());
    } else {
        line(ui, format!("saved: {name}"));
    }
}
