use egui::{Button, Color32, ComboBox, DragValue, RichText, Slider, Ui, Vec2};

use super::{
    actions::Action,
    brushes::BrushList,
    panel_commands::{ALARM, PanelCommands},
};
use crate::{
    command::Command,
    drawing_aids::Aids,
    pen::{Brush, Snap},
    session::{Access, Opening},
    studio::Studio,
    tool::{Span, ToolChoice},
};
use osp_session::recording::Tool;

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

/// Shows tools, colours, brush, undo, and the session's path. A replay has none of them.
pub(super) fn show(
    ui: &mut Ui,
    studio: &Studio,
    brushes: &mut BrushList,
    panel_commands: &mut PanelCommands,
) {
    if studio.session().is_replay() {
        return;
    }
    ui.add_space(4.0);
    tool_buttons(ui, studio, panel_commands);
    ui.separator();
    ui.add_enabled_ui(studio.can_draw(), |ui| {
        brushes.show(ui, studio, panel_commands);
        brush(ui, studio, panel_commands);
        ui.separator();
        ui.horizontal(|ui| {
            for (name, command) in [("Undo", Command::Undo), ("Redo", Command::Redo)] {
                if ui.add_enabled(studio.can(&command), Button::new(name)).clicked() {
                    panel_commands.commands.push(command);
                }
            }
        });
    });
    session(ui, studio, panel_commands);
}

fn tool_buttons(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let tools = [
        (ToolChoice::Draw(Tool::Ribbon), "Ribbon (1)", "drag to draw a ribbon"),
        (ToolChoice::Draw(Tool::Wall), "Wall (2)", "drag along the outline of a flat surface"),
        (ToolChoice::Draw(Tool::Tube), "Tube (3)", "drag to draw a round tube"),
        (ToolChoice::Erase, "Erase (4, X)", "touch a stroke to erase it"),
        (
            ToolChoice::Select,
            "Select (5, V)",
            "click strokes, then drag them, the ring or its knob; Delete erases them",
        ),
        (
            ToolChoice::Span(Span::Box),
            "Select in a box (R)",
            "drag from one corner on the model to the other",
        ),
        (
            ToolChoice::Span(Span::Sphere),
            "Select in a sphere (G)",
            "press on the model at the sphere's centre, then drag outwards",
        ),
        (ToolChoice::Span(Span::Distance), "Measure (M)", "drag from one point of the model to another"),
    ];
    for (tool, name, hint) in tools {
        let button =
            Button::selectable(studio.tool() == tool, name).min_size(Vec2::new(ui.available_width(), 24.0));
        let command = Command::Tool(tool);
        if ui.add_enabled(studio.can(&command), button).on_hover_text(hint).clicked() {
            panel_commands.commands.push(command);
        }
    }
    if let Some((from, to)) = studio.measured() {
        ui.label(format!("distance {:.4} m", from.distance(to)));
    }
}

fn brush(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
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
                panel_commands.commands.push(Command::Color([r, g, b, brush.color[3]]));
            }
        }
    });
    ui.horizontal(|ui| {
        let [r, g, b, a] = brush.color.map(|c| (c * 255.0).round() as u8);
        let mut color = Color32::from_rgba_unmultiplied(r, g, b, a);
        if ui.color_edit_button_srgba(&mut color).on_hover_text("any colour and opacity").changed() {
            let color = color.to_srgba_unmultiplied().map(|c| f32::from(c) / 255.0);
            panel_commands.commands.push(Command::Color(color));
        }
        ui.label("colour");
    });
    width(ui, studio, panel_commands);
    let label = ui.label("depth of strokes");
    let name = |snap| match snap {
        Snap::Start => "start on surfaces",
        Snap::Surface => "follow surfaces",
        Snap::Off => "free",
    };
    let list = ComboBox::from_id_salt("snap").selected_text(name(studio.snap())).width(140.0);
    let shown = list.show_ui(ui, |ui| {
        for snap in [Snap::Start, Snap::Surface, Snap::Off] {
            if ui.selectable_label(studio.snap() == snap, name(snap)).clicked() {
                panel_commands.commands.push(Command::Snap(snap));
            }
        }
    });
    shown.response.labelled_by(label.id);
}

fn width(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let aids = studio.aids();
    let mut is_on_screen = aids.width_px.is_some();
    let label = ui.horizontal(|ui| {
        let label = ui.label("width ([ and ])");
        let toggle = ui.toggle_value(&mut is_on_screen, "px");
        if toggle.on_hover_text("constant width on the screen at any distance (J)").clicked() {
            Action::ToggleScreenWidth.perform(studio, panel_commands);
        }
        label
    });
    // The slider's unit, metres.
    let (unit_m, suffix, most) = match aids.width_px {
        Some(width_px) => (studio.brush().width_m / width_px, " px", 500.0),
        None => (0.01, " cm", 200.0),
    };
    let mut width = studio.brush().width_m / unit_m;
    let slider = Slider::new(&mut width, 0.1..=most).logarithmic(true).suffix(suffix).max_decimals(1);
    ui.spacing_mut().slider_width = 84.0;
    if ui.add(slider).labelled_by(label.inner.id).changed() {
        let (narrowest, widest) = Brush::WIDTHS_M;
        panel_commands.commands.push(Command::Width((width * unit_m).clamp(narrowest, widest)));
    }
    ui.horizontal(|ui| {
        let toggles = [
            (
                aids.straight,
                "Straight",
                "straight lines; also while Shift is held (U)",
                Action::ToggleStraight,
            ),
            (
                aids.mirror_x.is_some(),
                "Mirror",
                "mirror strokes left and right (key Y)",
                Action::ToggleMirror,
            ),
        ];
        for (mut is_on, name, hint, action) in toggles {
            let toggle = ui.toggle_value(&mut is_on, name).on_hover_text(hint);
            if toggle.clicked() {
                action.perform(studio, panel_commands);
            }
        }
        if let Some(mut x) = aids.mirror_x {
            let at = DragValue::new(&mut x).speed(0.01).range(-1.0e4..=1.0e4).max_decimals(2).suffix(" m");
            if ui.add(at).on_hover_text("position of the mirror on the x axis").changed() {
                panel_commands.commands.push(Command::Aids(Aids { mirror_x: Some(x), ..aids }));
            }
        }
    });
}

/// Shows the path of the session, and whether it is completely saved.
fn session(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let session = studio.session();
    let journal = session.journal();
    let name = journal.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let whole = journal.path().display().to_string();
    ui.add_space(6.0);
    let line = |ui: &mut Ui, text: String| {
        ui.label(RichText::new(text).weak()).on_hover_text(&whole);
    };
    #[cfg(feature = "live")]
    if let Some(live) = session.live() {
        line(ui, format!("{}: {}", live.session(), live.shown()));
    }
    if journal.is_read_only() {
        line(ui, format!("read-only: {name}"));
        if ui.button("Draw on a copy").clicked() {
            let copy = Opening::with(Access::Copy);
            panel_commands.commands.push(Command::OpenAs(journal.path().to_owned(), copy));
        }
    } else if journal.trouble().is_some() {
        let text = match (journal.shelter(), journal.missing()) {
            (Some(_), _) => format!("not saved in {name}, but in another file"),
            (None, missing) => format!("{missing} changes are NOT saved"),
        };
        ui.label(RichText::new(text).color(ALARM).small());
    } else if session.event_count() == 0 || !(journal.is_changed() || journal.is_named()) {
        line(ui, "saves itself as you draw".to_owned());
    } else {
        line(ui, format!("saved: {name}"));
    }
}
