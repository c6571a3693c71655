//! Fingerprints of frames, views and sessions: what they tell apart, and that they stay the numbers that they are.

use osp::polygon::PolygonId;
use osp_session::replay::{SessionFingerprint, fingerprint_of_frame, fingerprint_of_views};

fn list(ids: &[u32]) -> Vec<PolygonId> {
    ids.iter().copied().map(PolygonId).collect()
}

fn of(views: &[&[u32]]) -> u64 {
    fingerprint_of_views(views.iter().map(|ids| list(ids)))
}

#[test]
fn views_are_told_apart_by_what_each_sees() {
    assert_eq!(of(&[&[1, 2, 3]]), fingerprint_of_frame(list(&[3, 1, 2])), "of one view, that of the frame");
    let different: [&[&[u32]]; 12] = [
        &[],
        &[&[1]],
        &[&[2]],
        // Both eyes see the same: that is not nothing.
        &[&[1], &[1]],
        &[&[2], &[2]],
        &[&[1], &[1], &[1]],
        // Not which eye sees what.
        &[&[1], &[2]],
        &[&[2], &[1]],
        &[&[1, 2], &[]],
        &[&[], &[1, 2]],
        &[&[1, 2], &[1, 2], &[3]],
        &[&[3], &[1, 2], &[1, 2]],
    ];
    for (i, a) in different.iter().enumerate() {
        for b in &different[..i] {
            assert_ne!(of(a), of(b), "{a:?} and {b:?}");
        }
    }
}

/// Numbers that were written down stay comparable.
#[test]
fn fingerprints_do_not_change_with_the_program() {
    assert_eq!(fingerprint_of_frame([]), 0);
    assert_eq!(fingerprint_of_frame([PolygonId(0)]), 0x34c856811d44303c);
    assert_eq!(of(&[&[0, 1, 70_000], &[u32::MAX], &[5]]), 0x77e72e743e2cabda);
    let mut session = SessionFingerprint::new();
    session.add(0, 1);
    session.add(7, 2);
    assert_eq!((session.value(), session.frames()), (0x85a31cd081fc5095, 2));
}

/// Sixty-four views later the first one has come round.
#[test]
fn every_one_of_many_views_counts() {
    let views: Vec<[u32; 1]> = (0..16).map(|i| [i]).collect();
    let lists = |views: &[[u32; 1]]| of(&views.iter().map(|ids| &ids[..]).collect::<Vec<_>>());
    let all = lists(&views);
    for i in 0..views.len() {
        let mut changed = views.clone();
        changed[i] = [1000];
        assert_ne!(lists(&changed), all, "view {i}");
    }
}
