//! Files of potentially visible sets: refused with a message, or read, written again the same, and asked without harm.

use std::{fs, sync::LazyLock};

use super::{
    input::{Input, below},
    scratch,
};
use osp::{glam::Vec3, polygon::PolygonId};
use osp_lab::pvs::{Pvs, PvsError, fingerprint_of_model};
use osp_session::{
    recording::{SynthKind, synthesize},
    scene::Scene,
};
use osp_testkit::peak_of;

/// The sets themselves grow with the file; beyond that, buffers.
const MOST_BYTES: i64 = 64 << 20;
/// Where in a file stands what says how the sets are laid out, and where the sets.
const LAYOUT_AT: usize = 26;
const SETS_AT: usize = 62;

/// The model that the sets are of.
pub fn model() -> Scene {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    for event in synthesize(SynthKind::Scribble, 300, 1) {
        scene.apply(&event.expect("a synthetic event"), &mut changes);
    }
    scene
}

/// The first byte says how the others are used: 0 the whole file; 1 the layout and the sets, unpacked, of a file that is
/// sound but for them.
pub fn run(data: &[u8]) {
    static MODEL: LazyLock<Scene> = LazyLock::new(model);
    let Some((how, data)) = data.split_first() else { return };
    let path = if how % 2 == 0 {
        scratch::file("a.pvs", data)
    } else {
        let (layout, sets) = data.split_at(data.len().min(SETS_AT - LAYOUT_AT));
        let mut bytes = b"osp pvs 2\n".to_vec();
        bytes.extend((MODEL.polygon_count() as u64).to_le_bytes());
        bytes.extend(fingerprint_of_model(&*MODEL).to_le_bytes());
        bytes.extend(layout);
        bytes.resize(SETS_AT, 0);
        bytes.extend(zstd::encode_all(sets, 1).expect("zstd packs"));
        bytes.extend(xxhash_rust::xxh3::xxh3_64(&bytes).to_le_bytes());
        scratch::file("a.pvs", &bytes)
    };
    let (outcome, peak) = peak_of(|| Pvs::read(&path, &MODEL));
    assert!(peak < MOST_BYTES + 8 * data.len() as i64, "{peak} bytes held for {}", data.len());
    match outcome {
        Ok(pvs) => ask(&pvs, &MODEL, data),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("a.pvs"), "{text}");
            assert!(matches!(error, PvsError::Io { .. }) || text.contains("byte "), "{text}");
        }
    }
}

fn ask(pvs: &Pvs, model: &Scene, data: &[u8]) {
    let again = scratch::path("b.pvs");
    pvs.write_to(fs::File::create(&again).expect("a file")).expect("written");
    assert_eq!(&Pvs::read(&again, model).expect("what was written is read"), pvs);
    let share = pvs.mean_share();
    assert!((0.0..=1.0).contains(&share), "a share of {share}");
    let mut u = Input::new(data);
    let cells = pvs.cells;
    let ids: Vec<PolygonId> = (0..pvs.polygons.min(1000) as u32).map(PolygonId).collect();
    let mut eyes =
        vec![cells.min, cells.corner(cells.len() - 1) + Vec3::splat(cells.side_m), Vec3::NAN, Vec3::MAX];
    eyes.extend((0..8).map(|_| cells.corner(below(&mut u, cells.len())) + cells.side_m * 0.5));
    for eye in eyes {
        let mut drawn = Vec::new();
        let is_in_a_cell = pvs.cull(eye, ids.iter().copied(), &mut drawn);
        assert!(is_in_a_cell || drawn == ids, "outside of the cells everything is drawn");
        assert!(drawn.windows(2).all(|w| w[0] < w[1]), "each once");
    }
}
