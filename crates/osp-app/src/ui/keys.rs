use egui::{Key, KeyboardShortcut, Modifiers};

use super::{
    actions::Action::{self, Do},
    panel_commands::PathPurpose,
};
use crate::{
    altering::Altering,
    command::Command,
    paint_layers::LayerEdit,
    tool::{Span, ToolChoice},
};
use osp_session::recording::Tool;

/// A key and its action. The help, the menus and the window's input all use this table.
#[derive(Debug)]
pub(super) struct Shortcut {
    pub(super) keys: KeyboardShortcut,
    pub(super) what: &'static str,
    pub(super) action: Action,
}

/// All shortcuts. Those with more modifiers come first, so that the same key without them does not match first.
pub(super) fn shortcuts() -> impl Iterator<Item = &'static Shortcut> {
    let with = |modifiers| {
        let all = TOPICS.iter().flat_map(|(_, shortcuts)| *shortcuts);
        all.filter(move |shortcut| shortcut.keys.modifiers == modifiers)
    };
    [Modifiers::COMMAND.plus(Modifiers::SHIFT), Modifiers::COMMAND, Modifiers::NONE]
        .into_iter()
        .flat_map(with)
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

/// All shortcuts by topic, in the order of the help.
pub(super) static TOPICS: &[(&str, &[Shortcut])] = &[
    (
        "Tools and brushes",
        &[
            key(Key::Num0, "look, without tools", Do(Command::Tool(ToolChoice::Look))),
            key(Key::Num1, "draw ribbons", Do(Command::Tool(ToolChoice::Draw(Tool::Ribbon)))),
            key(Key::Num2, "draw walls", Do(Command::Tool(ToolChoice::Draw(Tool::Wall)))),
            key(Key::Num3, "draw tubes", Do(Command::Tool(ToolChoice::Draw(Tool::Tube)))),
            key(Key::Num4, "erase", Do(Command::Tool(ToolChoice::Erase))),
            key(Key::Num5, "select and move", Do(Command::Tool(ToolChoice::Select))),
            key(Key::X, "erase", Do(Command::Tool(ToolChoice::Erase))),
            key(Key::V, "select and move", Do(Command::Tool(ToolChoice::Select))),
            key(Key::M, "measure a distance", Do(Command::Tool(ToolChoice::Span(Span::Distance)))),
            key(Key::R, "select in a box", Do(Command::Tool(ToolChoice::Span(Span::Box)))),
            key(Key::G, "select in a sphere", Do(Command::Tool(ToolChoice::Span(Span::Sphere)))),
            key(Key::B, "choose a brush", Action::ToggleBrushes),
            key(Key::OpenBracket, "narrower brush", Do(Command::Widen(-1.0))),
            key(Key::CloseBracket, "wider brush", Do(Command::Widen(1.0))),
            key(Key::U, "straight lines, or free hand", Action::ToggleStraight),
            key(Key::Y, "mirror while drawing", Action::ToggleMirror),
            key(Key::J, "brush width in pixels or in metres", Action::ToggleScreenWidth),
        ],
    ),
    (
        "Files",
        &[
            command_shift_key(Key::S, "save as", Action::Ask(PathPurpose::SaveAs)),
            command_shift_key(Key::E, "export .tilt", Action::Ask(PathPurpose::ExportTilt)),
            command_key(Key::N, "new session", Do(Command::New)),
            command_key(Key::O, "open", Action::Ask(PathPurpose::Open)),
            command_key(Key::S, "save", Action::Save),
            command_key(Key::E, "export glTF", Action::Ask(PathPurpose::Export)),
            command_key(Key::P, "save a picture", Action::Ask(PathPurpose::Picture)),
            command_key(Key::Q, "quit", Do(Command::Quit)),
        ],
    ),
    (
        "Replay",
        &[
            key(Key::Space, "replay: play or pause", Action::TogglePlay),
            key(Key::Period, "replay: next frame", Do(Command::Step(1))),
            key(Key::Comma, "replay: previous frame", Do(Command::Step(-1))),
        ],
    ),
    (
        "View",
        &[
            command_key(Key::F5, "save view 1", Do(Command::KeepView(0))),
            command_key(Key::F6, "save view 2", Do(Command::KeepView(1))),
            command_key(Key::F7, "save view 3", Do(Command::KeepView(2))),
            command_key(Key::F8, "save view 4", Do(Command::KeepView(3))),
            key(Key::Escape, "close what is on top, cancel a stroke, or select nothing", Action::Escape),
            key(Key::F, "show the whole model", Do(Command::ShowAll)),
            key(Key::H, "the view of the artist", Do(Command::ShowAsPainted)),
            key(Key::T, "turn to the point under the pointer", Do(Command::LookAtPointer)),
            key(Key::F1, "this list", Action::ToggleHelp),
            key(Key::F5, "go to view 1", Do(Command::GoToView(0))),
            key(Key::F6, "go to view 2", Do(Command::GoToView(1))),
            key(Key::F7, "go to view 3", Do(Command::GoToView(2))),
            key(Key::F8, "go to view 4", Do(Command::GoToView(3))),
            key(Key::F11, "full screen, or a window again", Action::ToggleFullscreen),
        ],
    ),
    (
        "Strokes, groups and layers",
        &[
            command_shift_key(Key::Z, "redo", Do(Command::Redo)),
            command_shift_key(Key::N, "new layer", Do(Command::Layer(LayerEdit::New))),
            command_shift_key(
                Key::H,
                "hide the layer, or show it",
                Do(Command::Layer(LayerEdit::ToggleHidden)),
            ),
            command_shift_key(
                Key::L,
                "lock the layer, or unlock it",
                Do(Command::Layer(LayerEdit::ToggleLocked)),
            ),
            command_key(
                Key::L,
                "move the selection to the current layer",
                Do(Command::Layer(LayerEdit::TakeSelection)),
            ),
            command_key(Key::Z, "undo", Do(Command::Undo)),
            command_key(Key::Y, "redo", Do(Command::Redo)),
            command_key(Key::G, "make a group of the selection", Do(Command::GroupSelected)),
            command_key(Key::C, "copy the selection", Do(Command::Copy)),
            command_key(Key::X, "cut the selection", Do(Command::Cut)),
            command_key(Key::V, "paste", Do(Command::Paste)),
            command_key(Key::D, "duplicate the selection", Do(Command::Duplicate)),
            command_key(Key::M, "mirror the selection", Do(Command::Alter(Altering::Mirror))),
            command_key(Key::OpenBracket, "turn the selection left", Do(TURN_LEFT)),
            command_key(Key::CloseBracket, "turn the selection right", Do(TURN_RIGHT)),
            command_key(Key::A, "select all", Do(Command::SelectAll)),
            key(Key::K, "give the selection the colour of the brush", Do(Command::Alter(Altering::Color))),
            key(Key::L, "give the selection the width of the brush", Do(Command::Alter(Altering::Width))),
            key(Key::PageUp, "enlarge the selection", Do(LARGER)),
            key(Key::PageDown, "shrink the selection", Do(SMALLER)),
            key(Key::Delete, "erase the selection", Do(Command::EraseSelected)),
        ],
    ),
    (
        "Culling",
        &[
            key(Key::C, "freeze the culling camera", Action::ToggleFreeze),
            key(Key::I, "next index", Action::NextIndex),
            key(Key::O, "next occlusion method", Action::NextOcclusion),
            key(Key::F2, "show or hide the culling panel", Action::TogglePanel),
            key(Key::F3, "show the depth pyramid of hzb, or the picture", Action::TogglePyramid),
        ],
    ),
];

/// Actions of the pointer and of held keys, for the list in the window.
pub(super) const HINTS: &[(&str, &str)] = &[
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
