//! Packets of ART's DTrack, on the socket of every tracker.

use std::net::UdpSocket;

use crate::{
    drawing::Table,
    tracker::{listen, sender, wait_until},
};
use osp::glam::{Quat, Vec3};
use osp_app::tracker::{Message, TrackerOptions, parse_dtrack};

/// A quarter turn about +y, by columns.
const TURNED: &str = "0.000000 0.000000 -1.000000 0.000000 1.000000 0.000000 1.000000 0.000000 0.000000";
const NOTHING: &str = "0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000 0.000000";

fn messages(packet: &str, z_up: bool) -> (Vec<Message>, u64) {
    let mut messages = Vec::new();
    let malformed = parse_dtrack(packet, z_up, &mut messages);
    (messages, malformed)
}

fn flystick(x_mm: f64, buttons: u32) -> String {
    format!(
        "fr 7\r\nts 41.5\r\n6dcal 3\r\n6df2 1 1 [0 1.000 6 2][{x_mm:.3} 1200.000 -400.000][{TURNED}][{buttons} 0.00 0.00]\r\n"
    )
}

#[test]
fn the_first_body_is_the_head_and_flysticks_are_the_hands() {
    let packet = format!(
        "fr 1\r\n6d 2 [0 1.000][100.000 1700.000 250.000 0.0 90.0 0.0][{TURNED}] [3 1.000][1.0 2.0 3.0 0.0 90.0 0.0][{TURNED}]\r\n\
         3d 1 [1 1.000][210.730 -90.669 -108.554]\r\n\
         6df2 2 2 [0 1.000 6 2][500.000 1000.000 0.000][{TURNED}][3 0.00 0.00] [1 1.000 6 2][-500.000 1000.000 0.000][{TURNED}][2 0.00 1.00]\r\n"
    );
    let (found, malformed) = messages(&packet, false);
    assert_eq!(malformed, 0);
    let [
        Message::Head { p, q },
        Message::Hand { hand: 0, pressure: 1.0, .. },
        Message::Hand { hand: 1, pressure: 0.0, p: second, .. },
    ] = found[..]
    else {
        panic!("{found:?}")
    };
    assert!(p.abs_diff_eq(Vec3::new(0.1, 1.7, 0.25), 1.0e-6), "metres: {p}");
    assert!(q.angle_between(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2)) < 1.0e-3, "{q}");
    assert!(second.abs_diff_eq(Vec3::new(-0.5, 1.0, 0.0), 1.0e-6));
    // The older forms.
    let older = format!(
        "6di 1 [0 2 0.1][0.0 1700.0 0.0][{TURNED}]\n6df 1 [0 1.000 1][0.0 900.0 0.0 0 0 0][{TURNED}]\n"
    );
    let (found, _) = messages(&older, false);
    assert!(matches!(found[..], [Message::Head { .. }, Message::Hand { pressure: 1.0, .. }]), "{found:?}");
}

#[test]
fn what_the_cameras_do_not_see_says_nothing() {
    let lost = format!(
        "6df2 1 1 [0 -1.000 6 2][0.000 0.000 0.000][{NOTHING}][1 0.00 0.00]\n6d 1 [0 -1.000][1 2 3 0 0 0][{TURNED}]\n\
         6di 1 [0 0 0.0][0.0 0.0 0.0][{NOTHING}]\n6d 0\n6df2 0 0\n"
    );
    assert_eq!(messages(&lost, false), (Vec::new(), 0));
    for broken in [
        "6d 1 [0 1.000][1 2 3]",
        "6df2 1 1 [0 1.0 6 2][1 2 3",
        "6d 1 [0 x][1 2 3 0 0 0][1 2]",
        "6df 1 [][][]",
    ] {
        let (found, malformed) = messages(broken, false);
        assert!(found.is_empty() && malformed <= 1, "{broken}: {found:?}");
    }
    assert_eq!(messages("6d 1 [0 1.000][1 2 3]", false).1, 1);
}

/// East, north, up become east, up, south.
#[test]
fn a_room_with_z_up_is_turned() {
    // Turned by a quarter about its z.
    let packet = "6d 1 [0 1.000][1000.0 2000.0 1700.0 0 0 0][0.0 1.0 0.0 -1.0 0.0 0.0 0.0 0.0 1.0]";
    let ([Message::Head { p, q }], 0) = (&messages(packet, true).0[..], messages(packet, true).1) else {
        panic!("a head")
    };
    assert!(p.abs_diff_eq(Vec3::new(1.0, 1.7, -2.0), 1.0e-6), "{p}");
    assert!(q.angle_between(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2)) < 1.0e-3, "{q}");
}

#[test]
fn a_flystick_draws_while_its_first_button_is_pressed() {
    let mut table = Table::new();
    let tracker = listen(&TrackerOptions::default());
    let socket: UdpSocket = sender(&tracker);
    table.studio.set_tracker(tracker);
    for i in 0..20u32 {
        socket.send(flystick(f64::from(i) * 20.0, u32::from(i < 15)).as_bytes()).expect("sent");
    }
    wait_until("a stroke", || {
        table.frame();
        table.studio.tracker().is_some_and(|tracker| tracker.counts().messages == 20)
    });
    table.frame();
    let scene = table.studio.scene();
    assert_eq!(scene.strokes().len(), 1);
    let stroke = &scene.strokes()[0];
    assert!(!stroke.is_open() && stroke.point_count() == 15, "{} points", stroke.point_count());
    assert_eq!(table.studio.tracker().expect("one").counts().malformed, 0);
}
