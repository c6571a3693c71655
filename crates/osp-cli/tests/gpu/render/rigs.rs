//! `osp render --rig`: a picture for each screen and eye.

use std::{collections::BTreeMap, fs, path::Path, process::Output};

use super::scenes::{gpu, read_png};
use crate::OSP;
use osp_testkit::{shipped_session, stderr, stdout};

fn osp(args: &[&str], folder: &Path) -> Output {
    let room = shipped_session("room");
    let common = ["render", &room, "--frame", "500", "--camera", "recorded", "--size", "100x90"];
    OSP.run_in(folder, [&common, args].concat())
}

fn said(output: &Output) -> String {
    format!("{}{}", stderr(output), stdout(output))
}

type Picture = (u32, u32, Vec<u8>);

/// The pictures in a folder, by name.
fn pictures(folder: &Path) -> BTreeMap<String, Picture> {
    let mut pictures = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|ending| ending != "png") {
            continue;
        }
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        pictures.insert(name, read_png(&path));
    }
    pictures
}

#[test]
fn each_screen_and_eye_has_a_picture_of_its_shape() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let output = osp(&["one.png", "--rig", "dual-wall", "--stereo", "mono"], folder.path());
    assert!(output.status.success(), "{}", said(&output));
    let seen = pictures(folder.path());
    // 2.4 m by 1.8 m.
    let sizes: Vec<_> =
        seen.iter().map(|(name, (width, height, _))| (name.as_str(), *width, *height)).collect();
    assert_eq!(sizes, [("one-left.png", 120, 90), ("one-right.png", 120, 90)]);

    for method in ["none", "msvbsp", "depth-last", "hzb"] {
        let args = ["two.png", "--force", "--rig", "dual-wall", "--occlusion", method, "--check"];
        let output = osp(&args, folder.path());
        assert!(
            output.status.success() && said(&output).contains("culling changes no pixel"),
            "{}",
            said(&output)
        );
    }
    let names = ["left-left-eye", "left-right-eye", "right-left-eye", "right-right-eye"];
    let stereo = pictures(folder.path());
    let two: Vec<&Picture> = names.iter().map(|name| &stereo[&format!("two-{name}.png")]).collect();
    assert_eq!(stereo.len(), 6);
    for (i, a) in two.iter().enumerate() {
        assert_eq!((a.0, a.1), (120, 90));
        assert!(two[..i].iter().all(|b| b != a), "each eye sees something else");
    }
}

/// Where two screens meet, their pictures do.
#[test]
fn pictures_of_neighbouring_screens_fit_together() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let args = ["a.png", "--rig", "dual-wall", "--stereo", "mono", "--size", "1x360"];
    let room = shipped_session("room");
    let common = ["render", &room, "--frame", "500", "--camera", "recorded"];
    OSP.done_in(folder.path(), [&common[..], &args].concat());
    let seen = pictures(folder.path());
    let (left, right) = (&seen["a-left.png"], &seen["a-right.png"]);
    assert_eq!((left.0, left.1), (480, 360));
    let channels = left.2.len() / (480 * 360);
    let column = |picture: &Picture, x: usize| -> Vec<Vec<u8>> {
        (0..360).map(|y| picture.2[(y * 480 + x) * channels..][..3].to_vec()).collect()
    };
    let differing = |a: &[Vec<u8>], b: &[Vec<u8>]| {
        let far = |(a, b): &(&Vec<u8>, &Vec<u8>)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 16);
        a.iter().zip(b).filter(far).count()
    };
    let meet = differing(&column(left, 479), &column(right, 0));
    let apart = differing(&column(left, 0), &column(right, 479));
    assert!(meet < 12 && apart > 100, "{meet} of 360 pixels differ at the edge, {apart} at the other ones");
}

#[test]
fn screens_behind_the_head_have_no_picture_and_files_are_not_replaced_unasked() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let screen = |name: &str, x: f32| {
        format!(
            "(name:\"{name}\",lower_left:({x:?},0.6,-1.0),lower_right:({:?},0.6,-1.0),upper_left:({x:?},1.6,-1.0))",
            -x
        )
    };
    // Two screens of one name, one with no name for a file, and one that the head is behind.
    let screens = [screen("a/b", -1.0), screen("A-b", -0.5), screen("back", 1.0)].join(",");
    let rig = format!("(name: \"odd\", head: (0.0, 1.0, 0.0), screens: [{screens}])");
    fs::write(folder.path().join("odd.rig"), rig).expect("written");
    let output = osp(&["o.png", "--rig", "odd.rig"], folder.path());
    assert!(output.status.success(), "{}", said(&output));
    assert!(
        said(&output).contains("no picture: the eye is not in front of the screen `back`"),
        "{}",
        said(&output)
    );
    let seen = pictures(folder.path());
    let sizes: Vec<_> =
        seen.iter().map(|(name, (width, height, _))| (name.as_str(), *width, *height)).collect();
    assert_eq!(sizes, [("o-A-b-1.png", 90, 90), ("o-a-b.png", 180, 90)]);

    let path = folder.path().join("o-a-b.png");
    fs::write(&path, "not a picture").expect("written");
    let output = osp(&["o.png", "--rig", "odd.rig"], folder.path());
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("o-a-b.png"), "{}", said(&output));
    assert_eq!(fs::read(&path).expect("there"), b"not a picture");
    let output = osp(&["o.png", "--rig", "odd.rig", "--force"], folder.path());
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(pictures(folder.path()), seen);

    // A row of frames.
    let room = shipped_session("portrait");
    let every = ["--every", "400", "--to", "frames", "--size", "32x18", "--rig", "odd.rig"];
    OSP.done_in(folder.path(), [&["render", &room], &every[..]].concat());
    let names: Vec<String> = pictures(&folder.path().join("frames")).into_keys().collect();
    assert!(names.len() >= 4 && names[0] == "000-A-b-1.png", "{names:?}");
}
