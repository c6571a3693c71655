//! The panel for the operator of a wall: the tracked head and hand, and the display of the model on the screens.

use egui::{
    Align2, Color32, ComboBox, DragValue, FontId, Grid, Painter, Pos2, Rect, RichText, Sense, Stroke, Ui,
    pos2, vec2,
};
use glam::{Vec2, Vec3};

use super::{
    calibrating::{Calibrating, LOST_SECS, age_secs},
    fields::{choice, switch},
    numbers::count,
    panel_commands::PanelCommands,
};
use crate::{
    command::Command,
    studio::Studio,
    tracker::{Received, Tracker},
};
use osp::math::rotate;
use osp_session::{
    platform::time::Instant,
    rig::{Rig, Stereo},
};

/// Size of the plan, points.
const PLAN: egui::Vec2 = vec2(112.0, 78.0);

const HEAD: Color32 = Color32::from_rgb(90, 200, 120);
const HAND: Color32 = Color32::from_rgb(80, 170, 240);
const LOST: Color32 = Color32::from_rgb(235, 90, 80);

pub(super) fn show(
    ui: &mut Ui,
    studio: &Studio,
    calibrating: &mut Option<Calibrating>,
    panel_commands: &mut PanelCommands,
) {
    ui.horizontal(|ui| {
        plan(ui, studio);
        if let Some(tracker) = studio.tracker() {
            ui.vertical(|ui| state(ui, studio, tracker));
            ui.separator();
        }
        if let Some(rig) = studio.room().rig() {
            ui.vertical(|ui| screens(ui, studio, rig, calibrating, panel_commands));
        }
    });
    let behind: Vec<&str> = studio.screens_behind().collect();
    if !behind.is_empty() {
        let text = format!(
            "The head is behind {} or too near to it: drawn as seen from 5 cm in front.",
            behind.join(", ")
        );
        ui.colored_label(LOST, text);
    }
}

fn state(ui: &mut Ui, studio: &Studio, tracker: &Tracker) {
    let (watch, counts) = (studio.watch(), tracker.counts());
    // Ages increase while no message arrives, so the next frame must come soon: first to show that a body is lost, then
    // to update its age.
    let ages = [watch.head(), watch.hand()].into_iter().flatten().map(|heard| age_secs(&heard));
    if let Some(least) = ages.reduce(f32::min) {
        let soon = if least < LOST_SECS { LOST_SECS * 0.5 } else { 1.0 };
        ui.ctx().request_repaint_after(std::time::Duration::from_secs_f32(soon));
    }
    let rates = watch.rates(Instant::now());
    // Columns have equal widths, so that changing numbers do not shift the layout.
    Grid::new("tracker").num_columns(4).min_col_width(62.0).spacing([6.0, 0.0]).show(ui, |ui| {
        for ((name, color, heard), rate) in
            [("head", HEAD, watch.head()), ("hand", HAND, watch.hand())].into_iter().zip(rates)
        {
            ui.colored_label(color, name);
            let Some(heard) = heard else {
                ui.weak("nothing yet");
                ui.end_row();
                continue;
            };
            ui.label(format!("{rate:.0} a second"));
            let secs = age_secs(&heard);
            match secs > LOST_SECS {
                true => ui.colored_label(LOST, format!("lost {} ago", duration(secs))),
                false => ui.label(format!("{} ago", duration(secs))),
            };
            let p = heard.in_room.0;
            ui.label(format!("{:.2} {:.2} {:.2} m", p.x, p.y, p.z));
            ui.end_row();
        }
        ui.weak("latency");
        let latency = watch.latency().map_or("–".to_owned(), |time| duration(time.as_secs_f32()));
        ui.label(latency).on_hover_text(
            "from the arrival of a pose to the submission of the picture that shows it (median), without the delays of the tracker and the display",
        );
        ui.end_row();
    });
    let not_read =
        [("malformed", counts.malformed), ("dropped", counts.dropped), ("refused", counts.refused)];
    let not_read = not_read.map(|(name, n)| format!("{name} {}", count(n))).join("   ");
    let from = tracker.local_address.map_or(String::new(), |address| format!("   udp://{address}"));
    ui.label(RichText::new(format!("messages {}   {not_read}{from}", count(counts.messages))).small());
    ui.label(RichText::new("no smoothing, no prediction: poses are shown as they come").weak().small());
    if counts.has_given_up {
        ui.colored_label(LOST, "one megabyte without a line end: reading has stopped");
    }
}

fn duration(secs: f32) -> String {
    match secs {
        secs if secs < 1.0 => format!("{:.0} ms", secs * 1000.0),
        secs if secs < 100.0 => format!("{secs:.1} s"),
        secs => format!("{secs:.0} s"),
    }
}

