use std::fs;

use osp_app::{Answer, Command};

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
        if table.studio.question().is_some() {
            table.studio.command(Command::Answer(Answer::Replace));
        }
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

/// A group may be placed so that its strokes are beyond all numbers.
#[test]
fn an_export_tells_of_what_it_leaves_out() {
    let mut table = Table::new();
    let folder = table.folder.path().to_owned();
    let face = |stroke: u32| {
        format!("Polygon(stroke:{stroke},vertices:[(1,0,0),(2,0,0),(1,1,0)],color:(1,1,1,1))\n")
    };
    let mut session = format!("Header(format:1,name:\"x\",source:\"y\")\n{}{}", face(1), face(2));
    for (group, parent) in [(1, ""), (2, ",parent:1"), (3, ",parent:2")] {
        session += &format!("Group(t:0,group:{group},strokes:[1]{parent})\n");
        session += &format!("Place(t:0,group:{group},to:(p:(0,0,0),q:(0,0,0,1),s:1e15))\n");
    }
    let (path, model) = (folder.join("far.ron"), folder.join("far.glb"));
    fs::write(&path, session).expect("written");
    table.studio.command(Command::Open(path));
    table.studio.command(Command::ExportGltf(model.clone()));
    let said = table.studio.messages();
    assert!(said[said.len() - 2].starts_with("1 polygons exported to"), "{said:?}");
    assert_eq!(said[said.len() - 1], "1 polygons at infinity were left out");
    assert!(!fs::read(&model).expect("there").windows(4).any(|word| word == b"null"));
}
