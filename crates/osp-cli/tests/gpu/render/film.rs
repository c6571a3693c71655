//! `osp film`, read by a decoder.

use std::{fs, path::Path};

use super::{
    decoded_film::Film,
    scenes::{gpu, read_png},
};
use crate::OSP;
use osp_testkit::stderr;

fn osp(args: &[&str]) -> (Option<i32>, String) {
    let output = OSP.run(args);
    (output.status.code(), stderr(&output))
}

/// A film of a shipped session, 96 by 54 pixels, 8 frames in 0.8 seconds.
fn film(folder: &Path, session: &str, path: &str) -> Film {
    let out = folder.join(format!("{path}.gif"));
    let out = out.to_str().expect("utf-8");
    let args = ["film", session, out, "--path", path, "--size", "96x54", "--seconds", "0.8", "--fps", "10"];
    let (code, said) = osp(&args);
    assert_eq!(code, Some(0), "{said}");
    let film = Film::open(out);
    assert_eq!((film.size, film.frames.len()), ((96, 54), 8), "{path}");
    film
}

/// Pixels of a frame that differ from one of another.
fn differing(film: &Film, a: usize, b: usize) -> usize {
    film.frames[a].0.iter().zip(&film.frames[b].0).filter(|(a, b)| a != b).count()
}

/// Pixels that do not have the colour of the upper left one.
fn drawn(film: &Film, frame: usize) -> usize {
    let pixels = &film.frames[frame].0;
    pixels.iter().filter(|color| **color != pixels[0]).count()
}

#[test]
fn a_turntable_shows_the_finished_model_from_all_sides() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let film = film(folder.path(), "recordings/room.ron", "turntable");
    assert!(film.frames.iter().all(|(_, delay)| *delay == 10));
    for frame in 0..8 {
        assert!(drawn(&film, frame) > 300, "frame {frame}");
        assert!(differing(&film, frame, (frame + 1) % 8) > 100, "frame {frame}");
    }
    // It begins as the picture does, but for the 256 colours and a greater distance.
    let picture = folder.path().join("whole.png");
    let picture = picture.to_str().expect("utf-8");
    let (code, said) =
        osp(&["render", "recordings/room.ron", picture, "--camera", "whole", "--size", "96x54"]);
    assert_eq!(code, Some(0), "{said}");
    let (_, _, rgba) = read_png(Path::new(picture));
    let mean = |pixels: &mut dyn Iterator<Item = [u8; 3]>| {
        let mut sum = [0.0; 3];
        for pixel in pixels {
            (0..3).for_each(|c| sum[c] += f64::from(pixel[c]) / (96.0 * 54.0));
        }
        sum
    };
    let of_picture = mean(&mut rgba.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]));
    let of_film = mean(&mut film.frames[0].0.iter().copied());
    for channel in 0..3 {
        let apart = (of_picture[channel] - of_film[channel]).abs();
        assert!(apart < 25.0, "{of_picture:?} {of_film:?}");
    }
}

#[test]
fn a_model_grows_in_its_film_and_its_end_stays() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let film = film(folder.path(), "recordings/scribble.ron", "grow");
    let counts: Vec<usize> = (0..8).map(|frame| drawn(&film, frame)).collect();
    assert!(counts[0] * 2 < counts[7] && counts.is_sorted(), "{counts:?}");
    let delays: Vec<u16> = film.frames.iter().map(|(_, delay)| *delay).collect();
    assert_eq!(delays, [10, 10, 10, 10, 10, 10, 10, 110]);
}

#[test]
fn the_recorded_head_moves_the_picture_and_without_one_there_is_no_such_film() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let film = film(folder.path(), "recordings/portrait.ron", "recorded");
    assert!((0..7).all(|frame| differing(&film, frame, frame + 1) > 50));

    let session = folder.path().join("headless.ron");
    let polygon = "Polygon(t: 0.0, vertices: [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], color: (1.0, 0.0, 0.0, 1.0))";
    fs::write(&session, format!("Header(format: 1, name: \"a\")\n{polygon}\n")).expect("written");
    let [session, out] =
        [session, folder.path().join("none.gif")].map(|path| path.to_str().expect("utf-8").to_owned());
    let (code, said) = osp(&["film", &session, &out, "--path", "recorded", "--size", "32x32"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("no head was recorded; `grow` and `turntable` need none"), "{said}");
    assert!(!Path::new(&out).exists());
    // One frame of a session is as many frames of a film as are asked for.
    let (code, said) =
        osp(&["film", &session, &out, "--path", "grow", "--size", "32x32", "--seconds", "0.3"]);
    assert_eq!(code, Some(0), "{said}");
    let film = Film::open(&out);
    assert_eq!(film.frames.len(), 6);
    assert!(drawn(&film, 0) > 20 && differing(&film, 0, 5) == 0);
}
