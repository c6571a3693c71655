//! A machine without Vulkan has OpenGL, perhaps: the pictures are the same, or it is said what cannot be had.

use std::path::Path;

use super::scenes::{gpu, read_png};
use crate::OSP;
use osp_testkit::stderr;

fn render(backend: &str, session: &str, out: &Path, more: &[&str]) -> (Option<i32>, String) {
    let output = OSP
        .command(["render", session])
        .env("WGPU_BACKEND", backend)
        .arg(out)
        .args(["--size", "256x256", "--force"])
        .args(more)
        .output()
        .expect("osp");
    (output.status.code(), stderr(&output))
}

fn has_opengl(folder: &Path) -> bool {
    let (code, said) = render("gl", "recordings/scribble.ron", &folder.join("try.png"), &[]);
    let has = said.contains("(gl)");
    assert!(!has || code == Some(0), "{said}");
    if !has {
        assert!(!osp_testkit::nothing_may_be_skipped(), "{said}");
        eprintln!("skipped: {said}");
    }
    has
}

#[test]
fn opengl_draws_the_same_pictures_as_vulkan() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    if !has_opengl(folder.path()) {
        return;
    }
    let brushes = folder.path().join("brushes.ron");
    OSP.done([
        "synth".as_ref(),
        "brushes".as_ref(),
        "--polygons".as_ref(),
        "2400".as_ref(),
        brushes.as_os_str(),
    ]);
    for session in ["recordings/portrait.ron", &brushes.to_string_lossy()] {
        let [ours, theirs] = ["gl", "vulkan"].map(|backend| {
            let out = folder.path().join(format!("{backend}.png"));
            let (code, said) = render(backend, session, &out, &[]);
            assert!(code == Some(0) && said.contains(&format!("({backend})")), "{said}");
            read_png(&out).2
        });
        assert_eq!(ours.len(), theirs.len());
        let differences = ours.iter().zip(&theirs).map(|(a, b)| u64::from(a.abs_diff(*b)));
        let mean = differences.sum::<u64>() as f64 / ours.len() as f64;
        assert!(mean < 1.0, "{session}: the pictures differ by {mean:.2} of 255 on average");
        // They show something.
        let first = &theirs[..3];
        assert!(theirs.chunks(4).filter(|pixel| &pixel[..3] != first).count() > 2000, "{session}");
    }
}
