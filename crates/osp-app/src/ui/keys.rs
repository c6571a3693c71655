use egui::{Key, KeyboardShortcut, Modifiers};

use super::actions::Action;
use crate::{
    altering::Altering,
    command::Command,
    occlusion_steps::StepsEdit,
    paint_layers::LayerEdit,
    tool::{Span, ToolChoice},
};
use osp_session::recording::Tool;

/// A key and its action. The help, the menus and the window's input all use this table.
#[derive(Debug)]
pub struct Shortcut {
    /// The key with its modifiers.
    pub keys: KeyboardShortcut,
    /// Description of the action.
    pub what: &'static str,
    /// The action.
    pub action: Action,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topic {
    File,
    Tools,
    Edit,
    View,
    Replay,
    Culling,
}

impl Topic {
    pub(super) const ALL: [Self; 6] =
        [Self::Tools, Self::File, Self::Replay, Self::View, Self::Edit, Self::Culling];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::File => "Files",
            Self::Tools => "Tools and brushes",
            Self::Edit => "Strokes, groups and layers",
            Self::View => "View",
            Self::Replay => "Replay",
            Self::Culling => "Culling",
        }
    }
}

impl Shortcut {
    pub(super) fn topic(&self) -> Topic {
        match &self.action {
            Action::AskOpen
            | Action::Save
            | Action::AskSaveAs
            | Action::AskExport
            | Action::AskExportTilt
            | Action::AskPicture
            | Action::AskFilm
            | Action::Do(Command::New | Command::Quit) => Topic::File,
            Action::ToggleBrushes
            | Action::ToggleStraight
            | Action::ToggleMirror
            | Action::ToggleScreenWidth
            | Action::Do(Command::Tool(_) | Command::Widen(_)) => Topic::Tools,
            Action::TogglePlay | Action::Do(Command::Step(_)) => Topic::Replay,
            Action::ToggleFreeze
            | Action::NextIndex
            | Action::NextOcclusion
            | Action::TogglePanel
            | Action::TogglePyramid
            | Action::ToggleSteps
            | Action::Do(Command::Steps(_)) => Topic::Culling,
            Action::ToggleHelp
            | Action::ToggleFullscreen
            | Action::Escape
            | Action::Do(
                Command::ShowAll
                | Command::ShowAsPainted
                | Command::LookAtPointer
                | Command::KeepView(_)
                | Command::GoToView(_),
            ) => Topic::View,
            Action::Do(_) => Topic::Edit,
        }
    }
}

const fn key(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::NONE, key), what, action }
}

const fn command_key(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::COMMAND, key), what, action }
}

const fn command_shift_key(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key), what, action }
}

// Commands that rotate the selection by an angle (degrees) and scale it by a factor.
pub(super) const TURN_LEFT: Command = Command::Alter(Altering::Turn(15.0));
pub(super) const TURN_RIGHT: Command = Command::Alter(Altering::Turn(-15.0));
pub(super) const LARGER: Command = Command::Alter(Altering::Scale(1.1));
pub(super) const SMALLER: Command = Command::Alter(Altering::Scale(1.0 / 1.1));

