use std::fs;

use osp::app::Command;

use crate::drawing::Table;

#[test]
fn an_export_replaces_models_and_nothing_else() {
    let mut table = Table::new();
    let folder = table.folder.path().to_owned();
    let (model, session, disguised) = (folder.join("m.glb"), folder.join("s.ron"), folder.join("d.glb"));
    let text = "Header(format: 1)\n";
    fs::write(&session, text).expect("written");
    fs::write(&disguised, text).expect("written");
    fs::write(&model, "glTF, an older one").expect("written");
    let mut export = |path: &std::path::Path| {
        table.studio.command(Command::ExportGltf(path.to_owned()));
        table.studio.messages().last().cloned().expect("a message")
    };
    assert!(export(&model).contains("exported to"));
    assert!(fs::read(&model).expect("there").starts_with(b"glTF\x02"));
    for path in [&session, &folder.join("p.obj")] {
        assert!(export(path).contains("expected a name that ends in .glb"));
    }
    assert!(export(&disguised).contains("holds a session, not a model"));
    for path in [&session, &disguised] {
        assert_eq!(fs::read_to_string(path).expect("there"), text);
    }
    assert!(!folder.join("p.obj").exists());
    let left = fs::read_dir(&folder).expect("a folder").filter(|entry| {
        entry.as_ref().is_ok_and(|entry| entry.file_name().to_string_lossy().starts_with(".unfinished"))
    });
    assert_eq!(left.count(), 0);
}
