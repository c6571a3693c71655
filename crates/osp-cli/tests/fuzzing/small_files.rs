//! Pinned fingerprints and rigs of screens: refused with a message, or read and written again the same.

use super::scratch;
use osp::glam::Quat;
use osp_lab::report::{PinError, Pins};
use osp_session::rig::{Rig, RigError, Stereo};

/// The first byte says which: even pins, odd a rig.
pub fn run(data: &[u8]) {
    let Some((which, data)) = data.split_first() else { return };
    if which % 2 == 0 { pins(data) } else { rig(data) }
}

fn check_message(text: &str, file: &str) {
    assert!(text.contains(file), "{text}");
    assert!(text.len() < 4000, "a message of {} bytes", text.len());
}

fn pins(data: &[u8]) {
    match Pins::read(&scratch::file("a.pins", data)) {
        Ok(pins) => {
            let mut again = Vec::new();
            pins.write(&mut again).expect("written");
            let again = scratch::file("b.pins", &again);
            assert_eq!(Pins::read(&again).expect("what was written is read"), pins);
            let Some(first) = pins.pins.first() else { return };
            assert!(pins.find(first).is_some());
            assert_eq!(first.difference(first), None);
            let mut changed = pins.clone();
            changed.set(first.clone());
            assert_eq!(changed.find(first), Some(first));
            pins.pins.iter().for_each(|pin| drop(first.difference(pin)));
        }
        Err(error) => {
            let text = error.to_string();
            check_message(&text, "a.pins");
            assert!(matches!(error, PinError::Io { .. }) || text.contains(", line "), "{text}");
        }
    }
}

fn rig(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match Rig::parse(&text, "a.rig") {
        Ok(rig) => {
            for eye in Stereo::Mono.eyes().iter().chain(Stereo::SideBySide.eyes()) {
                let at = rig.eye_in_room(*eye, rig.head, Quat::IDENTITY);
                for screen in &rig.screens {
                    if let Some(view) = screen.view(at, 0.01, 100.0) {
                        let corners = view.corner_directions();
                        assert!(corners.iter().all(|c| c.is_finite()), "{view:?} of {screen:?}");
                    }
                }
            }
        }
        // What is wrong with a number names the rig, by the name in the file.
        Err(RigError::Invalid { .. }) => {}
        Err(error) => check_message(&error.to_string(), "a.rig"),
    }
}
