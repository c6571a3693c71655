//! Writes each frame of the window as a numbered picture, for a video.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};

use osp_render::{Image, RenderError};

/// Frame rate of the video, Hz.
pub(super) const VIDEO_RATE: u32 = 30;
/// Largest number of queued pictures. If the queue is full, the window waits, so that no picture is lost.
const WAITING: usize = 8;

/// Writes pictures on its own thread.
#[derive(Debug)]
pub(super) struct FrameWriter {
    folder: PathBuf,
    next: u64,
    pictures: Option<SyncSender<(PathBuf, Image)>>,
    failed: Receiver<RenderError>,
    writer: Option<JoinHandle<()>>,
}

impl FrameWriter {
    /// Creates a new folder beside a path, with the path's name and a number.
    pub(super) fn beside(path: &Path) -> io::Result<Self> {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut number = 1u32;
        let folder = loop {
            let folder = path.with_file_name(format!("{stem}-frames-{number}"));
            match fs::create_dir(&folder) {
                Ok(()) => break folder,
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < 10_000 => number += 1,
                Err(error) => {
                    return Err(io::Error::new(error.kind(), format!("{}: {error}", folder.display())));
                }
            }
        };
        let (pictures, waiting) = sync_channel::<(PathBuf, Image)>(WAITING);
        let (tell, failed) = std::sync::mpsc::channel();
        let writer = std::thread::spawn(move || {
            for (path, image) in waiting {
                if let Err(error) = image.write_png(&path) {
                    // The window may be closed by now.
                    let _ = tell.send(error);
                    return;
                }
            }
        });
        Ok(Self { folder, next: 0, pictures: Some(pictures), failed, writer: Some(writer) })
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Queues the next frame.
    ///
    /// # Errors
    /// An earlier frame could not be written.
    pub(super) fn take(&mut self, image: Image) -> Result<(), RenderError> {
        let path = self.folder.join(format!("{:06}.png", self.next));
        self.next += 1;
        if let Some(pictures) = &self.pictures {
            // A writer that has ended has reported the reason.
            let _ = pictures.send((path, image));
        }
        self.failed.try_recv().map_or(Ok(()), Err)
    }

    /// Waits until all frames are written. Returns their number, and the error if a frame could not be written.
    pub(super) fn finish(&mut self) -> (u64, Option<RenderError>) {
        self.pictures = None;
        let _ = self.writer.take().map(JoinHandle::join);
        (self.next, self.failed.try_recv().ok())
    }
}

impl Drop for FrameWriter {
    /// Writes the queued pictures first.
    fn drop(&mut self) {
        self.finish();
    }
}
