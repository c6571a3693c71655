use egui::{Align2, Context, Frame, Id, Key, Modal, RichText, Ui, Vec2, Window};

use super::panel_commands::{ALARM, PanelCommands, PathPurpose};
use crate::{
    command::Command,
    question::{Answer, Question},
    studio::Studio,
};

/// Largest width of text, points; it is smaller in a narrow window.
const WIDEST: f32 = 420.0;
/// Margin at the window's sides, points.
const MARGIN: f32 = 48.0;

fn set_width(ui: &mut Ui) {
    let room = ui.ctx().content_rect().width() - MARGIN;
    ui.set_max_width(room.clamp(120.0, WIDEST));
}

/// Shows a question that the user must answer before any other action.
pub(super) fn question(ctx: &Context, question: &Question, is_new: bool, panel_commands: &mut PanelCommands) {
    let mut given = None;
    let shown = Modal::new(Id::unique("question")).show(ctx, |ui| {
        set_width(ui);
        ui.heading(question.title());
        ui.add_space(4.0);
        ui.label(question.text());
        ui.add_space(8.0);
        ui.horizontal_wrapped(|ui| {
            for &(answer, words) in question.answers() {
                let button = ui.button(words);
                if is_new && answer == question.first_answer() {
                    button.request_focus();
                }
                if button.clicked() {
                    given = Some(answer);
                }
            }
        });
    });
    if shown.is_top_modal && ctx.input(|input| input.key_pressed(Key::Escape)) {
        given.get_or_insert(Answer::Cancel);
    }
    if let Some(answer) = given {
        if answer == Answer::SaveAs {
            panel_commands.ask = Some(PathPurpose::SaveAs);
        }
        panel_commands.commands.push(Command::Answer(answer));
    }
}

/// Shows the warning that the session's file cannot be written, above the model, while the error lasts.
pub(super) fn trouble(ctx: &Context, studio: &Studio, panel_commands: &mut PanelCommands) {
    let journal = studio.session().journal();
    let Some(trouble) = journal.trouble() else { return };
    Window::new("trouble")
        .title_bar(false)
        .collapsible(false)
        .resizable(false)
        .frame(Frame::window(&ctx.global_style()))
        .anchor(Align2::CENTER_TOP, Vec2::new(0.0, 8.0))
        .show(ctx, |ui| {
            set_width(ui);
            let name = journal.path().file_name().unwrap_or_default().to_string_lossy();
            ui.label(RichText::new(format!("{name} is not saved: {trouble}")).color(ALARM).strong());
            match (journal.shelter(), journal.missing()) {
                (Some(shelter), _) => ui.label(format!("The whole session is in {}.", shelter.display())),
                (None, missing) => ui.label(format!(
                    "{missing} changes are only in memory; they are lost when this window closes."
                )),
            };
            ui.horizontal_wrapped(|ui| {
                if ui.button("Save elsewhere…").clicked() {
                    panel_commands.ask = Some(PathPurpose::SaveAs);
                }
                if ui.button("Try again").clicked() {
                    panel_commands.commands.push(Command::RetrySaving);
                }
                let path = journal.path().to_owned();
                if trouble.is_lost() && ui.button("Write the file again").clicked() {
                    panel_commands.commands.push(Command::SaveAs(path));
                }
            });
        });
}
