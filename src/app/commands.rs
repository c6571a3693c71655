use std::path::Path;

use super::{
    command::Command, document::Opening, player::Jump, question::Then, studio::Studio, subject::Subject,
};
use crate::{
    atomic_file::AtomicFile,
    export::{ExportError, ExportOptions, GltfCounts, write_glb},
    occlusion::Occlusion,
    output_file::{OutputKind, check_output},
    recording::{Event, Tool},
    rivals::IndexKind,
};

impl Studio {
    /// Carries out a command; [`Studio::messages`] gets a message if that fails.
    pub fn command(&mut self, command: Command) {
        let t = self.now_secs();
        match command {
            Command::Undo => {
                self.finish_gestures();
                self.events.push(Event::Undo { t });
            }
            Command::Redo => {
                self.finish_gestures();
                self.events.push(Event::Redo { t });
            }
            Command::Tool(tool) => {
                self.finish_gestures();
                self.tool = tool;
                if let super::tool::ToolChoice::Draw(tool) = tool {
                    self.brush.tool = tool;
                }
            }
            Command::Widen(steps) => self.brush.widen(steps),
            Command::Width(width_m) if width_m.is_finite() => {
                let (narrowest, widest) = super::pen::Brush::WIDTHS_M;
                self.brush.width_m = width_m.clamp(narrowest, widest);
            }
            Command::Width(_) => {}
            Command::Paint(paint) => {
                self.finish_gestures();
                self.tool = super::tool::ToolChoice::Draw(Tool::Ribbon);
                (self.brush.tool, self.brush.paint) = (Tool::Ribbon, paint);
            }
            Command::Color(color) => self.brush.color = color.map(|c| c.clamp(0.0, 1.0)),
            Command::Snap(snap) => self.snap = snap,
            Command::EraseSelected => {
                self.finish_gestures();
                let strokes = self.selection.strokes().to_vec();
                self.selection.clear();
                self.events.extend(strokes.into_iter().map(|stroke| Event::Erase { t, stroke }));
            }
            Command::SelectAll => {
                let scene = self.subject.scene();
                let all = scene.strokes().iter().filter(|stroke| stroke.is_visible());
                self.selection.set(all.filter_map(|stroke| stroke.id()));
            }
            Command::SelectNone => self.selection.clear(),
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
            Command::ShowAll => {
                let bounds = self.subject.bounds();
                self.navigator.show_all(&bounds);
            }
            Command::LookAtPointer => self.look_at_pointer(self.last_aspect),
            Command::Freeze(freeze) => {
                self.frozen = freeze.then(|| self.views().iter().map(|view| view.view).collect());
            }
            Command::Index(kind) => {
                self.switch_index(kind, self.culling.occlusion());
                self.tell_of_reindexing();
            }
            Command::Occlusion(choice) => self.switch_index(self.culling.kind(), choice),
            Command::Occluders(most) => self.culling.set_occluders(most),
            Command::Stages(stages) => self.culling.set_stages(stages),
            Command::Layers(layers) => self.layers = layers,
            Command::New => self.leave(Then::New),
            Command::Open(path) => self.leave(Then::Open(path, Opening::default())),
            Command::OpenAs(path, how) => self.leave(Then::Open(path, how)),
            Command::SaveAs(path) => self.ask_to_save_as(path),
            Command::SaveOver(path) => self.save_as(&path),
            Command::RetrySaving => {
                if let Subject::Sketch(document) = &mut self.subject {
                    document.journal_mut().retry();
                }
            }
            Command::Discard => self.ask_to_discard(),
            Command::ExportGltf(path) => self.ask_to_export(path),
            Command::ExportOver(path) => self.export_gltf(&path),
            Command::Answer(answer) => self.answer(answer),
            Command::Play(_) | Command::Seek(_) | Command::Step(_) | Command::Speed(_) => {
                self.control(&command)
            }
        }
        self.apply_events();
    }

    fn switch_index(&mut self, kind: IndexKind, occlusion: Occlusion) {
        // The whole scene is inserted below; it includes the changes that were waiting for the old index.
        if let Subject::Sketch(document) = &mut self.subject {
            document.take_changes(&mut self.pending.changes);
        }
        let bounds = self.subject.bounds();
        self.culling.reindex(kind, occlusion, self.subject.scene(), &bounds);
    }

    fn tell_of_reindexing(&mut self) {
        if let Some(done) = self.culling.reindexed() {
            self.say(format!(
                "{}: {} polygons inserted in {:.1} ms",
                done.kind.name(),
                done.polygons,
                done.took.as_secs_f64() * 1.0e3
            ));
        }
    }

    pub(super) fn save_as(&mut self, path: &Path) {
        self.finish_gestures();
        let outcome = match &mut self.subject {
            Subject::Sketch(document) => document.save_as(path),
            Subject::Replay(_) => {
                self.say("a replay is saved already: open it with `osp sketch` to change it".to_owned());
                return;
            }
        };
        match outcome {
            Ok(()) => self.say(format!("saved as {}; it goes on there", path.display())),
            Err(error) => self.say(error.to_string()),
        }
    }

    pub(super) fn export_gltf(&mut self, path: &Path) {
        // A model may replace a model and no other file.
        if let Err(error) = check_output(path, OutputKind::Glb, false) {
            self.say(error.to_string());
            return;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let options = ExportOptions { eye_in_world: Some(self.navigator.eye()), ..Default::default() };
        let export = || -> Result<GltfCounts, ExportError> {
            let mut file = AtomicFile::create(path)?;
            let counts = write_glb(self.subject.scene(), &name, &options, &mut file)?;
            file.commit()?;
            Ok(counts)
        };
        match export() {
            Ok(counts) => {
                self.say(format!("{} polygons exported to {}", counts.polygons, path.display()));
                if counts.not_finite > 0 {
                    self.say(format!("{} polygons at infinity were left out", counts.not_finite));
                }
            }
            Err(error) => self.say(format!("{}: {error}", path.display())),
        }
    }

    fn control(&mut self, command: &Command) {
        let Subject::Replay(player) = &mut self.subject else { return };
        let jump = match *command {
            Command::Play(run) => player.play(run),
            Command::Seek(frame) => Some(player.seek(frame)),
            Command::Step(by) => {
                player.play(false);
                Some(player.seek(player.position().saturating_add_signed(by)))
            }
            Command::Speed(speed) => {
                player.set_speed(speed);
                None
            }
            _ => None,
        };
        if self.follows_replay_camera {
            let view = player.view();
            self.navigator.go_to(view.eye_in_world, view.world_from_view);
        }
        if let Some(jump) = jump {
            self.take_jump(jump);
        }
    }

    fn take_jump(&mut self, jump: Jump) {
        // At once: after another jump the scene may not have these polygons any more.
        self.culling.follow(self.subject.scene(), &jump.changes);
        let keep = self.pending.keep.map_or(jump.polygon_count, |keep| keep.min(jump.polygon_count));
        self.pending.keep = Some(keep);
        self.pending.changes.extend(jump.moved.into_iter().map(crate::polygon::Change::Update));
    }
}
