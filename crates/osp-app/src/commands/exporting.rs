//! Writes models and sketches in the background.

use std::{
    io::{self, Write},
    path::Path,
};

use crate::{
    studio::Studio,
    working::{Done, ExportKind, Exported, Kind, Progress, Whole, WorkMode},
};
use osp_session::{
    atomic_file::AtomicFile,
    export::{ExportError, ExportOptions, write_glb_watched, write_tilt},
    recording::import::tilt_thumbnail,
};

impl Studio {
    pub(crate) fn export(&mut self, path: &Path) {
        if self.is_busy() {
            return;
        }
        match ExportKind::of(path) {
            Some(ExportKind::Sketch) => self.export_tilt(path),
            Some(ExportKind::Film) => self.export_film(path),
            Some(ExportKind::Model) | None => self.export_gltf(path),
        }
        if self.is_working() {
            // A dialog that opens later must not receive the outcome of this export.
            self.report_file(Ok(String::new()));
        }
    }

    fn export_gltf(&mut self, path: &Path) {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let times = self.session.find_times();
        let eye_in_world = Some(self.navigator.eye());
        let header = self.session.header();
        let (camera, environment) = (header.camera, header.environment.as_deref().cloned());
        let scene = self.scene().clone();
        let kind = Kind::Writing { count: scene.counts().visible, of: "polygons" };
        self.write_in_background(path, kind, move |file, progress| {
            let times = Some(times(&|| progress.note(0)));
            let options =
                ExportOptions { times, eye_in_world, camera, environment, ..ExportOptions::default() };
            let counts = write_glb_watched(&scene, &name, &options, file, &|done| progress.note(done))?;
            Ok((counts.polygons, Exported::Model(counts)))
        });
    }

    fn export_tilt(&mut self, path: &Path) {
        self.finish_gestures();
        self.apply_events();
        let (count, strokes) = self.session.find_strokes();
        let header = self.session.header().clone();
        let kind = Kind::Writing { count, of: "events" };
        // A thumbnail that lacks the edits shows at least which sketch it was.
        let thumbnail = self.session.original().and_then(tilt_thumbnail);
        self.write_in_background(path, kind, move |file, progress| {
            let found = strokes(&|events| progress.note(events)).map_err(io::Error::other)?;
            let mut strokes = found.ok_or(ExportError::Cancelled)?;
            let counts = write_tilt(&mut strokes, &header, thumbnail.as_deref(), file)?;
            Ok((count, Exported::Sketch(counts)))
        });
    }

    /// Starts to write a file. `write` returns its final progress and its result.
    fn write_in_background(
        &mut self,
        path: &Path,
        kind: Kind,
        write: impl FnOnce(&mut AtomicFile, &Progress) -> Result<(u64, Exported), ExportError> + Send + 'static,
    ) {
        let what = format!("writing {}", path.display());
        let path = path.to_owned();
        let work = move |progress: &Progress| {
            let export = || {
                let mut file = AtomicFile::create(&path)?;
                let (done, exported) = write(&mut file, progress)?;
                if !progress.note(done) {
                    return Err(ExportError::Cancelled);
                }
                file.flush()?;
                file.commit()?;
                Ok(exported)
            };
            let outcome = export();
            Done::Exported { path, outcome }
        };
        self.start(what, kind, Box::new(Whole::new(work)));
    }

    pub(super) fn take_exported(&mut self, path: &Path, outcome: Result<Exported, ExportError>) {
        let path = path.display();
        let mut lost = Vec::new();
        let said = match outcome {
            Ok(Exported::Model(counts)) => {
                lost.push(("polygons at infinity skipped", counts.not_finite));
                lost.push(("strokes in hidden layers are not written", counts.hidden));
                Ok(format!("{} polygons exported to {path}", counts.polygons))
            }
            Ok(Exported::Sketch(counts)) => {
                let mut said =
                    format!("{} strokes, {} points exported to {path}", counts.strokes, counts.points);
                let name = self.session.path().file_name().unwrap_or_default().to_string_lossy();
                said += &format!("; you still draw in {name}");
                if !counts.notes.is_empty() {
                    said += &format!("; not all is kept: {}", counts.notes.join("; "));
                }
                Ok(said)
            }
            Ok(Exported::Film(said)) => Ok(said),
            Err(error) => Err(format!("{path}: {error}")),
        };
        if self.work.mode != WorkMode::AtOnce {
            let (Ok(said) | Err(said)) = said;
            self.show_message(said);
        } else {
            self.report_file(said);
        }
        for (what, count) in lost.into_iter().filter(|&(_, count)| count > 0) {
            self.show_message(format!("{what}: {count}"));
        }
    }
}