/// All shortcuts. Shortcuts with more modifiers come first, so that the same key without them does not match first.
pub static SHORTCUTS: &[Shortcut] = &[
    command_shift_key(Key::Z, "redo", Action::Do(Command::Redo)),
    command_shift_key(Key::S, "save as", Action::AskSaveAs),
    command_shift_key(Key::E, "export .tilt", Action::AskExportTilt),
    command_shift_key(Key::N, "new layer", Action::Do(Command::Layer(LayerEdit::New))),
    command_shift_key(
        Key::H,
        "hide the layer, or show it",
        Action::Do(Command::Layer(LayerEdit::ToggleHidden)),
    ),
    command_shift_key(
        Key::L,
        "lock the layer, or unlock it",
        Action::Do(Command::Layer(LayerEdit::ToggleLocked)),
    ),
    command_key(
        Key::L,
        "move the selection to the current layer",
        Action::Do(Command::Layer(LayerEdit::TakeSelection)),
    ),
    command_key(Key::F5, "save view 1", Action::Do(Command::KeepView(0))),
    command_key(Key::F6, "save view 2", Action::Do(Command::KeepView(1))),
    command_key(Key::F7, "save view 3", Action::Do(Command::KeepView(2))),
    command_key(Key::F8, "save view 4", Action::Do(Command::KeepView(3))),
    command_key(Key::Z, "undo", Action::Do(Command::Undo)),
    command_key(Key::Y, "redo", Action::Do(Command::Redo)),
    command_key(Key::N, "new session", Action::Do(Command::New)),
    command_key(Key::O, "open", Action::AskOpen),
    command_key(Key::S, "save", Action::Save),
    command_key(Key::E, "export glTF", Action::AskExport),
    command_key(Key::P, "save a picture", Action::AskPicture),
    command_key(Key::Q, "quit", Action::Do(Command::Quit)),
    command_key(Key::G, "make a group of the selection", Action::Do(Command::GroupSelected)),
    command_key(Key::C, "copy the selection", Action::Do(Command::Copy)),
    command_key(Key::X, "cut the selection", Action::Do(Command::Cut)),
    command_key(Key::V, "paste", Action::Do(Command::Paste)),
    command_key(Key::D, "duplicate the selection", Action::Do(Command::Duplicate)),
    command_key(Key::M, "mirror the selection", Action::Do(Command::Alter(Altering::Mirror))),
    command_key(Key::OpenBracket, "turn the selection left", Action::Do(TURN_LEFT)),
    command_key(Key::CloseBracket, "turn the selection right", Action::Do(TURN_RIGHT)),
    command_key(Key::A, "select all", Action::Do(Command::SelectAll)),
    key(Key::Num0, "look, without tools", Action::Do(Command::Tool(ToolChoice::Look))),
    key(Key::Num1, "draw ribbons", Action::Do(Command::Tool(ToolChoice::Draw(Tool::Ribbon)))),
    key(Key::Num2, "draw walls", Action::Do(Command::Tool(ToolChoice::Draw(Tool::Wall)))),
    key(Key::Num3, "draw tubes", Action::Do(Command::Tool(ToolChoice::Draw(Tool::Tube)))),
    key(Key::Num4, "erase", Action::Do(Command::Tool(ToolChoice::Erase))),
    key(Key::Num5, "select and move", Action::Do(Command::Tool(ToolChoice::Select))),
    key(Key::X, "erase", Action::Do(Command::Tool(ToolChoice::Erase))),
    key(Key::V, "select and move", Action::Do(Command::Tool(ToolChoice::Select))),
    key(Key::M, "measure a distance", Action::Do(Command::Tool(ToolChoice::Span(Span::Distance)))),
    key(Key::R, "select in a box", Action::Do(Command::Tool(ToolChoice::Span(Span::Box)))),
    key(Key::G, "select in a sphere", Action::Do(Command::Tool(ToolChoice::Span(Span::Sphere)))),
    key(Key::B, "choose a brush", Action::ToggleBrushes),
    key(Key::OpenBracket, "narrower brush", Action::Do(Command::Widen(-1.0))),
    key(Key::CloseBracket, "wider brush", Action::Do(Command::Widen(1.0))),
    key(Key::K, "give the selection the colour of the brush", Action::Do(Command::Alter(Altering::Color))),
    key(Key::L, "give the selection the width of the brush", Action::Do(Command::Alter(Altering::Width))),
    key(Key::PageUp, "enlarge the selection", Action::Do(LARGER)),
    key(Key::PageDown, "shrink the selection", Action::Do(SMALLER)),
    key(Key::U, "straight lines, or free hand", Action::ToggleStraight),
    key(Key::Y, "mirror while drawing", Action::ToggleMirror),
    key(Key::J, "brush width in pixels or in metres", Action::ToggleScreenWidth),
    key(Key::Delete, "erase the selection", Action::Do(Command::EraseSelected)),
    key(Key::Escape, "close what is on top, cancel a stroke, or select nothing", Action::Escape),
    key(Key::F, "show the whole model", Action::Do(Command::ShowAll)),
    key(Key::H, "the view of the artist", Action::Do(Command::ShowAsPainted)),
    key(Key::T, "turn to the point under the pointer", Action::Do(Command::LookAtPointer)),
    key(Key::C, "freeze the culling camera", Action::ToggleFreeze),
    key(Key::I, "next index", Action::NextIndex),
    key(Key::O, "next occlusion method", Action::NextOcclusion),
    key(Key::Space, "replay: play or pause", Action::TogglePlay),
    key(Key::Period, "replay: next frame", Action::Do(Command::Step(1))),
    key(Key::Comma, "replay: previous frame", Action::Do(Command::Step(-1))),
    key(Key::F1, "this list", Action::ToggleHelp),
    key(Key::F2, "show or hide the culling panel", Action::TogglePanel),
    key(Key::F3, "show the depth pyramid of hzb, or the picture", Action::TogglePyramid),
    key(Key::F4, "occlusion, step by step", Action::ToggleSteps),
    key(Key::N, "occlusion: next step", Action::Do(Command::Steps(StepsEdit::By(1)))),
    key(Key::P, "occlusion: previous step", Action::Do(Command::Steps(StepsEdit::By(-1)))),
    key(Key::F5, "go to view 1", Action::Do(Command::GoToView(0))),
    key(Key::F6, "go to view 2", Action::Do(Command::GoToView(1))),
    key(Key::F7, "go to view 3", Action::Do(Command::GoToView(2))),
    key(Key::F8, "go to view 4", Action::Do(Command::GoToView(3))),
    key(Key::F11, "full screen, or a window again", Action::ToggleFullscreen),
];

/// Actions of the pointer and of held keys, for the list in the window.
pub const HINTS: &[(&str, &str)] = &[
    ("left button", "use the tool: draw, erase, select; orbit without a tool"),
    ("right button", "orbit around the point under the pointer"),
    ("wheel button, Shift + right, Space + left", "move sideways, up and down"),
    ("Alt + left", "orbit, for pens without buttons"),
    ("Alt + right", "look around"),
    ("two fingers", "orbit; pinch to come nearer or go away"),
    ("three fingers", "move sideways, up and down"),
    ("wheel", "towards the point under the pointer, or away"),
    ("Shift + wheel", "wider or narrower brush"),
    ("W A S D Q E", "fly"),
    ("Shift while drawing", "a straight line"),
    ("Shift + click", "select more"),
    ("ring around the selection", "turn it; with Shift by 15°"),
    ("knob on the ring", "scale it; with Shift by tenths"),
    ("colour or width, while selecting", "also change the selected strokes"),
    ("Ctrl + and Ctrl -", "larger and smaller text"),
    ("a file dropped on the window", "open it"),
];
