//! Files of potentially visible sets: refused with a message, or read, written again the same, and asked without harm.

use std::fs;

use osp::{
    glam::Vec3,
    index::DrawList,
    scene::PolygonId,
    visibility::pvs::{Pvs, PvsError},
};

use super::{
    input::{Input, below},
    known,
    memory::peak_of,
    scratch,
};

const MAGIC: &[u8] = b"osp pvs 1\n";
/// The sets themselves grow with the file; beyond that, buffers.
const MOST_BYTES: i64 = 64 << 20;

/// The first byte says how the others are used: 0 the whole file, 1 what is packed in it.
pub fn run(data: &[u8]) {
    let Some((how, data)) = data.split_first() else { return };
    let path = if how % 2 == 0 {
        scratch::file("a.pvs", data)
    } else {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(zstd::encode_all(data, 1).expect("zstd packs"));
        scratch::file("a.pvs", &bytes)
    };
    let (outcome, peak) = peak_of(|| Pvs::read(&path));
    let is_small = peak < MOST_BYTES + 8 * data.len() as i64;
    assert!(is_small || !known::PVS_BOMBS.is_on() && how % 2 == 0, "{peak} bytes held for {}", data.len());
    match outcome {
        Ok(pvs) => ask(&pvs, data),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("a.pvs"), "{text}");
            assert!(matches!(error, PvsError::Io { .. }) || text.contains("byte "), "{text}");
        }
    }
}

fn ask(pvs: &Pvs, data: &[u8]) {
    let again = scratch::path("b.pvs");
    pvs.write(&again).expect("written");
    assert_eq!(&Pvs::read(&again).expect("what was written is read"), pvs);
    let share = pvs.mean_share();
    assert!((0.0..=1.0).contains(&share) || !known::A_CHANGED_PVS_IS_REFUSED.is_on(), "a share of {share}");
    let mut u = Input::new(data);
    let cells = *pvs.cells();
    let ids: Vec<PolygonId> = (0..pvs.polygons().min(1000) as u32).map(PolygonId).collect();
    let mut eyes =
        vec![cells.min, cells.corner(cells.len() - 1) + Vec3::splat(cells.side_m), Vec3::NAN, Vec3::MAX];
    eyes.extend((0..8).map(|_| cells.corner(below(&mut u, cells.len())) + cells.side_m * 0.5));
    for eye in eyes {
        let mut drawn = DrawList::new();
        let is_in_a_cell = pvs.cull(eye, &ids, &mut drawn);
        assert!(is_in_a_cell || drawn.ids() == ids, "outside of the cells everything is drawn");
        assert!(drawn.ids().windows(2).all(|w| w[0] < w[1]), "each once");
    }
}

/// A sound file of which one byte is changed.
pub fn change_one_byte(sound: &[u8], at: usize, xor: u8) {
    let mut bytes = sound.to_vec();
    bytes[at] ^= xor;
    run(&[&[0], bytes.as_slice()].concat());
    if known::A_CHANGED_PVS_IS_REFUSED.is_on() {
        let path = scratch::file("a.pvs", &bytes);
        assert!(Pvs::read(&path).is_err(), "byte {at} changed by {xor:#x} is not noticed");
        let _ = fs::remove_file(path);
    }
}
