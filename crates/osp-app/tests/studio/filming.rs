//! The window makes films with the program's encoder.

use std::{fs, path::Path};

use osp_app::{Answer, Button, Command, FilmMaker};

use crate::drawing::{Table, across};

/// A maker that writes the length of the session's file, and notes three pictures.
fn maker(session: &Path, out: &Path, goes_on: &dyn Fn(u64) -> bool) -> Result<String, String> {
    let bytes = fs::read(session).map_err(|error| error.to_string())?;
    if !(1..=3).all(goes_on) {
        return Err("cancelled".to_owned());
    }
    fs::write(out, bytes.len().to_string()).map_err(|error| error.to_string())?;
    Ok(format!("{}: 3 frames", out.display()))
}

fn said(table: &Table) -> String {
    table.studio.messages().last().cloned().unwrap_or_default()
}

#[test]
fn a_film_shows_the_session_with_the_last_stroke() {
    let mut table = Table::new();
    let film = table.folder.path().join("film.mp4");
    table.drag(Button::Primary, &across(0.0));
    table.studio.command(Command::Export(film.clone()));
    assert!(said(&table).contains("makes no films") && !film.exists(), "{}", said(&table));
    table.studio.set_film_maker(FilmMaker { pictures: |_| 3, make: maker });
    // Unwritten samples of a stroke under the hand belong to the film.
    table.input(osp_app::Input::Press(Button::Primary));
    table.studio.command(Command::Export(film.clone()));
    assert!(said(&table).ends_with("film.mp4: 3 frames"), "{}", said(&table));
    let session = fs::read(table.studio.session().path()).expect("the session's file");
    assert_eq!(fs::read_to_string(&film).expect("a film"), session.len().to_string());
    // A film of another program is not replaced, and other names are no films.
    fs::write(&film, b"somebody's film").expect("written");
    table.studio.command(Command::Export(film.clone()));
    if table.studio.question().is_some() {
        table.studio.command(Command::Answer(Answer::Cancel));
    }
    assert_eq!(fs::read(&film).expect("kept"), b"somebody's film");
    table.studio.command(Command::Export(table.folder.path().join("film.avi")));
    assert!(said(&table).contains("expected"), "{}", said(&table));
}
