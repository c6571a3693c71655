//! Damaged and forged worlds: one clear error that names the object, the byte and what was expected; never a panic, and no memory for
//! what is only claimed.

use std::{fs, path::Path, path::PathBuf, time::Instant};

use glam::Vec3;
use osp_net::world::{Missing, PackOrder, Replacing, World, WorldError, WorldWriter};
use osp_session::{
    recording::SynthKind,
    replay::{CameraChoice, CameraPath, Moment},
};
use proptest::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use super::{open, place_to_read, place_to_write, session, temp, walk};

const MANIFEST: &str = "manifest.osp-world";
/// Of a block in the manifest.
const ENTRY_BYTES: usize = 40;

/// A world of a few blocks, brushes that need boxes among them.
fn small(folder: &Path) -> PathBuf {
    let mut writer =
        WorldWriter::create(place_to_write(folder), Replacing::Never, PackOrder::Space).expect("begun");
    for kind in [SynthKind::Brushes, SynthKind::Room] {
        writer.add("session", &session(kind, 5_000, 1), &[Vec3::ZERO]).expect("blocks");
    }
    writer.finish().expect("packed");
    let blocks = fs::read_dir(folder.join("blocks")).expect("a folder").next();
    blocks.expect("an object").expect("an entry").path()
}

/// Gives a manifest the checksum that fits.
fn sealed(mut manifest: Vec<u8>) -> Vec<u8> {
    let body = manifest.len() - 8;
    let hash = xxh3_64(&manifest[..body]);
    manifest[body..].copy_from_slice(&hash.to_le_bytes());
    manifest
}

/// Opens a world and loads all of it.
fn all_of(folder: &Path) -> Result<(), WorldError> {
    let world = World::open(place_to_read(folder))?;
    for number in 0..world.manifest.blocks.len() as u32 {
        world.load(number)?;
    }
    Ok(())
}

fn error_of(folder: &Path) -> String {
    let error = all_of(folder).expect_err("damaged");
    assert!(matches!(error, WorldError::Damaged { .. } | WorldError::Object { .. }), "{error}");
    error.to_string()
}

#[test]
fn a_manifest_cut_off_anywhere_is_refused() {
    let folder = temp();
    small(folder.path());
    let path = folder.path().join(MANIFEST);
    let whole = fs::read(&path).expect("a manifest");
    all_of(folder.path()).expect("whole");
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).expect("written");
        let said = error_of(folder.path());
        assert!(
            said.contains(MANIFEST) && said.contains("byte ") && said.contains("expected "),
            "{length}: {said}"
        );
    }
    fs::write(&path, [&whole[..], b"more"].concat()).expect("written");
    assert!(error_of(folder.path()).contains("checksum"));
    // Even if the checksum fits.
    fs::write(&path, sealed([&whole[..], b"12345678"].concat())).expect("written");
    assert!(error_of(folder.path()).contains("the end"));
}

