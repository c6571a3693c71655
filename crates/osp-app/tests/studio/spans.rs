//! Two picked points: the distance between them, and the strokes in a box or a sphere.

use osp_app::{Button, Command, Held, Span, ToolChoice};
use osp_rivals::IndexKind;

use crate::drawing::{Table, across};

/// A table with ribbons above, in and below the middle; their numbers from the highest.
fn three_ribbons() -> (Table, Vec<u32>) {
    let mut table = Table::new();
    for y in [0.5, 0.0, -0.5] {
        table.drag(Button::Primary, &across(y));
    }
    let scene = table.studio.scene();
    let ids = scene.strokes().iter().filter_map(|stroke| stroke.id()).map(|id| id.0).collect();
    (table, ids)
}

fn selected(table: &Table) -> Vec<u32> {
    table.studio.selection().strokes().iter().map(|stroke| stroke.0).collect()
}

#[test]
fn the_distance_of_two_points_of_the_model_is_measured() {
    let (mut table, _) = three_ribbons();
    table.studio.command(Command::Tool(ToolChoice::Span(Span::Distance)));
    table.drag(Button::Primary, &[(0.05, 0.25), (0.1, 0.0)]);
    assert_eq!(table.studio.measured(), None, "there is nothing where it began");
    table.drag(Button::Primary, &[(0.0, 0.5), (0.0, 0.2), (0.0, -0.5)]);
    let (from, to) = table.studio.measured().expect("two points");
    let scene = table.studio.scene();
    let centers: Vec<_> = scene
        .strokes()
        .iter()
        .map(|stroke| {
            let around = stroke.polygon_ids().map(|id| scene.bounds(id));
            around.reduce(|a, b| a.union(&b)).expect("polygons")
        })
        .collect();
    let apart_m = (centers[0].center() - centers[2].center()).length();
    let width_m = table.studio.brush().width_m;
    assert!((from.distance(to) - apart_m).abs() < width_m, "{} m, {apart_m} m", from.distance(to));
    for (point, stroke) in [(from, &centers[0]), (to, &centers[2])] {
        assert!(stroke.distance_squared(point).sqrt() < 1.0e-3, "{point} lies on {stroke:?}");
    }
    assert!(table.studio.selection().is_empty(), "measuring selects nothing");
}

#[test]
fn what_is_in_a_box_or_a_sphere_is_selected_with_every_index() {
    let (mut table, ids) = three_ribbons();
    for &kind in IndexKind::ALL {
        table.act([Command::Index(kind)]);
        for (span, way, expected) in [
            (Span::Box, [(-0.1, 0.5), (0.1, 0.0)], &ids[..2]),
            (Span::Box, [(-0.1, -0.5), (0.1, 0.0)], &ids[1..]),
            (Span::Sphere, [(0.0, 0.0), (0.0, 0.3)], &ids[1..2]),
            (Span::Sphere, [(0.0, 0.5), (0.0, 0.05)], &ids[..1]),
            (Span::Sphere, [(0.0, 0.0), (0.0, 0.7)], &ids[..]),
        ] {
            table.act([Command::SelectNone, Command::Tool(ToolChoice::Span(span))]);
            table.drag(Button::Primary, &way);
            assert_eq!(selected(&table), expected, "{} {span:?} {way:?}", kind.name());
        }
        // The strokes of the last drag stay selected while another is added.
        table.studio.command(Command::Tool(ToolChoice::Select));
        table.click((0.0, -0.5), Held::default());
        assert_eq!(selected(&table), [ids[2]], "{}", kind.name());
        table.studio.command(Command::Tool(ToolChoice::Span(Span::Sphere)));
        table.drag_held(&[(0.0, 0.5), (0.0, 0.4)], Held { shift: true, ..Held::default() });
        assert_eq!(selected(&table), [ids[0], ids[2]], "{}", kind.name());
    }
}
