//! The pictures of a frame: a single one, or one for each screen and eye of a rig.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::parsers::Size;
use osp::view::View;
use osp_render::{Gpu, Offscreen, RenderError, RendererConfig};
use osp_session::{replay::RigPath, rig::Eye};

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Picture {
    /// Number of the drawer's view.
    pub(super) number: usize,
    /// Suffix of the file's name: the screen and the eye, such as `left-right-eye`. `None` without a rig.
    suffix: Option<String>,
    on_screen: Option<(String, Eye)>,
    size: (u32, u32),
}

impl Picture {
    /// Returns the path of this picture: `path`, the path of the frame, with the suffix.
    pub(super) fn path(&self, path: &Path) -> PathBuf {
        let Some(suffix) = &self.suffix else { return path.to_owned() };
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(format!("-{suffix}"));
        if let Some(ending) = path.extension() {
            name.push(".");
            name.push(ending);
        }
        path.with_file_name(name)
    }

    /// Returns the suffix for messages, such as `, left-right-eye`. Empty without a rig.
    pub(super) fn name(&self) -> String {
        self.suffix.as_ref().map(|suffix| format!(", {suffix}")).unwrap_or_default()
    }

    /// Returns the reason why a frame lacks this picture.
    pub(super) fn why_not(&self) -> String {
        let Some((screen, eye)) = &self.on_screen else { return String::new() };
        format!("the {} is not in front of the screen `{}`", eye.name(), screen.escape_debug())
    }
}

#[derive(Debug)]
pub(super) struct Pictures(Vec<Picture>);

impl Pictures {
    /// Creates one picture of this size. With a rig, creates one of this height for each screen and eye.
    pub(super) fn new(size: Size, rig: Option<&RigPath>) -> Self {
        let Some(rig) = rig else {
            let size = (size.width, size.height);
            return Self(vec![Picture { number: 0, suffix: None, on_screen: None, size }]);
        };
        let mut pictures: Vec<Picture> = Vec::new();
        for (number, (screen, eye)) in rig.slots().enumerate() {
            let screen = &rig.rig().screens[screen];
            let mut suffix = in_file_name(&screen.name);
            if eye != Eye::Middle {
                suffix += &format!("-{}", in_file_name(eye.name()));
            }
            // Two screens may have the same name, and some systems ignore the difference between upper and lower case.
            let is_taken = |suffix: &str| {
                let same = |other: &Picture| other.suffix.as_ref().map(|other| other.to_lowercase());
                pictures.iter().any(|other| same(other) == Some(suffix.to_lowercase()))
            };
            while is_taken(&suffix) {
                suffix += &format!("-{number}");
            }
            let Size { width, height } = size.on(screen);
            let on_screen = Some((screen.name.clone(), eye));
            pictures.push(Picture { number, suffix: Some(suffix), on_screen, size: (width, height) });
        }
        Self(pictures)
    }

    pub(super) fn all(&self) -> &[Picture] {
        &self.0
    }

    /// Creates a drawer with one view for each picture.
    pub(super) fn drawer(&self, gpu: Arc<Gpu>, config: &RendererConfig) -> Result<Offscreen, RenderError> {
        let [first, others @ ..] = &self.0[..] else { unreachable!("a rig has a screen") };
        let mut drawer = Offscreen::on(gpu, first.size.0, first.size.1, config)?;
        for picture in others {
            drawer.add_view(picture.size.0, picture.size.1)?;
        }
        Ok(drawer)
    }

    /// Returns the pictures of a frame with this camera, each with its view.
    pub(super) fn seen(&self, rig: Option<&mut RigPath>, camera: &View) -> Vec<(Picture, View)> {
        let Some(rig) = rig else {
            return self.0.iter().map(|picture| (picture.clone(), *camera)).collect();
        };
        let mut views = Vec::new();
        rig.views_into(camera, &mut views);
        let pictures = self.0.iter().zip(views);
        pictures.filter_map(|(picture, seen)| Some((picture.clone(), seen.view?))).collect()
    }
}

/// Returns a name in a form that is allowed in file names on every system.
fn in_file_name(name: &str) -> String {
    let allowed = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_') { c } else { '-' };
    name.chars().take(40).map(allowed).collect()
}
