//! Sets of what can be seen from where: made, read, used, and refused where they do not belong.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::command::figure;
use crate::OSP;
use osp_testkit::{stderr, stdout};

/// A small furnished flat, and the sets of it.
struct Flat {
    folder: tempfile::TempDir,
    session: PathBuf,
    sets: PathBuf,
}

impl Flat {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (session, sets) = (folder.path().join("flat.ron"), folder.path().join("flat.pvs"));
        OSP.done(["synth", "room", "--polygons", "1500", "--seed", "3", name(&session)]);
        let args = ["--cells", "3", "--samples", "3", "--pixels", "96"];
        let baked = OSP.done([&["bake", name(&session), name(&sets)], &args[..]].concat());
        assert!(baked.contains("3 samples each"), "{baked}");
        Self { folder, session, sets }
    }
}

fn name(path: &Path) -> &str {
    path.to_str().expect("utf-8")
}

#[test]
fn sets_leave_out_what_is_hidden_and_verify_says_what_they_miss() {
    let flat = Flat::new();
    let (session, sets) = (name(&flat.session), name(&flat.sets));
    let common = ["--whole", "--pvs", sets, "--views", "4", "--pixels", "480x270", "--json"];
    let output = OSP.run([&["verify", session, "--occlusion", "msvbsp"], &common[..]].concat());
    // Sets promise nothing: what they miss is said, and is no failure.
    assert!(output.status.success(), "{}", stderr(&output));
    let report: Value = serde_json::from_str(&stdout(&output)).expect("JSON");
    let of = |name| figure(&report, "pvs (sampled)", name);
    assert_eq!((figure(&report, "", "views"), of("misreported")), (4.0, 0.0));
    assert!(of("hidden") > 20.0, "{report}");
    let visible = figure(&report, "", "visible") * 4.0;
    assert!(of("wrong") < visible * 0.5, "{visible}: {report}");
}

#[test]
fn sets_of_another_model_and_damaged_ones_are_refused() {
    let flat = Flat::new();
    let refused = |session: &str, sets: &Path, expected: &str| {
        let said = OSP.refused(["verify", session, "--whole", "--pvs", name(sets)]);
        assert!(said.contains(expected) && said.contains(name(sets)), "{said}");
    };
    refused("recordings/grow.ron", &flat.sets, "made of another model");
    let bytes = std::fs::read(&flat.sets).expect("sets");
    let damaged = flat.folder.path().join("damaged.pvs");
    let session = name(&flat.session);
    for (damage, expected) in
        [(&bytes[..bytes.len() / 2], "byte"), (b"Header(format:1)", "begins with `osp pvs 2`")]
    {
        std::fs::write(&damaged, damage).expect("written");
        refused(session, &damaged, expected);
    }
    OSP.refused(["verify", session, "--pvs", name(&flat.sets)]);
}