fn screens(
    ui: &mut Ui,
    studio: &Studio,
    rig: &Rig,
    calibrating: &mut Option<Calibrating>,
    panel_commands: &mut PanelCommands,
) {
    let room = studio.room();
    ui.horizontal(|ui| {
        // Windows for each eye can only be opened at the start.
        let ways = Stereo::ALL.iter().copied();
        let ways = ways.filter(|&way| way != Stereo::Windows || rig.stereo == Stereo::Windows);
        let list = ComboBox::from_id_salt("stereo");
        let chosen = choice(ui, list, room.stereo, ways, |way| way.name().to_owned());
        panel_commands.commands.extend(chosen.map(Command::Stereo));
        let mut apart_mm = rig.eye_separation_m * 1000.0;
        ui.label("eyes");
        let apart =
            DragValue::new(&mut apart_mm).range(0.0..=1000.0).speed(0.2).max_decimals(1).suffix(" mm");
        if ui.add(apart).changed() {
            panel_commands.commands.push(Command::EyeSeparation(apart_mm * 0.001));
        }
    });
    let swaps = switch(ui, room.swaps_eyes, "swap the eyes", "");
    panel_commands.commands.extend(swaps.map(Command::SwapEyes));
    let pattern = switch(ui, room.shows_pattern(), "test pattern", "");
    panel_commands.commands.extend(pattern.map(Command::TestPattern));
    let can_calibrate = studio.tracker().is_some() && calibrating.is_none();
    let button = ui.add_enabled(can_calibrate, egui::Button::new("Calibrate the tracker…"));
    if button.on_disabled_hover_text("there is no tracker: start osp with --tracker").clicked() {
        *calibrating = Some(Calibrating::default());
    }
}

/// Draws the room from above: screens, head and hand.
fn plan(ui: &mut Ui, studio: &Studio) {
    let (response, painter) = ui.allocate_painter(PLAN, Sense::hover());
    let rect = response.rect;
    response.on_hover_text("the room from above: screens, the head (green) and the hand (blue) as tracked");
    let weak = ui.visuals().weak_text_color();
    painter.rect_stroke(rect, 3.0, Stroke::new(1.0, weak.gamma_multiply(0.5)), egui::StrokeKind::Inside);
    let (head, hand) = (studio.watch().head(), studio.watch().hand());
    let mut corners = Vec::new();
    let rig = studio.room().rig();
    for screen in rig.iter().flat_map(|rig| &rig.screens) {
        let upper_right = screen.upper_left + screen.sides().0;
        corners.push([screen.lower_left, screen.lower_right, upper_right, screen.upper_left]);
    }
    let usual = rig.map(|rig| rig.head);
    let bodies = [head, hand].into_iter().flatten().map(|heard| heard.in_room.0);
    let all = corners.iter().flatten().copied().chain(usual).chain(bodies);
    let on_floor = |p: Vec3| Vec2::new(p.x, p.z);
    let (min, max) = all
        .map(on_floor)
        .fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(min, max), p| (min.min(p), max.max(p)));
    if !(min.is_finite() && max.is_finite()) {
        painter.text(rect.center(), Align2::CENTER_CENTER, "no pose yet", FontId::proportional(11.0), weak);
        return;
    }
    // The plan covers at least a metre, so that a single head does not fill it.
    let half_m = ((max - min) * 0.5).max(Vec2::splat(0.5));
    let scale = ((rect.width() - 20.0) * 0.5 / half_m.x).min((rect.height() - 20.0) * 0.5 / half_m.y);
    let middle = (min + max) * 0.5;
    let place = |p: Vec3| {
        let at = (on_floor(p) - middle) * scale;
        pos2(rect.center().x + at.x, rect.center().y + at.y)
    };
    for corners in &corners {
        for i in 0..4 {
            painter.line_segment([place(corners[i]), place(corners[(i + 1) % 4])], Stroke::new(1.5, weak));
        }
    }
    if let Some(hand) = hand {
        let (p, q) = hand.in_room;
        body(&painter, rect, place(p), rotate(q, Vec3::NEG_Z), false, shade(&hand, HAND));
    }
    match head {
        Some(head) => {
            let (p, q) = head.in_room;
            body(&painter, rect, place(p), rotate(q, Vec3::NEG_Z), true, shade(&head, HEAD));
        }
        None => {
            if let Some(p) = usual {
                painter.circle_stroke(place(p), 4.0, Stroke::new(1.0, weak));
            }
        }
    }
}

fn shade(heard: &Received, color: Color32) -> Color32 {
    if age_secs(heard) > LOST_SECS { LOST } else { color }
}

/// Draws a head (a disc with a nose) or a hand (a stick).
fn body(painter: &Painter, rect: Rect, at: Pos2, forward: Vec3, is_head: bool, color: Color32) {
    let at = rect.shrink(5.0).clamp(at);
    let towards = at + vec2(forward.x, forward.z) * 10.0;
    painter.line_segment([at, towards], Stroke::new(2.0, color));
    painter.circle_filled(at, if is_head { 4.5 } else { 2.5 }, color);
}
