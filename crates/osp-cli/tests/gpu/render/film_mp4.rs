//! `osp film` in MP4, read by a decoder.

use std::path::Path;

use super::{decoded_film::Film, decoded_mp4::Mp4Film, scenes::gpu};
use crate::OSP;
use osp_testkit::{stderr, temp};

/// Films a shipped session for 0.8 seconds at ten pictures a second.
fn film(session: &str, out: &Path, path: &str, size: &str) -> String {
    let out = out.to_str().expect("utf-8");
    let args = ["film", session, out, "--path", path, "--size", size, "--seconds", "0.8", "--fps", "10"];
    let output = OSP.run(args);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    said
}

fn mp4(path: &Path) -> Mp4Film {
    Mp4Film::open(path.to_str().expect("utf-8"))
}

/// Mean difference of a channel of a pixel, of 0 to 255.
fn apart(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    let sum: u64 =
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / (a.len() * 3) as f64
}

#[test]
fn an_mp4_shows_the_pictures_of_the_gif() {
    let Some(_) = gpu() else { return };
    let folder = temp();
    for (session, path, end) in
        [("recordings/room.ron", "turntable", 0), ("recordings/portrait.ron", "recorded", 10)]
    {
        let [gif, mp4_file] = [".gif", ".mp4"].map(|ending| folder.path().join(format!("{path}{ending}")));
        film(session, &gif, path, "160x90");
        film(session, &mp4_file, path, "160x90");
        let (gif, mp4) = (Film::open(gif.to_str().expect("utf-8")), mp4(&mp4_file));
        assert_eq!((gif.frames.len(), mp4.pictures.len()), (8, 8 + end), "{path}");
        assert_eq!((gif.size, mp4.size), ((160, 90), (160, 90)), "{path}");
        assert!((mp4.seconds - (8 + end) as f64 / 10.0).abs() < 1.0e-9, "{path}: {} s", mp4.seconds);
        assert_eq!(mp4.keys, [0], "{path}");
        assert!(mp4.head_is_first, "{path}");
        for frame in 0..8 {
            let same = apart(&gif.frames[frame].0, &mp4.pictures[frame]);
            assert!(same < 4.0, "{path}, frame {frame}: {same}");
            let other = apart(&gif.frames[(frame + 4) % 8].0, &mp4.pictures[frame]);
            assert!(other > 2.0 * same, "{path}, frame {frame}: {other} and {same}");
        }
        for still in 8..mp4.pictures.len() {
            let moved = apart(&mp4.pictures[7], &mp4.pictures[still]);
            assert!(moved < 2.0, "{path}, picture {still}: {moved}");
        }
    }
}

#[test]
fn a_player_can_jump_every_two_seconds() {
    let Some(_) = gpu() else { return };
    let folder = temp();
    let out = folder.path().join("long.mp4");
    let args = ["film", "recordings/scribble.ron", out.to_str().expect("utf-8"), "--size", "32x32"];
    OSP.done(args.into_iter().chain(["--seconds", "5", "--fps", "6"]));
    let film = mp4(&out);
    assert_eq!((film.pictures.len(), film.seconds), (30, 5.0));
    assert_eq!(film.keys, [0, 12, 24]);
}

#[test]
fn odd_sides_of_an_mp4_grow_by_a_pixel() {
    let Some(_) = gpu() else { return };
    let folder = temp();
    let out = folder.path().join("odd.mp4");
    let said = film("recordings/scribble.ron", &out, "grow", "97x55");
    assert!(said.contains("97x55 pixels become 98x56: a video has even sides"), "{said}");
    assert_eq!(mp4(&out).size, (98, 56));
    let even = folder.path().join("even.mp4");
    let said = film("recordings/scribble.ron", &even, "grow", "98x56");
    assert!(!said.contains("become"), "{said}");
}
