//! Counts and sizes that are lies: an error, and no memory spent on them.

use std::path::Path;

use zip::CompressionMethod;

use super::files::{
    Bytes, METADATA, apa, gzip, raw_points, read, sketch, sketch_stroke, small_sketch, tilt, write,
};
use osp_testkit::peak_of;

/// Most that may be held while a forged file is read; what the counts below claim is 70 GiB and more.
const MOST_BYTES: i64 = 128 << 20;

/// Reads a file in both modes; the strict one must fail. Gives its error.
fn refused(path: &Path) -> String {
    let ([_, strict], peak) = peak_of(|| [true, false].map(|lenient| read(path, lenient)));
    assert!(peak < MOST_BYTES, "{}: {peak} bytes held", path.display());
    strict.error.map(|error| error.to_string()).unwrap_or_else(|| panic!("{} was read", path.display()))
}

fn sketch_folder(folder: &Path, sketch: &Bytes) {
    write(folder, "data.sketch", &sketch.0);
    write(folder, "metadata.json", METADATA.as_bytes());
}

#[test]
fn forged_counts_of_a_sketch() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let stroke = sketch_stroke([1.0; 4], 1.0, 1.0, &raw_points(2, [0.0; 3], 0));
    let whole = sketch(5, &[stroke]).0;
    // Offsets: strokes at 16, in the stroke the masks at 24 and 28, the points at 48.
    for (offset, forged) in [
        (16, 0x7FFF_FFFF),
        (16, 0xFFFF_FFFF),
        (12, 0xFFFF_FFFF),
        (20 + 24, 0xFFFF_FFFF),
        (20 + 28, 0xFFFF_FFFF),
        (20 + 48, 0x7FFF_FFFF),
        (20 + 48, 0x8000_0000),
    ] {
        let mut bytes = whole.clone();
        bytes[offset..offset + 4].copy_from_slice(&u32::to_le_bytes(forged));
        sketch_folder(folder, &Bytes(bytes));
        let error = refused(folder);
        assert!(error.contains("data.sketch, byte "), "{error}");
    }
    sketch_folder(folder, &Bytes([whole.clone(), vec![0]].concat()));
    assert!(refused(folder).contains("the end of the data after 1 strokes"));
}

#[test]
fn forged_counts_of_a_drawing() {
    let folder = tempfile::tempdir().unwrap();
    let whole = apa(&[([1.0; 3], 0.1, raw_points(2, [0.0; 3], 0))]);
    let strokes = whole.len() - 2 * 36 - 21 - 4;
    for (offset, forged) in [(strokes, u32::MAX), (strokes, 0x7FFF_FFFF), (strokes + 4 + 17, u32::MAX)] {
        let mut bytes = whole.clone();
        bytes[offset..offset + 4].copy_from_slice(&forged.to_le_bytes());
        let error = refused(&write(folder.path(), "a.apa", &bytes));
        assert!(error.contains("a.apa, byte "), "{error}");
    }
}

#[test]
fn forged_sizes_of_a_zip() {
    let folder = tempfile::tempdir().unwrap();
    let sketch = small_sketch().0;
    let whole =
        tilt(&[("data.sketch", &sketch), ("metadata.json", METADATA.as_bytes())], CompressionMethod::Stored);
    let central: Vec<usize> =
        whole.windows(4).enumerate().filter(|(_, w)| w == b"PK\x01\x02").map(|(at, _)| at).collect();
    let end = whole.windows(4).rposition(|w| w == b"PK\x05\x06").unwrap();
    // Packed and unpacked size, name and extra length in the directory; counts and size of the directory at the end.
    let lies = central.iter().flat_map(|at| [(at + 20, 4), (at + 24, 4), (at + 28, 2), (at + 30, 2)]);
    for (offset, width) in lies.chain([(end + 8, 2), (end + 10, 2), (end + 12, 4), (end + 16, 4)]) {
        for forged in [0x7FFF_FFFF_u32, 0xFFFF_FFFE, 0] {
            let mut bytes = whole.clone();
            bytes[offset..offset + width].copy_from_slice(&forged.to_le_bytes()[..width]);
            let path = write(folder.path(), "a.tilt", &bytes);
            let (_, peak) = peak_of(|| [true, false].map(|lenient| read(&path, lenient)));
            assert!(peak < MOST_BYTES, "{forged:#x} at {offset}: {peak} bytes held");
        }
    }
    // A directory that says the sketch is longer than the file.
    let mut bytes = whole.clone();
    bytes[central[0] + 20..central[0] + 24].copy_from_slice(&0x7FFF_FFFF_u32.to_le_bytes());
    refused(&write(folder.path(), "a.tilt", &bytes));
}

/// A deflated entry can unpack to a thousand times its size; it is never held as a whole.
#[test]
fn a_sketch_that_unpacks_to_much_is_refused_at_its_first_point() {
    let folder = tempfile::tempdir().unwrap();
    let head = sketch(5, &[]).0;
    let mut bomb = head[..16].to_vec();
    bomb.extend(1_u32.to_le_bytes());
    bomb.extend(sketch_stroke([1.0; 4], 1.0, 1.0, &[]).0);
    let count = bomb.len() - 4;
    bomb[count..].copy_from_slice(&0x7FFF_FFFF_u32.to_le_bytes());
    bomb.resize(200 << 20, 0);
    let metadata = [b"{\"Authors\":[\"".as_slice(), &[b'a'; 1000], b"\"]}"].concat();
    let entries: [(&str, &[u8]); 2] = [("data.sketch", &bomb), ("metadata.json", &metadata)];
    let path = write(folder.path(), "a.tilt", &tilt(&entries, CompressionMethod::Deflated));
    drop(bomb);
    let error = refused(&path);
    assert!(error.contains("a unit quaternion") && error.contains("stroke 0"), "{error}");
}

#[test]
fn metadata_without_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let sketch = small_sketch().0;
    let long = vec![b' '; 17 << 20];
    let entries: [(&str, &[u8]); 2] = [("data.sketch", &sketch), ("metadata.json", &long)];
    // Packed it is too much for the size of the file; unpacked for any.
    let packed = write(folder.path(), "packed.tilt", &tilt(&entries, CompressionMethod::Deflated));
    assert!(refused(&packed).contains("--max-polygons"), "{}", refused(&packed));
    let path = write(folder.path(), "a.tilt", &tilt(&entries, CompressionMethod::Stored));
    assert!(refused(&path).contains("at most 16 MiB"), "{}", refused(&path));
    assert_eq!(read(&path, true).events.len(), 17, "the strokes do not need it");
}

#[test]
fn lines_without_end_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let long = [b"v 0 0 0\nf ".as_slice(), &[b'1'; 70_000], b"\nv 1 2 3\n"].concat();
    for (name, bytes) in [("a.obj", long.clone()), ("b.obj.gz", gzip(&long)), ("c.poses", long)] {
        let path = write(folder.path(), name, &bytes);
        let error = refused(&path);
        assert!(error.contains(", line "), "{error}");
    }
    // And lines that go on and on.
    let endless = b"v 0 0 0\\\n".repeat(20_000);
    let path = write(folder.path(), "d.obj", &endless);
    assert!(refused(&path).contains("a shorter line"));
}

#[test]
fn nested_json_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for deep in ["[".repeat(1 << 20), format!("{{\"x\":{}", "[".repeat(1 << 20))] {
        let path = write(folder.path(), "a.json", deep.as_bytes());
        assert!(refused(&path).contains("a.json, line 1"));
    }
}
