//! The dialog that calibrates the tracker: the user touches three corners of a screen with the tracked hand.

use egui::{Align2, ComboBox, Context, Window};
use glam::Vec3;

use super::{fields::choice, panel_commands::PanelCommands};
use crate::{command::Command, studio::Studio, tracker::Received};
use osp_session::{
    platform::time::Instant,
    rig::{Calibration, RoomFromTracker, Screen},
};

/// Age from which a pose is shown as lost, seconds.
pub(super) const LOST_SECS: f32 = 0.5;
/// The corners, in the order in which they are touched.
const CORNERS: [&str; 3] = ["lower left", "lower right", "upper left"];
/// Largest error that counts as good, metres.
const GOOD_M: f32 = 0.01;

#[derive(Debug, Default)]
pub(super) struct Calibrating {
    screen: usize,
    /// The hand that touches the corners: the first hand with a pose.
    hand: Option<u8>,
    /// The touched points in tracker space.
    points: Vec<Vec3>,
}

impl Calibrating {
    /// Shows the dialog. Returns whether it stays open.
    pub(super) fn show(
        &mut self,
        ctx: &Context,
        studio: &Studio,
        panel_commands: &mut PanelCommands,
    ) -> bool {
        let Some(rig) = studio.room().rig() else { return false };
        let mut is_open = true;
        let pressed = |key| ctx.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key));
        let mut is_done = !egui::Popup::is_any_open(ctx) && pressed(egui::Key::Escape);
        let takes_by_key = pressed(egui::Key::Enter);
        self.hand = self.hand.or_else(|| studio.watch().hands().next());
        Window::new("Calibrate the tracker")
            .open(&mut is_open)
            .collapsible(false)
            .resizable(false)
            .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
            .show(ctx, |ui| {
                ui.label("Hold the hand's tracker at three corners of a screen, one after the other.");
                let (screens, name) =
                    (0..rig.screens.len(), |screen: usize| rig.screens[screen].name.clone());
                let chosen = choice(ui, ComboBox::from_label("screen"), self.screen, screens, name);
                if let Some(screen) = chosen.filter(|screen| *screen != self.screen) {
                    (self.screen, self.points) = (screen, Vec::new());
                }
                if let Some(hand) = self.hand.filter(|_| studio.watch().hands().nth(1).is_some())
                    && let Some(hand) =
                        choice(ui, ComboBox::from_label("hand"), hand, studio.watch().hands(), |hand| {
                            hand.to_string()
                        })
                {
                    (self.hand, self.points) = (Some(hand), Vec::new());
                }
                ui.add_space(4.0);
                let screen = &rig.screens[self.screen];
                for (i, name) in CORNERS.iter().enumerate() {
                    match self.points.get(i) {
                        Some(p) => ui.label(format!("{}. {name}: {:.3} {:.3} {:.3}", i + 1, p.x, p.y, p.z)),
                        None if i == self.points.len() => {
                            ui.strong(format!("{}. {name} corner: hold it there", i + 1))
                        }
                        None => ui.weak(format!("{}. {name} corner", i + 1)),
                    };
                }
                ui.add_space(4.0);
                let heard = self.hand.and_then(|hand| studio.watch().hand_of(hand));
                let heard = heard.filter(|heard| age_secs(heard) < LOST_SECS);
                ui.horizontal(|ui| {
                    let can_take = heard.is_some() && self.points.len() < CORNERS.len();
                    let take = ui.add_enabled(can_take, egui::Button::new("Take this point (Enter)"));
                    let take = take.on_disabled_hover_text(match heard {
                        Some(_) => "all three points are set",
                        None => "no pose of a hand was received in the last half second",
                    });
                    if let (true, true, Some(heard)) = (can_take, take.clicked() || takes_by_key, heard) {
                        self.points.push(heard.in_tracker.0);
                    }
                    if ui.add_enabled(!self.points.is_empty(), egui::Button::new("Begin again")).clicked() {
                        self.points.clear();
                    }
                });
                match self.found(screen) {
                    None => {}
                    Some(Err(expected)) => {
                        ui.colored_label(ui.visuals().error_fg_color, format!("expected {expected}"));
                    }
                    Some(Ok(found)) => is_done |= result(ui, &found, panel_commands),
                }
            });
        is_open && !is_done
    }

    /// The transform computed from the three points, once all are measured.
    fn found(&self, screen: &Screen) -> Option<Result<Calibration, &'static str>> {
        let points: [Vec3; 3] = self.points.as_slice().try_into().ok()?;
        let places = [screen.lower_left, screen.lower_right, screen.upper_left];
        Some(RoomFromTracker::from_points(points, places))
    }
}

/// Shows the result. Returns whether the user has accepted it.
fn result(ui: &mut egui::Ui, found: &Calibration, panel_commands: &mut PanelCommands) -> bool {
    let error = format!("The points fit the corners to {:.0} mm.", found.error_m * 1000.0);
    match found.error_m <= GOOD_M {
        true => ui.label(error),
        false => ui.colored_label(ui.visuals().warn_fg_color, error),
    };
    if (found.scale - 1.0).abs() > 0.05 {
        let text = format!(
            "Distances of the tracker are {:.2} times those of the room. Does the tracker send metres, and is this the right screen?",
            found.scale
        );
        ui.colored_label(ui.visuals().error_fg_color, text);
    }
    let RoomFromTracker { p, q } = found.room_from_tracker;
    let line = format!(
        "room_from_tracker: (p: ({}, {}, {}), q: ({}, {}, {}, {})),",
        p.x, p.y, p.z, q.x, q.y, q.z, q.w
    );
    ui.label("To keep it, put this line into the rig's file:");
    ui.code(&line);
    ui.horizontal(|ui| {
        if ui.button("Copy the line").clicked() {
            ui.ctx().copy_text(line);
        }
        let is_taken = ui.button("Use it now").clicked();
        if is_taken {
            panel_commands.commands.push(Command::Calibrate(found.room_from_tracker));
        }
        is_taken
    })
    .inner
}

pub(super) fn age_secs(heard: &Received) -> f32 {
    Instant::now().saturating_duration_since(heard.at).as_secs_f32()
}
