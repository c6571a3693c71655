use std::path::Path;

use crate::{
    command::Command,
    question::Then,
    session::{Jump, Opening, Replay},
    studio::Studio,
    tool::{Span, ToolChoice},
    working::ExportKind,
};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Author, Event, Tool},
    scene::Stroke,
};

impl Studio {
    /// The author of this window's strokes.
    pub(crate) fn author(&self) -> Author {
        #[cfg(feature = "live")]
        if let Some(live) = self.session.live() {
            return live.status().author.unwrap_or(Author::SOLE);
        }
        Author::SOLE
    }

    /// Whether a command would have an effect now. The window disables the buttons and menu entries of all other
    /// commands.
    pub fn can(&self, command: &Command) -> bool {
        let scene = self.session.scene();
        match command {
            // Undo of a new copy begins with the user's own edits, not with the last stroke of the original.
            Command::Undo => {
                self.can_draw() && self.session.has_own_edits() && scene.can_undo_of(self.author())
            }
            Command::Redo => self.can_draw() && scene.can_redo_of(self.author()),
            // Measuring does not change the session.
            Command::Tool(ToolChoice::Span(Span::Distance)) => true,
            Command::Tool(_)
            | Command::Widen(_)
            | Command::Width(_)
            | Command::Paint(_)
            | Command::Color(_)
            | Command::Snap(_)
            | Command::Aids(_)
            | Command::NameGroup(..)
            | Command::PlaceGroup(..) => self.can_draw(),
            Command::EraseSelected
            | Command::GroupSelected
            | Command::Alter(_)
            | Command::Copy
            | Command::Cut
            | Command::Duplicate => self.can_draw() && !self.input.selection.is_empty(),
            Command::Paste => self.can_draw() && self.has_clip(),
            Command::Layer(edit) => self.can_edit_layers(edit),
            Command::KeepView(_) => self.can_draw(),
            Command::GoToView(slot) => scene.views().contains_key(slot),
            Command::SelectAll => self.can_draw() && scene.counts().visible > 0,
            Command::CancelWork => self.is_working(),
            Command::CancelGesture => self.is_dragging(),
            Command::SelectNone => !self.input.selection.is_empty(),
            Command::Save | Command::SaveAs(_) => !self.session.is_replay(),
            Command::SwapEyes(_)
            | Command::EyeSeparation(_)
            | Command::TestPattern(_)
            | Command::Calibrate(_) => self.room.rig().is_some(),
            Command::Play(_)
            | Command::Seek(_)
            | Command::Step(_)
            | Command::Speed(_)
            | Command::ShowFinished => self.session.is_replay(),
            _ => true,
        }
    }

