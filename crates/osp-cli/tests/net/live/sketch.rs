//! Windows that draw in one session, without their panels.

use std::{
    fs,
    path::{Path, PathBuf},
};

use osp::glam::Vec2;
use osp_app::{Autosaves, Button, Command, Held, Input, LayerEdit, Live, Session, Studio, ToolChoice};
use osp_net::live::{Address, Role, Who};
use osp_rivals::IndexKind;
use osp_session::recording::{self, Event, OpenOptions, Tool};

use osp_testkit::wait_until;

use super::server::Server;

pub(crate) const SIZE_PX: Vec2 = Vec2::new(800.0, 600.0);

pub(crate) struct Window {
    pub(crate) studio: Studio,
    pub(crate) folder: tempfile::TempDir,
}

impl Window {
    pub(crate) fn join(server: &Server, role: Role) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let autosaves = Autosaves::new(Some(folder.path().to_owned()));
        let address: Address = server.session("house").parse().expect("an address");
        let shared = Live::join(&address, &role, &autosaves).expect("a thread");
        let session = Session::joining(shared, &autosaves).expect("a document");
        let studio = Studio::new(session, autosaves, IndexKind::Osp);
        Self { studio, folder }
    }

    pub(crate) fn author(server: &Server, name: &str) -> Self {
        Self::join(server, Role::Author(Who { name: name.to_owned(), color: None }))
    }

    pub(crate) fn frame(&mut self) {
        self.studio.frame(SIZE_PX, 0.016);
    }

    /// Draws a ribbon across the window at this height; a frame after each sample.
    pub(crate) fn draw(&mut self, height: f32) {
        let input = |studio: &mut Studio, input| studio.input(input, Held::default(), SIZE_PX);
        input(&mut self.studio, Input::Move(Vec2::new(-0.5, height)));
        input(&mut self.studio, Input::Press(Button::Primary));
        for i in 1..20 {
            input(&mut self.studio, Input::Move(Vec2::new(-0.5 + 0.05 * i as f32, height)));
            self.studio.frame(SIZE_PX, 0.016);
        }
        input(&mut self.studio, Input::Release(Button::Primary));
        self.frame();
    }

    fn visible(&self) -> u64 {
        self.studio.scene().counts().visible
    }

    pub(crate) fn on_their_way(&self) -> usize {
        self.studio.overlay().expect("a shared session").shown.len()
    }

    pub(crate) fn live(&self) -> &Live {
        self.studio.session().live().expect("a shared session")
    }

    pub(crate) fn is_author(&self) -> bool {
        self.live().status().author.is_some()
    }

    /// Recordings among its autosaves whose name contains this.
    fn saved(&self, part: &str) -> Vec<PathBuf> {
        saved(self.folder.path(), part)
    }
}

pub(crate) fn saved(folder: &Path, part: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let is_one = |path: &PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        name.contains(part) && name.ends_with(".ron")
    };
    entries.filter(is_one).collect()
}

/// Frames of all windows until this is so.
pub(crate) fn until(windows: &mut [&mut Window], what: &str, is_so: impl Fn(&[&mut Window]) -> bool) {
    wait_until(what, || {
        windows.iter_mut().for_each(|window| window.frame());
        is_so(windows)
    });
}

pub(crate) fn have_all(windows: &[&mut Window]) -> bool {
    windows.iter().all(|window| {
        window.visible() == windows[0].visible() && window.on_their_way() == 0 && !window.live().is_waiting()
    })
}

#[test]
fn what_one_draws_the_other_has_and_their_recordings_are_the_same() {
    let Some(server) = Server::start() else { return };
    let (mut ann, mut bob) = (Window::author(&server, "Ann"), Window::author(&server, "Bob"));
    let mut eve = Window::join(&server, Role::Watcher);
    until(&mut [&mut ann, &mut bob], "both are authors", |all| all.iter().all(|one| one.is_author()));
    assert!(!ann.studio.can(&Command::Undo));
    ann.draw(0.2);
    bob.draw(-0.2);
    // Whoever draws does not wait for the network: what has not come back is shown over the model.
    let drawn = ann.visible() as usize + ann.on_their_way();
    assert!(drawn >= 19, "{drawn}");
    until(&mut [&mut ann, &mut bob, &mut eve], "all have both strokes", |all| {
        all.iter().all(|one| one.studio.scene().counts().strokes == 2) && have_all(all)
    });
    assert!(ann.visible() >= 36);
    // Each takes back its own.
    assert!(ann.studio.can(&Command::Undo) && bob.studio.can(&Command::Undo));
    assert!(!eve.studio.can(&Command::Undo) && !eve.studio.can_draw());
    let before = bob.visible();
    bob.studio.command(Command::Undo);
    until(&mut [&mut ann, &mut bob, &mut eve], "one stroke is gone", |all| {
        all[0].visible() < before && have_all(all)
    });
    assert!(!bob.studio.can(&Command::Undo) && bob.studio.can(&Command::Redo));
    // Groups and copies have numbers of their author.
    ann.studio.command(Command::SelectAll);
    ann.studio.command(Command::GroupSelected);
    ann.studio.command(Command::Duplicate);
    until(&mut [&mut ann, &mut bob, &mut eve], "the copy", |all| {
        all.iter().all(|one| one.studio.scene().counts().strokes == 3) && have_all(all)
    });
    assert_eq!(ann.studio.scene().counts().ignored_events, 0);
    let session: Vec<Vec<u8>> = [ann, bob, eve]
        .map(|window| {
            let Window { studio, folder } = window;
            studio.close().expect("written");
            assert!(saved(folder.path(), "house-own").is_empty(), "all of it is in the session");
            let saved = saved(folder.path(), "house");
            assert_eq!(saved.len(), 1, "{saved:?}");
            fs::read(&saved[0]).expect("a recording")
        })
        .into_iter()
        .collect();
    // Whoever left first does not know that the others have.
    assert!(session[1].starts_with(&session[0]) && session[2].starts_with(&session[1]));
    assert!(session[0].len() > 2000);
}