#[test]
fn a_manifest_that_claims_much_reserves_nothing() {
    let folder = temp();
    small(folder.path());
    let path = folder.path().join(MANIFEST);
    let whole = fs::read(&path).expect("a manifest");
    let start = Instant::now();
    for (at, length) in [(12, 8), (28, 4), (32, 4)] {
        for claim in [1_000_000_000_000u64, u64::MAX, 0xffff_ffff] {
            let mut forged = whole.clone();
            forged[at..at + length].copy_from_slice(&claim.to_le_bytes()[..length]);
            fs::write(&path, sealed(forged)).expect("written");
            let said = error_of(folder.path());
            assert!(said.contains("byte 36: expected ") && said.contains("bytes for"), "{said}");
        }
    }
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn another_version_and_another_file_are_named() {
    let folder = temp();
    small(folder.path());
    let path = folder.path().join(MANIFEST);
    let mut other = fs::read(&path).expect("a manifest");
    other[10] = b'2';
    fs::write(&path, sealed(other)).expect("written");
    assert!(error_of(folder.path()).contains("byte 10: expected version 1 of the format; found `2`"));
    fs::write(&path, "Header(format: 1)\n".repeat(5)).expect("written");
    assert!(error_of(folder.path()).contains("byte 0: expected `osp world 1`"));
}

#[test]
fn damaged_short_and_missing_objects_are_named() {
    let folder = temp();
    let object = small(folder.path());
    let name = object.file_name().expect("a name").to_str().expect("UTF-8");
    let whole = fs::read(&object).expect("blocks");
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 4;
    fs::write(&object, &flipped).expect("written");
    let said = error_of(folder.path());
    assert!(said.contains(name) && said.contains("byte ") && said.contains("checksum"), "{said}");
    // A walk that meets it says the same, whether it waits or not.
    let world = open(folder.path());
    let view = CameraPath::new(CameraChoice::Orbit, None, &world.bounds).view(&Moment::default());
    let mut waiting = walk(&world, 1 << 30, 2);
    assert_eq!(waiting.frame(&view, None, Missing::Wait).expect_err("damaged").to_string(), said);
    let mut counting = walk(&world, 1 << 30, 2);
    let start = Instant::now();
    let later = loop {
        match counting.frame(&view, None, Missing::Count) {
            Ok(_) => assert!(start.elapsed().as_secs() < 60, "the damage is passed over"),
            Err(error) => break error.to_string(),
        }
    };
    assert_eq!(later, said);
    fs::write(&object, &whole[..whole.len() - 100]).expect("written");
    assert!(error_of(folder.path()).contains(name));
    fs::write(&object, []).expect("written");
    assert!(error_of(folder.path()).contains(name));
    fs::remove_file(&object).expect("removed");
    let said = error_of(folder.path());
    assert!(said.contains(name) && said.matches("No such file").count() <= 1, "{said}");
}

/// Changes a block, if it has what is changed.
type Change<'a> = &'a dyn Fn(&mut [u8]) -> bool;

/// Changes the first block that has what is changed, and gives it the checksums that fit.
fn forge(folder: &Path, object: &Path, change: Change<'_>) {
    let path = folder.join(MANIFEST);
    let mut manifest = fs::read(&path).expect("a manifest");
    let mut blocks = fs::read(object).expect("blocks");
    let count = open(folder).manifest.blocks.len();
    let mut begin = 0;
    for entry in (0..count).map(|number| manifest.len() - 8 - ENTRY_BYTES * (count - number)) {
        let bytes = u32_at(&manifest, entry) as usize;
        let block = &mut blocks[begin..begin + bytes];
        begin += bytes;
        if change(block) {
            let hash = xxh3_64(block);
            manifest[entry + 8..entry + 16].copy_from_slice(&hash.to_le_bytes());
            fs::write(&path, sealed(manifest)).expect("written");
            fs::write(object, blocks).expect("written");
            return;
        }
    }
    panic!("no block has what is to be changed");
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4"))
}

#[test]
fn a_forged_block_is_refused_although_its_checksums_fit() {
    const PIECES: usize = 16;
    const PIECE_BYTES: usize = 24;
    const POLYGON_BYTES: usize = 48;
    const BOX_BYTES: usize = 28;
    let set = |block: &mut [u8], at: usize, to: u32| block[at..at + 4].copy_from_slice(&to.to_le_bytes());
    let corners = |block: &[u8]| PIECES + PIECE_BYTES * u32_at(block, 8) as usize;
    let boxes = |block: &[u8]| corners(block) + POLYGON_BYTES * u32_at(block, 4) as usize;
    // One of several polygons.
    let piece = |block: &[u8]| {
        (PIECES..corners(block)).step_by(PIECE_BYTES).find(|&piece| u32_at(block, piece + 4) > 1)
    };
    let cases: [(&str, Change<'_>); 6] = [
        // What is outside of the box of its block could be seen where the block is not.
        ("a polygon in the box of its block", &|block| {
            let has_box: Vec<u32> =
                (boxes(block)..block.len()).step_by(BOX_BYTES).map(|at| u32_at(block, at)).collect();
            let Some(polygon) = (0..u32_at(block, 4)).find(|at| !has_box.contains(at)) else { return false };
            let at = corners(block) + POLYGON_BYTES * polygon as usize;
            (0..12).for_each(|i| set(block, at + 4 * i, 1.0e6f32.to_bits()));
            true
        }),
        // Or by the box that it brings with it: this is the greatest x.
        ("a polygon in the box of its block", &|block| {
            let at = boxes(block);
            if at < block.len() {
                set(block, at + 16, 1.0e6f32.to_bits());
            }
            at < block.len()
        }),
        ("finite corners", &|block| {
            set(block, corners(block), f32::NAN.to_bits());
            true
        }),
        ("polygons, as in the manifest", &|block| {
            set(block, 4, u32_at(block, 4) - 1);
            true
        }),
        ("pieces that name every polygon", &|block| {
            let Some(piece) = piece(block) else { return false };
            set(block, piece + 4, u32_at(block, piece + 4) - 1);
            true
        }),
        ("polygons with numbers of 32 bits", &|block| {
            let Some(piece) = piece(block) else { return false };
            set(block, piece, u32::MAX);
            true
        }),
    ];
    for (expected, change) in cases {
        let folder = temp();
        let object = small(folder.path());
        forge(folder.path(), &object, &|_| true);
        all_of(folder.path()).expect("nothing is changed yet");
        forge(folder.path(), &object, change);
        let said = error_of(folder.path());
        let name = object.file_name().expect("a name").to_str().expect("UTF-8");
        assert!(
            said.contains(name) && said.contains("byte ") && said.contains(expected),
            "{expected}: {said}"
        );
    }
}

/// A pipe would wait for somebody who writes into it.
#[cfg(unix)]
#[test]
fn pipes_in_the_place_of_objects_are_refused() {
    for is_block in [false, true] {
        let folder = temp();
        let object = small(folder.path());
        let path = if is_block { object } else { folder.path().join(MANIFEST) };
        fs::remove_file(&path).expect("removed");
        assert!(osp_testkit::make_pipe(&path));
        let said = error_of(folder.path());
        assert!(said.ends_with("expected a regular file; found a pipe or a device"), "{said}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_damage_makes_it_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0u8..8), 1..6),
        in_block in any::<bool>(),
        block in any::<prop::sample::Index>(),
        is_sealed in any::<bool>(),
    ) {
        thread_local! {
            static WORLD: (tempfile::TempDir, PathBuf, Vec<u8>, Vec<u8>) = {
                let folder = temp();
                let object = small(folder.path());
                let manifest = fs::read(folder.path().join(MANIFEST)).expect("a manifest");
                let blocks = fs::read(&object).expect("blocks");
                (folder, object, manifest, blocks)
            };
        }
        WORLD.with(|(folder, object, manifest, blocks)| {
            let whole = manifest;
            let (mut manifest, mut blocks) = (manifest.clone(), blocks.clone());
            fs::write(folder.path().join(MANIFEST), &manifest).expect("written");
            let world = World::open(place_to_read(folder.path())).expect("whole");
            let count = world.manifest.blocks.len();
            if in_block {
                // The beginning, where the counts and pieces are, or anywhere; the manifest says that it has to be so.
                let entry = |number: usize| manifest.len() - 8 - ENTRY_BYTES * (count - number);
                let bytes = |number: usize| {
                    u32::from_le_bytes(manifest[entry(number)..entry(number) + 4].try_into().expect("4")) as usize
                };
                let number = block.index(count);
                let begin: usize = (0..number).map(bytes).sum();
                let range = begin..begin + bytes(number);
                for (at, bit) in &flips {
                    let span = if *bit < 4 { 64 } else { range.len() };
                    blocks[range.start + at.index(span)] ^= 1 << bit;
                }
                let hash = xxh3_64(&blocks[range]);
                let at = entry(number) + 8;
                manifest[at..at + 8].copy_from_slice(&hash.to_le_bytes());
                manifest = sealed(manifest);
            } else {
                for (at, bit) in &flips {
                    let at = at.index(manifest.len());
                    manifest[at] ^= 1 << bit;
                }
                if is_sealed {
                    manifest = sealed(manifest);
                }
            }
            fs::write(folder.path().join(MANIFEST), &manifest).expect("written");
            fs::write(object, &blocks).expect("written");
            // Damage of a colour or a number is none that can be seen; all other is an error that says where.
            if let Err(error) = all_of(folder.path()) {
                let said = error.to_string();
                prop_assert!(said.contains("osp-"), "{}", said);
            } else {
                // Two flips of one bit are none.
                let is_whole = manifest == *whole;
                prop_assert!(in_block || is_sealed || is_whole, "an unsealed change is found");
            }
            Ok(())
        })?;
    }
}