    /// Executes a command. If it fails, [`Studio::messages`] gets a message.
    pub fn command(&mut self, command: Command) {
        let goes_on = matches!(command, Command::CancelWork | Command::Quit | Command::Answer(_));
        if self.is_reading() && !goes_on {
            return;
        }
        let t = self.now_secs();
        match command {
            Command::Undo => {
                self.finish_gestures();
                self.events.push(Event::Undo { author: Author::SOLE, t });
                self.apply_events();
                self.follow_selection(true);
            }
            Command::Redo => {
                self.finish_gestures();
                self.events.push(Event::Redo { author: Author::SOLE, t });
                self.apply_events();
                self.follow_selection(false);
            }
            Command::Tool(tool) => {
                self.finish_gestures();
                self.set_tool(tool);
            }
            Command::Widen(steps) => {
                self.input.brush.widen(steps);
                self.take_width();
            }
            Command::Aids(aids) => self.set_aids(aids),
            Command::Width(width_m) if width_m.is_finite() => {
                let (narrowest, widest) = crate::pen::Brush::WIDTHS_M;
                self.input.brush.width_m = width_m.clamp(narrowest, widest);
                self.take_width();
            }
            Command::Width(_) => {}
            Command::Paint(paint) => {
                self.finish_gestures();
                self.set_tool(ToolChoice::Draw(Tool::Ribbon));
                self.input.brush.paint = paint;
            }
            Command::Color(color) => self.input.brush.color = color.map(|c| c.clamp(0.0, 1.0)),
            Command::Snap(snap) => self.input.snap = snap,
            Command::EraseSelected => self.erase_selected(),
            Command::Alter(altering) => self.alter_selection(altering),
            Command::Layer(edit) => self.edit_layers(edit),
            Command::Copy => {
                self.copy_selection();
            }
            Command::Cut => {
                if self.copy_selection() {
                    self.erase_selected();
                }
            }
            Command::Paste => self.paste(),
            Command::Duplicate => self.duplicate(),
            Command::SelectAll => {
                let all = self.session.scene().strokes().iter();
                self.input.selection.set(all.filter_map(Stroke::id));
                self.deselect_locked();
            }
            Command::CancelWork => self.cancel_work(),
            Command::SelectNone => self.input.selection.clear(),
            Command::GroupSelected => {
                self.finish_gestures();
                self.group_selection();
            }
            Command::SelectGroup(group) => self.select_group(group),
            Command::NameGroup(group, name) => self.name_group(group, &name),
            Command::PlaceGroup(group, placing) => {
                self.finish_gestures();
                self.place_group(group, &placing);
            }
            Command::KeepView(slot) => {
                let (p, q) = (self.navigator.eye(), self.navigator.world_from_view());
                let distance = self.navigator.distance_m();
                self.events.push(Event::View { author: Author::SOLE, t, slot, p, q, distance });
                self.show_message(format!("view {} is saved", slot + 1));
            }
            Command::GoToView(slot) => {
                if let Some(view) = self.session.scene().views().get(&slot).copied() {
                    self.leave_replay_camera();
                    self.navigator.go_to_from(view.eye, view.world_from_view, view.distance_m);
                }
            }
            Command::ShowAll => {
                self.leave_replay_camera();
                self.show_main();
            }
            Command::ShowAsPainted => {
                self.leave_replay_camera();
                self.see_as_painted();
            }
            Command::ShowFinished => self.show_finished(),
            Command::CancelGesture => self.cancel_gesture(),
            Command::LookAtPointer => self.look_at_pointer(self.last_aspect),
            Command::Freeze(freeze) => {
                self.frozen = freeze.then(|| self.views().iter().map(|view| view.view).collect());
            }
            Command::Index(kind) => {
                self.switch_index(kind, self.culling.plan.occlusion);
                self.report_reindexing();
            }
            Command::Occlusion(choice) => self.switch_index(self.culling.plan.kind, choice),
            Command::Occluders(most) => self.culling.set_occluders(most),
            Command::FrustumCulling(culls) => self.culling.culls_by_frustum = culls,
            Command::Moment(moment_s) => self.moment_s = moment_s,
            Command::Layers(layers) => self.layers = layers,
            Command::Stereo(stereo) => self.room.stereo = stereo,
            Command::SwapEyes(swaps) => self.room.swaps_eyes = swaps,
            Command::EyeSeparation(separation_m) => self.room.set_eye_separation_m(separation_m),
            Command::TestPattern(shows) => self.room.show_pattern(shows),
            Command::Calibrate(room_from_tracker) => self.room.calibrate(room_from_tracker),
            Command::New => self.leave(Then::New),
            Command::Open(path) => self.leave(Then::Open(path, Opening::default())),
            Command::OpenAs(path, how) => self.leave(Then::Open(path, how)),
            Command::PlayFile(path) => self.leave(Then::Play(path)),
            Command::Save => self.save(),
            Command::RetrySaving => self.session.retry(),
            Command::SaveAs(_) | Command::Export(_) | Command::Picture(_) => self.write_file(command, false),
            Command::Over(command) => self.write_file(*command, true),
            Command::Quit if cfg!(target_arch = "wasm32") => {
                self.show_message("close the tab of the browser to close this page".to_owned())
            }
            Command::Quit => self.ask_to_close(),
            Command::Answer(answer) => self.answer(answer),
            Command::Play(_) | Command::Seek(_) | Command::Step(_) | Command::Speed(_) => {
                self.control(&command)
            }
        }
        self.apply_events();
    }

    /// Chooses a tool. [`ToolChoice::Look`] hides the grid; the other tools restore it.
    pub(crate) fn set_tool(&mut self, tool: ToolChoice) {
        match (self.input.tool == ToolChoice::Look, tool == ToolChoice::Look) {
            (false, true) => self.input.grid_with_tools = std::mem::take(&mut self.layers.grid),
            (true, false) => self.layers.grid |= self.input.grid_with_tools,
            _ => {}
        }
        self.input.tool = tool;
        if let ToolChoice::Draw(tool) = tool {
            self.input.brush.tool = tool;
        }
    }