#[test]
fn without_a_server_one_draws_on_and_what_never_gets_there_is_in_a_file() {
    let Some(mut server) = Server::start() else { return };
    let mut ann = Window::author(&server, "Ann");
    until(&mut [&mut ann], "an author", |all| all[0].is_author());
    server.kill();
    ann.draw(0.1);
    assert!(ann.on_their_way() >= 18 && ann.visible() == 0 && ann.live().is_waiting());
    server.start_again();
    until(&mut [&mut ann], "it came back", |all| all[0].visible() >= 18 && have_all(all));
    server.kill();
    ann.draw(-0.1);
    let own = ann.saved("house-own");
    let strokes = |path: &Path| {
        let session = recording::open(path, &OpenOptions::default()).expect("a recording");
        session.filter(|event| matches!(event, Ok(Event::End { .. }))).count()
    };
    // Also if the program were killed now.
    assert_eq!(own.iter().map(|path| strokes(path)).collect::<Vec<_>>(), [2]);
    let Window { studio, folder } = ann;
    studio.close().expect("written");
    assert_eq!(saved(folder.path(), "house-own"), own);
}

#[test]
fn who_makes_a_layer_can_keep_it_and_the_others_see_whose_it_is() {
    let Some(server) = Server::start() else { return };
    let (mut ann, mut bob) = (Window::author(&server, "Ann"), Window::author(&server, "Bob"));
    until(&mut [&mut ann, &mut bob], "both are authors", |all| all.iter().all(|one| one.is_author()));
    let layer = |window: &mut Window, edit| window.studio.command(Command::Layer(edit));
    let close = |is_closed| LayerEdit::Close(1, is_closed);
    layer(&mut ann, LayerEdit::New);
    until(&mut [&mut ann, &mut bob], "the layer", |all| {
        all.iter().all(|one| one.studio.session_layers().len() == 2)
    });
    let row = |window: &Window| window.studio.session_layers().remove(1);
    assert_eq!(row(&bob).owner.map(|(_, name)| name).as_deref(), Some("Ann"));
    assert!(ann.studio.can(&Command::Layer(close(true))) && !bob.studio.can(&Command::Layer(close(true))));
    ann.draw(0.2);
    layer(&mut ann, close(true));
    until(&mut [&mut ann, &mut bob], "it is closed", |all| {
        all.iter().all(|one| row(one).is_closed) && have_all(all)
    });
    // Bob neither draws on it, nor renames or erases anything.
    layer(&mut bob, LayerEdit::Choose(1));
    bob.draw(-0.2);
    layer(&mut bob, LayerEdit::Name(1, "his".to_owned()));
    bob.studio.command(Command::SelectAll);
    assert!(bob.studio.selection().is_empty());
    bob.studio.command(Command::Tool(ToolChoice::Draw(Tool::Ribbon)));
    assert!(bob.studio.messages().iter().any(|said| said.starts_with("only Ann may edit layer 2")));
    assert_eq!((bob.on_their_way(), bob.live().is_waiting()), (0, false));
    layer(&mut bob, LayerEdit::Choose(0));
    bob.draw(-0.2);
    ann.draw(0.4);
    until(&mut [&mut ann, &mut bob], "all else", |all| {
        all.iter().all(|one| one.studio.scene().counts().strokes == 3) && have_all(all)
    });
    layer(&mut ann, close(false));
    until(&mut [&mut ann, &mut bob], "it is open", |all| all.iter().all(|one| !row(one).is_closed));
    layer(&mut bob, LayerEdit::Choose(1));
    bob.draw(-0.4);
    until(&mut [&mut ann, &mut bob], "his stroke on hers", |all| {
        all.iter().all(|one| one.studio.scene().counts().strokes == 4) && have_all(all)
    });
    assert_eq!(ann.studio.scene().counts().ignored_events, 0);

    // Bob has not heard yet that it is closed again when he draws: the stroke is not in the model, but not lost.
    layer(&mut ann, close(true));
    until(&mut [&mut ann], "it is closed", |all| row(all[0]).is_closed);
    bob.draw(-0.6);
    until(&mut [&mut ann, &mut bob], "it came too late", |all| row(all[1]).is_closed && have_all(all));
    assert_eq!(bob.studio.scene().counts().strokes, 4);
    let said = "1 of your strokes are not in the model, because only another author may edit their layer now";
    assert!(bob.studio.messages().iter().any(|message| message.starts_with(said)));
    let folder = bob.folder;
    bob.studio.close().expect("written");
    let own = saved(folder.path(), "house-own");
    let strokes = |path: &PathBuf| {
        let events = recording::open(path, &OpenOptions::STRICT).expect("a recording");
        events.filter(|event| matches!(event, Ok(Event::Begin { .. }))).count()
    };
    assert_eq!(own.iter().map(strokes).collect::<Vec<_>>(), [3], "all that he has drawn");
}
