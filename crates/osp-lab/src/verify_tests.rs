use super::*;
use osp_rivals::RivalOcclusion;

const SOUND: Method = Method::Own(Occlusion::Msvbsp);
const UNSOUND: Method = Method::Rival(RivalOcclusion::MsvbspPaper);

fn list(ids: &[u32]) -> Vec<PolygonId> {
    let mut list = Vec::new();
    ids.iter().for_each(|&id| list.push(PolygonId(id)));
    list
}

/// Polygons 0 and 1 are visible, 2 is hidden, 3 is not in the view.
fn truth() -> (Vec<(Option<Sight>, u8)>, Vec<PolygonId>) {
    let sights = [Some(Sight::Visible), Some(Sight::Visible), Some(Sight::Hidden), None];
    (sights.map(|sight| (sight, 0)).to_vec(), list(&[0, 1, 2]))
}

fn trial(kind: Method, totals: Totals) -> Trial {
    let source = OccluderSource::Chosen(Box::new(ViewOcclusion::with_culler(
        kind.create(64),
        &OcclusionConfig::default(),
    )));
    Trial { occluders: 1, source, totals }
}

fn added(drawn: &[&[u32]]) -> Totals {
    let (mut truth, in_view) = truth();
    let mut totals = Totals::default();
    for (view, drawn) in drawn.iter().enumerate() {
        totals.add(view as u64, &list(drawn), &mut truth, &in_view);
    }
    totals
}

#[test]
fn what_is_drawn_and_left_out_is_counted_frame_by_frame() {
    let totals = added(&[&[0, 1, 2], &[1, 0], &[0, 1]]);
    assert_eq!((totals.frames, totals.drawn), (3, 7));
    assert_eq!((totals.hidden, totals.hidden_culled), (3, 2));
    assert_eq!((totals.false_culls, totals.misreported, totals.first_false), (0, 0, None));
    assert!((totals.hidden_culled_percent() - 200.0 / 3.0).abs() < 1.0e-9);
    assert!((totals.mean(totals.drawn) - 7.0 / 3.0).abs() < 1.0e-9);
    assert!(!trial(SOUND, totals).failed());
}

#[test]
fn a_visible_polygon_that_is_left_out_fails_what_promises_not_to() {
    let totals = added(&[&[0, 1], &[0], &[]]);
    assert_eq!((totals.false_culls, totals.first_false), (3, Some((1, PolygonId(1)))));
    assert!(trial(SOUND, totals.clone()).failed());
    assert!(!trial(UNSOUND, totals).failed());
}

#[test]
fn a_polygon_reported_twice_or_from_out_of_view_fails_whatever_is_promised() {
    for drawn in [&[0, 1, 0][..], &[0, 1, 3]] {
        let totals = added(&[drawn]);
        assert_eq!((totals.misreported, totals.false_culls), (1, 0), "{drawn:?}");
        for kind in [SOUND, UNSOUND] {
            assert!(trial(kind, totals.clone()).failed(), "{drawn:?}");
        }
    }
    // A polygon may be drawn once in each of two frames.
    assert_eq!(added(&[&[0, 1], &[0, 1]]).misreported, 0);
}

#[test]
fn what_is_wrong_before_the_frames_that_count_is_wrong_all_the_same() {
    let (mut truth, in_view) = truth();
    let mut totals = Totals::default();
    totals.add_faults(4, &list(&[0, 1]), &mut truth, &in_view);
    assert_eq!(totals, Totals::default(), "nothing is wrong, and nothing else counts");
    totals.add_faults(5, &list(&[1, 1, 3]), &mut truth, &in_view);
    assert_eq!((totals.false_culls, totals.misreported), (1, 2));
    assert_eq!(totals.first_false, Some((5, PolygonId(0))));
    assert!(trial(SOUND, totals.clone()).failed());
    // Further faults are added, and the first one stays.
    totals.add_faults(6, &list(&[0, 3]), &mut truth, &in_view);
    assert_eq!((totals.false_culls, totals.misreported), (2, 3));
    assert_eq!(totals.first_false, Some((5, PolygonId(0))));
    assert_eq!((totals.frames, totals.views, totals.drawn, totals.hidden), (0, 0, 0, 0));
}

#[test]
fn what_is_missing_is_counted_whatever_the_order() {
    let ids = |ids: &[u32]| ids.iter().map(|&id| PolygonId(id)).collect::<Vec<_>>();
    assert_eq!(missing(&ids(&[1, 2, 3]), &ids(&[3, 7, 1])), 1);
    assert_eq!(missing(&ids(&[1, 2, 3]), &[]), 3);
    assert_eq!(missing(&[], &ids(&[1])), 0);
}

#[test]
fn the_fastest_of_several_counts_and_the_last_is_returned() {
    let (mut ns, mut calls) = (7, 0u32);
    let outcome = fastest(&StageClock::default(), 3, &mut ns, &mut || {
        calls += 1;
        calls
    });
    assert_eq!((outcome, calls), (3, 3));
    assert!(ns >= 7, "it is added");
    fastest(&StageClock::default(), 0, &mut ns, &mut || calls += 1);
    assert_eq!(calls, 4, "once at least");
}