    fn switch_index(&mut self, kind: IndexKind, occlusion: Method) {
        // The whole scene is inserted below, including the changes that were pending for the old index.
        self.session.take_changes(&mut self.pending.changes);
        let bounds = self.session.bounds();
        self.culling.reindex(kind, occlusion, self.session.scene(), &bounds);
    }

    fn report_reindexing(&mut self) {
        if let Some(done) = self.culling.reindexed() {
            self.show_message(format!(
                "{}: {} polygons inserted in {:.1} ms",
                done.kind.name(),
                done.polygons,
                done.took.as_secs_f64() * 1.0e3
            ));
        }
    }

    /// Writes all pending events to the file immediately, and shows the file's name.
    fn save(&mut self) {
        self.finish_gestures();
        self.apply_events();
        if self.session.is_replay() {
            return;
        }
        if self.session.event_count() == 0 {
            self.show_message("nothing is drawn yet: the file is made with the first stroke".to_owned());
            return;
        }
        let outcome = self.session.settle();
        let missing = self.session.on_their_way();
        let path = self.session.path().display().to_string();
        match outcome {
            Ok(()) if missing > 0 => {
                self.show_message(format!(
                    "the server has not confirmed {missing} of your changes yet; all others are in {path}"
                ));
            }
            Ok(()) => self.show_message(format!("saved: the whole session is in {path}")),
            Err(unwritten) => self.show_message(unwritten.to_string()),
        }
    }

    pub(crate) fn save_as(&mut self, path: &Path) {
        self.finish_gestures();
        let outcome = match self.session.is_replay() {
            true => Err("a replay is saved already: open it with `osp sketch` to change it".to_owned()),
            false => self.session.save_as(path).map_err(|error| {
                match ExportKind::of(path) == Some(ExportKind::Sketch) {
                    true => format!("{error}; the menu entry \"Export .tilt…\" writes a sketch"),
                    false => error.to_string(),
                }
            }),
        };
        let done = format!("saved as {}; drawing continues there", path.display());
        self.report_file(outcome.map(|()| done));
    }

    /// Reports the result of reading or writing a file, and stores it for the file dialog.
    pub(crate) fn report_file(&mut self, outcome: Result<String, String>) {
        self.work.file_outcome = Some(outcome.as_ref().map(|_| ()).map_err(Clone::clone));
        match outcome {
            Ok(said) | Err(said) if !said.is_empty() => self.show_message(said),
            _ => {}
        }
    }

    /// Returns and clears the result of the last command that read or wrote a file.
    pub fn take_file_outcome(&mut self) -> Option<Result<(), String>> {
        self.work.file_outcome.take()
    }

    pub(crate) fn take_picture(&mut self) -> Option<std::path::PathBuf> {
        self.work.picture.take()
    }

    fn control(&mut self, command: &Command) {
        let Some(replay) = self.session.replay() else { return };
        let position = replay.position();
        if *command == Command::Play(true) && position == replay.frame_count() {
            self.show_most();
        }
        let jump = match *command {
            Command::Play(run) => self.session.play(run),
            Command::Seek(frame) => self.session.seek(frame),
            Command::Step(by) => {
                self.session.play(false);
                self.session.seek(position.saturating_add_signed(by))
            }
            Command::Speed(speed) => {
                self.session.set_speed(speed);
                None
            }
            _ => None,
        };
        if self.follows_replay_camera()
            && let Some(view) = self.session.replay().map(Replay::view)
        {
            self.navigator.go_to(view.eye_in_world, view.world_from_view);
        }
        if let Some(jump) = jump {
            self.take_jump(jump);
        }
    }

    fn take_jump(&mut self, jump: Jump) {
        // The index is updated immediately, because after another jump the scene may lack these polygons.
        self.culling.follow(self.session.scene(), &jump.changes);
        let keep = self.pending.keep.map_or(jump.polygon_count, |keep| keep.min(jump.polygon_count));
        self.pending.keep = Some(keep);
        self.pending.changes.extend(jump.moved.into_iter().map(osp::polygon::Change::Update));
    }
}
