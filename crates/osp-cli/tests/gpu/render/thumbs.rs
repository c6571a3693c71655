//! `osp thumbs`: the pictures of `osp render`, one a session.

use std::{fs, path::Path};

use super::scenes::{gpu, read_png};
use crate::OSP;
use osp_testkit::{stderr, stdout};

/// Writes a session of two strokes that crosses the picture; `camera` is a part of its header.
fn write_session(path: &Path, camera: &str) {
    let mut text = format!("Header(format: 2, name: \"a\", source: \"test\"{camera})\n");
    for (stroke, brush) in ["Ink", "Light"].into_iter().enumerate() {
        text += &format!(
            "Begin(t: 0.0, stroke: {stroke}, tool: Ribbon, width: 0.2, color: (1.0, 0.5, 0.2, 1.0), paint: (brush: \"{brush}\"))\n"
        );
        for i in 0..20 {
            let (x, y) = (f64::from(i) * 0.1, stroke as f64 * 0.4);
            text += &format!("Point(t: 0.0, stroke: {stroke}, p: ({x}, {y}, {}))\n", x * 0.3);
        }
        text += &format!("End(t: 0.0, stroke: {stroke})\n");
    }
    fs::write(path, text).expect("a temporary folder can be written");
}

#[test]
fn thumbs_are_the_pictures_that_osp_render_draws() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("in/below")).expect("folders");
    write_session(&at("in/whole.ron"), "");
    let camera = ", camera: (p: (1.0, 0.2, 3.0), q: (0.0, 0.0, 0.0, 1.0), fov_degrees: 50.0)";
    write_session(&at("in/below/own.ron"), camera);
    fs::write(at("in/bad.ron"), "Header(format: 1)\nnonsense\n").expect("written");
    let thumbs = || OSP.run_in(folder.path(), ["thumbs", "in", "--out", "out", "--size", "96x64"]);
    let output = thumbs();
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(stdout(&output), "3 sessions: 2 drawn now, 0 before, 1 failed\n");
    assert!(stderr(&output).contains("bad.ron, line 2: expected "), "{}", stderr(&output));
    for (session, thumb) in [("in/whole.ron", "out/whole.png"), ("in/below/own.ron", "out/below/own.png")] {
        OSP.done_in(folder.path(), ["render", session, "one.png", "--size", "96x64", "--force"]);
        let picture = |name: &str| read_png(&at(name)).2;
        let pixels = picture(thumb);
        assert_eq!(pixels.len(), 96 * 64 * 4);
        assert!(pixels.chunks(4).any(|pixel| pixel != &pixels[..4]), "{thumb} is empty");
        assert!(pixels == picture("one.png"), "{thumb} differs from the picture of osp render");
    }
    fs::remove_file(at("in/bad.ron")).expect("removed");
    fs::remove_file(at("out/whole.png")).expect("removed");
    let output = thumbs();
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stdout(&output), "2 sessions: 1 drawn now, 1 before (--force makes them again), 0 failed\n");
    // A picture of another program stays, and so does a newer one of osp.
    fs::write(at("out/whole.png"), b"\x89PNG\r\n\x1a\nby hand").expect("written");
    let output = thumbs();
    assert!(stderr(&output).contains("whole.png: exists already; --force"), "{}", stderr(&output));
    assert_eq!(fs::read(at("out/whole.png")).expect("a picture"), b"\x89PNG\r\n\x1a\nby hand");
    // Beside a session its own name stays free for a picture of its artist's.
    OSP.done_in(folder.path(), ["thumbs", "in/whole.ron", "--size", "32x32"]);
    assert!(at("in/whole.thumb.png").is_file() && !at("in/whole.png").exists());
}
