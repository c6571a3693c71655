use egui::{Key, KeyboardShortcut, Modifiers};

use crate::{
    app::{
        command::Command,
        tool::{Span, ToolChoice},
    },
    recording::Tool,
};

/// The action of a shortcut.
#[derive(Clone, Copy, Debug)]
pub enum Action {
    /// A command without a question before it.
    Do(fn() -> Command),
    /// Freeze the culling camera, or let it go.
    ToggleFreeze,
    /// Build the next index of the list from the model.
    NextIndex,
    /// Cull by the next occlusion method of the list.
    NextOcclusion,
    /// Open the dialog for a session to open.
    AskOpen,
    /// Open the dialog for a place to save.
    AskSaveAs,
    /// Open the dialog for a model to export.
    AskExport,
    /// Open the list of brushes, or close it.
    ToggleBrushes,
    /// Replay: play or pause.
    TogglePlay,
    /// Show or hide the panel with times and counts.
    TogglePanel,
    /// Show the depth pyramid in place of the picture, or the picture again.
    TogglePyramid,
    /// Show or hide the list of shortcuts.
    ToggleHelp,
}

/// A key and its action. The window shows this table in its help and acts by it.
#[derive(Clone, Copy, Debug)]
pub struct Shortcut {
    /// The key, with those held.
    pub keys: KeyboardShortcut,
    /// The action in words.
    pub what: &'static str,
    /// The action.
    pub action: Action,
}

const fn key(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::NONE, key), what, action }
}

const fn command_key(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::COMMAND, key), what, action }
}

/// All shortcuts. Those with more keys held come first, so that the same key without them does not match first.
pub const SHORTCUTS: &[Shortcut] = &[
    Shortcut {
        keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z),
        what: "redo",
        action: Action::Do(|| Command::Redo),
    },
    command_key(Key::Z, "undo", Action::Do(|| Command::Undo)),
    command_key(Key::Y, "redo", Action::Do(|| Command::Redo)),
    command_key(Key::N, "new session", Action::Do(|| Command::New)),
    command_key(Key::O, "open", Action::AskOpen),
    command_key(Key::S, "save as", Action::AskSaveAs),
    command_key(Key::E, "export glTF", Action::AskExport),
    command_key(Key::G, "make a group of the selection", Action::Do(|| Command::GroupSelected)),
    command_key(Key::A, "select all", Action::Do(|| Command::SelectAll)),
    key(Key::Num1, "draw ribbons", Action::Do(|| Command::Tool(ToolChoice::Draw(Tool::Ribbon)))),
    key(Key::Num2, "draw walls", Action::Do(|| Command::Tool(ToolChoice::Draw(Tool::Wall)))),
    key(Key::Num3, "draw tubes", Action::Do(|| Command::Tool(ToolChoice::Draw(Tool::Tube)))),
    key(Key::X, "erase", Action::Do(|| Command::Tool(ToolChoice::Erase))),
    key(Key::V, "select and move", Action::Do(|| Command::Tool(ToolChoice::Select))),
    key(Key::M, "measure a distance", Action::Do(|| Command::Tool(ToolChoice::Span(Span::Distance)))),
    key(Key::R, "select in a box", Action::Do(|| Command::Tool(ToolChoice::Span(Span::Box)))),
    key(Key::G, "select in a sphere", Action::Do(|| Command::Tool(ToolChoice::Span(Span::Sphere)))),
    key(Key::B, "choose a brush", Action::ToggleBrushes),
    key(Key::OpenBracket, "narrower brush", Action::Do(|| Command::Widen(-1.0))),
    key(Key::CloseBracket, "wider brush", Action::Do(|| Command::Widen(1.0))),
    key(Key::Delete, "erase the selection", Action::Do(|| Command::EraseSelected)),
    key(Key::Escape, "select nothing", Action::Do(|| Command::SelectNone)),
    key(Key::H, "show the whole model", Action::Do(|| Command::ShowAll)),
    key(Key::F, "look at the point under the pointer", Action::Do(|| Command::LookAtPointer)),
    key(Key::C, "freeze the culling camera", Action::ToggleFreeze),
    key(Key::I, "next index", Action::NextIndex),
    key(Key::O, "next occlusion method", Action::NextOcclusion),
    key(Key::Space, "replay: play or pause", Action::TogglePlay),
    key(Key::Period, "replay: next frame", Action::Do(|| Command::Step(1))),
    key(Key::Comma, "replay: previous frame", Action::Do(|| Command::Step(-1))),
    key(Key::F1, "this list", Action::ToggleHelp),
    key(Key::F2, "show or hide times and counts", Action::TogglePanel),
    key(Key::F3, "show the depth pyramid of hzb, or the picture", Action::TogglePyramid),
];

/// Actions of the pointer and of held keys, for the list in the window.
pub const HINTS: &[(&str, &str)] = &[
    ("left button", "use the tool: draw, erase, select"),
    ("right button", "orbit around the point in the middle"),
    ("wheel button, Shift + right", "move sideways, up and down"),
    ("Alt + left", "orbit, for pens without buttons"),
    ("Alt + right", "look around"),
    ("wheel", "nearer, farther"),
    ("Shift + wheel", "wider or narrower brush"),
    ("W A S D Q E", "fly"),
    ("Shift + click", "select more"),
];
