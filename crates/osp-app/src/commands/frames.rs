//! Starts and stops writing each frame to a picture file.

use crate::{
    frames::{FrameWriter, VIDEO_RATE},
    studio::Studio,
};
use osp_render::{Image, RenderError, ffmpeg_command};

impl Studio {
    /// Whether frames are being written.
    pub fn writes_frames(&self) -> bool {
        self.work.frames.is_some()
    }

    /// Starts or stops writing each frame to a new folder beside the session.
    pub(crate) fn toggle_frames(&mut self) {
        if self.work.frames.is_some() {
            self.end_frames(None);
            return;
        }
        if cfg!(target_arch = "wasm32") {
            self.show_message("the browser cannot write frames".to_owned());
            return;
        }
        match FrameWriter::beside(self.session.path()) {
            Ok(frames) => {
                let folder = frames.folder().display().to_string();
                self.work.frames = Some(frames);
                self.show_message(format!("each frame is written to {folder}; F9 ends it"));
            }
            Err(error) => self.show_message(error.to_string()),
        }
    }

    /// Writes a frame, if frames are being written.
    pub fn take_frame(&mut self, image: Image) {
        if let Some(frames) = &mut self.work.frames
            && let Err(error) = frames.take(image)
        {
            self.end_frames(Some(error));
        }
    }

    fn end_frames(&mut self, why: Option<RenderError>) {
        let Some(mut frames) = self.work.frames.take() else { return };
        let (count, failed) = frames.finish();
        if let Some(error) = why.or(failed) {
            self.show_message(format!("not all frames are written: {error}"));
            return;
        }
        let command = ffmpeg_command(frames.folder(), "", VIDEO_RATE);
        self.show_message(format!(
            "{count} frames are in {}; this command makes a video: {command}",
            frames.folder().display()
        ));
    }
}
