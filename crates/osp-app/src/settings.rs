use std::{
    io,
    path::{Path, PathBuf},
    sync::mpsc::{Sender, channel},
    thread::JoinHandle,
};

use serde::{Deserialize, Serialize};

use super::pen::Brush;
use osp_session::{
    atomic_file::AtomicFile,
    brush,
    platform::{fs, user_folder},
    small_file::read_text,
};

/// Largest number of sessions in the list of recent sessions.
const MOST_RECENT: usize = 12;
/// Largest settings file that is read, bytes.
const MOST_BYTES: u64 = 1 << 20;

/// The colours of the panels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Theme {
    /// Light text on dark panels.
    #[default]
    Dark,
    /// Dark text on light panels.
    Light,
    /// The theme of the desktop.
    System,
}

impl Theme {
    /// All themes.
    pub const ALL: [Self; 3] = [Self::Dark, Self::Light, Self::System];

    /// The theme's name in the menu.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dark => "Dark",
            Self::Light => "Light",
            Self::System => "As the desktop",
        }
    }
}

/// The brush for ribbons, its colour and its width, as they are stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct KeptBrush {
    /// Name of the brush; empty for plain ribbons.
    pub name: String,
    /// Red, green, blue, opacity, sRGB.
    pub color: [f32; 4],
    /// Full width, metres.
    pub width_m: f32,
}

impl KeptBrush {
    pub(super) fn of(pen: &Brush) -> Self {
        let name = pen.paint.map_or("", |brush| brush.name.as_str());
        Self { name: name.to_owned(), color: pen.color, width_m: pen.width_m }
    }

    /// Gives a pen these settings. Values that are out of range stay as they are.
    pub(super) fn give(&self, pen: &mut Brush) {
        pen.paint = brush::find(&self.name).filter(|_| !self.name.is_empty());
        if self.color.iter().all(|part| (0.0..=1.0).contains(part)) {
            pen.color = self.color;
        }
        if (Brush::WIDTHS_M.0..=Brush::WIDTHS_M.1).contains(&self.width_m) {
            pen.width_m = self.width_m;
        }
    }
}

impl Default for KeptBrush {
    fn default() -> Self {
        Self::of(&Brush::default())
    }
}

/// The window's settings, stored between runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// The colours of the panels.
    pub theme: Theme,
    /// Factor of the default text size.
    pub zoom: f32,
    /// Whether the user has ever drawn in the window; the introduction is then not shown.
    pub has_drawn: bool,
    /// The recent named sessions, the latest first.
    pub recent: Vec<PathBuf>,
    /// The pen.
    pub brush: KeptBrush,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            theme: Theme::default(),
            zoom: 1.0,
            has_drawn: false,
            recent: Vec::new(),
            brush: KeptBrush::default(),
        }
    }
}

impl Settings {
    /// The file of the user's settings.
    pub fn default_path() -> PathBuf {
        user_folder("XDG_CONFIG_HOME", ".config/osp").join("window.settings")
    }

    /// Reads the settings. If the file is missing or invalid, returns the defaults, so that the window still opens.
    pub fn read(path: &Path) -> Self {
        let text = read_text(path, MOST_BYTES).unwrap_or_default();
        let mut settings: Self = ron::from_str(&text).unwrap_or_default();
        settings.recent.truncate(MOST_RECENT);
        if !(0.2..=5.0).contains(&settings.zoom) {
            settings.zoom = 1.0;
        }
        settings
    }

    /// Writes the settings.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let text = ron::to_string(self).map_err(io::Error::other)?;
        let mut file = AtomicFile::create(path)?;
        io::Write::write_all(&mut file, text.as_bytes())?;
        file.commit().map(|_| ())
    }

    /// Moves a session to the front of the recent sessions.
    pub fn note_recent(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        // A path that is not valid text cannot be stored.
        if path.to_str().is_none() {
            return;
        }
        self.recent.retain(|other| *other != path);
        self.recent.insert(0, path);
        self.recent.truncate(MOST_RECENT);
    }
}

/// Writes settings on a separate thread, so that no frame waits for the disk.
#[derive(Debug)]
pub(super) struct SettingsKeeper {
    latest: Option<Sender<Settings>>,
    writer: Option<JoinHandle<()>>,
    /// The settings file, on a platform without threads.
    at_once: Option<PathBuf>,
}

impl SettingsKeeper {
    pub(super) fn new(path: PathBuf) -> Self {
        let (latest, settings) = channel::<Settings>();
        if cfg!(target_arch = "wasm32") {
            // On a web page files are in memory.
            return Self { latest: None, writer: None, at_once: Some(path) };
        }
        let writer = std::thread::spawn(move || {
            while let Ok(next) = settings.recv() {
                let mut next = settings.try_iter().last().unwrap_or(next);
                // Another window may have added sessions since.
                for other in Settings::read(&path).recent {
                    if !next.recent.contains(&other) {
                        next.recent.push(other);
                    }
                }
                next.recent.truncate(MOST_RECENT);
                // A failure is not reported, because settings are less important than the session.
                let _ = next.write(&path);
            }
        });
        Self { latest: Some(latest), writer: Some(writer), at_once: None }
    }

    /// Writes the settings, unless newer settings follow immediately.
    pub(super) fn keep(&self, settings: &Settings) {
        if let Some(path) = &self.at_once {
            let _ = settings.write(path);
        }
        if let Some(latest) = &self.latest {
            // A writer that has ended writes nothing.
            let _ = latest.send(settings.clone());
        }
    }
}

impl Drop for SettingsKeeper {
    /// Writes the queued settings first.
    fn drop(&mut self) {
        self.latest = None;
        let _ = self.writer.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_two_windows_keep_is_all_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("window.settings");
        let (first, second) = (SettingsKeeper::new(path.clone()), SettingsKeeper::new(path.clone()));
        let noted = |name: &str| {
            let mut settings = Settings::default();
            settings.note_recent(&folder.path().join(name));
            settings
        };
        for zoom in [1.1, 1.2, 1.3] {
            first.keep(&Settings { zoom, ..noted("a.ron") });
        }
        drop(first);
        second.keep(&noted("b.ron"));
        drop(second);
        assert_eq!(Settings::read(&path).recent, ["b.ron", "a.ron"].map(|name| folder.path().join(name)));
    }

    #[test]
    fn settings_are_read_as_they_were_written_and_never_stand_in_the_way() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("deep/window.settings");
        assert_eq!(Settings::read(&path), Settings::default());
        let mut settings = Settings { theme: Theme::Light, zoom: 1.5, ..Settings::default() };
        for number in 0..20 {
            settings.note_recent(&folder.path().join(format!("{number}.ron")));
        }
        settings.note_recent(&folder.path().join("15.ron"));
        assert_eq!(settings.recent.len(), MOST_RECENT);
        assert_eq!(settings.recent[0], folder.path().join("15.ron"));
        assert_eq!(settings.recent[1], folder.path().join("19.ron"));
        settings.write(&path).expect("written");
        assert_eq!(Settings::read(&path), settings);
        for text in ["", "nonsense", "(zoom:NaN)", "(zoom:1e30)", "(later:3)"] {
            fs::write(&path, text).expect("written");
            assert_eq!(Settings::read(&path), Settings::default(), "{text}");
        }
    }
}
