//! What a `.tilt` says that cannot be used is left out alone, and said once.

use crate::files::{METADATA, small_sketch, write};
use osp::recording::{Header, OpenOptions, open};

/// The header of a sketch with these metadata, and what the reader warns of.
fn header_of(metadata: &str, lenient: bool) -> (Header, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "data.sketch", &small_sketch().0);
    write(folder.path(), "metadata.json", metadata.as_bytes());
    let options = OpenOptions { lenient, ..OpenOptions::default() };
    let mut session = open(folder.path(), &options).unwrap();
    assert_eq!(session.header.check(), Ok(()));
    while session.events.next_event().unwrap().is_some() {}
    (session.header, session.events.notes().warnings)
}

fn with_canvas(transform: &str) -> String {
    METADATA.replacen('{', &format!("{{\"CanvasTransformInSceneSpace\":{transform},"), 1)
}

#[test]
fn a_camera_that_cannot_be_is_named() {
    let (whole, warnings) = header_of(METADATA, false);
    assert!(whole.camera.is_some() && warnings.is_empty(), "{warnings:?}");
    let scene = "[0.0,0.70710678,0.0,0.70710678],0.5";
    let camera = "[[6.0,2.0,3.0],[0.0,0.70710678,0.0,0.70710678],1.0]";
    for (from, to, expected) in [
        (scene, "[0,0,0,1],0", "a scale above 0 in `SceneTransformInRoomSpace`"),
        (scene, "[0,0,0,1],-1", "a scale above 0 in `SceneTransformInRoomSpace`"),
        (scene, "[0,0,0,0],1", "a rotation and a scale above 0"),
        (scene, "[0,0,0,1],1e-38", "finite coordinates below 1e15 m of the thumbnail's camera"),
        (camera, "[[1e38,2,3],[0,0,0,1],1]", "finite coordinates below 1e15 m of the thumbnail's camera"),
        (camera, "[[6,2,3],[0,0,0,0],1]", "a unit quaternion (x, y, z, w) of the thumbnail's camera"),
        (camera, "\"x\"", "a sound `ThumbnailCameraTransformInRoomSpace`"),
        (camera, "[[6,2,3]]", "a sound `ThumbnailCameraTransformInRoomSpace`"),
    ] {
        let metadata = METADATA.replace(from, to);
        assert_ne!(metadata, METADATA);
        let (header, warnings) = header_of(&metadata, false);
        let [warning] = &warnings[..] else { panic!("{to}: {warnings:?}") };
        assert!(warning.contains(expected) && warning.contains("read without it"), "{to}: {warning}");
        assert!(warning.contains("metadata.json"), "{warning}");
        // All else is read.
        assert_eq!(header, Header { camera: None, ..whole.clone() }, "{to}");
    }
}

#[test]
fn an_environment_that_cannot_be_is_named() {
    let (header, warnings) = header_of(&with_canvas("[[0,0,0],[0,0,0,1],1e9]"), false);
    assert_eq!(header.environment, None);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("density of fog") && warning.contains("read without it"), "{warning}");
    // A canvas that nobody knows how to turn back: the light stays as it is in the scene.
    let (usual, _) = header_of(METADATA, false);
    for bad in ["[[0,0,0],[0,0,0,1],-1]", "[[0,0,0],[0,0,0,0],1]"] {
        let (header, warnings) = header_of(&with_canvas(bad), false);
        let [warning] = &warnings[..] else { panic!("{bad}: {warnings:?}") };
        assert!(warning.contains("CanvasTransformInSceneSpace"), "{warning}");
        assert!(warning.contains("without a camera"), "{warning}");
        assert_eq!(header, Header { camera: None, ..usual.clone() });
    }
}

#[test]
fn a_damaged_field_takes_no_other_with_it() {
    let (whole, _) = header_of(METADATA, false);
    let (header, warnings) = header_of(&METADATA.replace("\"Ann\"", "12"), false);
    assert_eq!(header, Header { source: "Tilt Brush".to_owned(), ..whole.clone() });
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("a sound `Authors`"), "{warning}");
    // A table of brushes that cannot be read is an error; a lenient reader keeps the rest.
    let (header, warnings) = header_of(&METADATA.replace("[\"2d35bcf0", "[1,\"2d35bcf0"), true);
    assert_eq!(header, whole);
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("`BrushIndex`") && warning.contains("read without it"), "{warning}");
}
