//! Messages between hub and computers: lines of RON.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use osp::{
    math::COORDINATE_LIMIT_M,
    view::{Projection, View},
};
use osp_session::rig::{Rig, Stereo};

/// Longest message, bytes.
pub(super) const MAX_BYTES: usize = 1 << 16;
/// Longest name of a screen or of a machine, bytes.
pub(super) const MAX_NAME_BYTES: usize = 256;

/// A message of the hub to all computers. All messages have the same subject, so that computers receive them in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum FromHub {
    /// Computers have to draw this frame.
    Frame(Frame),
    /// Computers have to show the frame that they have drawn.
    Swap { hub: u64, frame: u64 },
    /// The hub refuses a computer.
    Refused { hub: u64, node: u64, why: String, is_for_good: bool },
}

/// A frame of the wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    /// Random number of the hub, a new number at each start.
    pub(super) hub: u64,
    pub(super) number: u64,
    /// Number of events of the session that the frame shows.
    pub(super) events: u64,
    /// Time of animated brushes, seconds.
    pub(super) time_s: f32,
    /// The views of all screens and eyes, in the order of the rig; `None` for an eye that sees nothing.
    pub(super) views: Vec<Option<Numbers>>,
}

/// A message of a computer to the hub.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum FromNode {
    /// The computer offers to show a screen.
    Here {
        node: u64,
        screen: String,
        host: String,
        /// The hash [`rig_hash`] of the computer's rig.
        rig: u64,
        /// Number of events of the session that the computer has applied.
        events: u64,
    },
    /// The computer has drawn a frame.
    Ready { node: u64, hub: u64, frame: u64, log: u64, seen: u64 },
    /// The computer has shown a frame.
    Shown { node: u64, hub: u64, frame: u64 },
    /// The computer ends.
    Leaving { node: u64 },
}

/// A view as numbers: the eye, the rotation, the window's left, right, lower and upper border, the near and far distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Numbers((f32, f32, f32), (f32, f32, f32, f32), (f32, f32, f32, f32), (f32, f32));

impl Numbers {
    pub(super) fn of(view: &View) -> Self {
        let View { eye_in_world: eye, world_from_view: q, projection: p } = view;
        Self(
            (eye.x, eye.y, eye.z),
            q.to_array().into(),
            (p.left, p.right, p.bottom, p.top),
            (p.near_m, p.far_m),
        )
    }

    /// The view; `None` if these numbers define no view.
    pub(super) fn view(self) -> Option<View> {
        let Self(eye, turn, (left, right, bottom, top), (near_m, far_m)) = self;
        let (eye, turn) = (Vec3::from(eye), Quat::from_array(turn.into()));
        let is_window =
            left < right && bottom < top && [left, right, bottom, top].iter().all(|side| side.is_finite());
        let is_range = 0.0 < near_m && near_m < far_m && far_m.is_finite();
        let is_place = eye.is_finite() && eye.abs().max_element() <= 2.0 * COORDINATE_LIMIT_M;
        (is_window && is_range && is_place && turn.is_normalized()).then_some(View {
            eye_in_world: eye,
            world_from_view: turn,
            projection: Projection { left, right, bottom, top, near_m, far_m },
        })
    }
}

/// A hash of the data that hub and computers must share: the screens with their names and positions, and the eyes. The
/// outputs of the pictures may differ, because each machine has monitors of its own.
pub(super) fn rig_hash(rig: &Rig, stereo: Stereo) -> u64 {
    let screens: Vec<_> = rig
        .screens
        .iter()
        .map(|screen| (screen.name.as_str(), screen.lower_left, screen.lower_right, screen.upper_left))
        .collect();
    let eyes: Vec<_> = stereo.eyes().iter().map(|eye| eye.name()).collect();
    xxh3_64(write(&(screens, eyes)).as_bytes())
}

/// Writes a message as text.
pub(super) fn write(message: &impl Serialize) -> String {
    // Messages consist of numbers, strings and lists, which always have a text.
    ron::to_string(message).expect("a message has a text")
}

/// Reads a message from text. The error is the reason why the text is no message.
pub(super) fn read<'m, T: Deserialize<'m>>(bytes: &'m [u8]) -> Result<T, String> {
    if bytes.len() > MAX_BYTES {
        return Err(format!("expected at most {MAX_BYTES} bytes"));
    }
    ron::de::from_bytes(bytes).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::{Pcg32, rand_core::Rng as _};

    #[test]
    fn a_view_arrives_bit_for_bit() {
        let mut random = Pcg32::new(7, 1);
        for _ in 0..2000 {
            let mut number = || loop {
                let number = f32::from_bits(random.next_u32());
                if number.is_finite() {
                    return number;
                }
            };
            let numbers = Numbers(
                (number(), number(), number()),
                (number(), number(), number(), number()),
                (number(), number(), number(), number()),
                (number(), number()),
            );
            let back: Numbers = read(write(&numbers).as_bytes()).expect("a view");
            assert_eq!(format!("{back:?}"), format!("{numbers:?}"));
            let bits = |Numbers(a, b, c, d): Numbers| {
                [a.0, a.1, a.2, b.0, b.1, b.2, b.3, c.0, c.1, c.2, c.3, d.0, d.1].map(f32::to_bits)
            };
            assert_eq!(bits(back), bits(numbers));
        }
    }

    #[test]
    fn views_that_show_nothing_are_none() {
        let view = View::look_at(Vec3::ONE, Vec3::ZERO, Projection::symmetric(60.0, 1.5, 0.1, 10.0));
        assert_eq!(Numbers::of(&view).view(), Some(view));
        let with = |change: fn(&mut Numbers)| {
            let mut numbers = Numbers::of(&view);
            change(&mut numbers);
            numbers.view()
        };
        assert_eq!(with(|n| n.0.1 = f32::NAN), None);
        assert_eq!(with(|n| n.0.1 = 1.0e30), None);
        assert_eq!(with(|n| n.1.0 = 9.0), None);
        assert_eq!(with(|n| n.2.0 = n.2.1), None);
        assert_eq!(with(|n| n.2.3 = f32::INFINITY), None);
        assert_eq!(with(|n| n.3.0 = 0.0), None);
        assert_eq!(with(|n| n.3.1 = f32::NAN), None);
    }

    #[test]
    fn rigs_agree_by_their_screens_and_eyes() {
        let rig = Rig::open("cave4").expect("a shipped rig");
        let number = rig_hash(&rig, Stereo::Mono);
        let mut other = rig.clone();
        other.name.push('x');
        assert_eq!(rig_hash(&other, Stereo::Mono), number);
        assert_ne!(rig_hash(&rig, Stereo::SideBySide), number);
        assert_eq!(rig_hash(&rig, Stereo::Anaglyph), rig_hash(&rig, Stereo::SideBySide));
        other.screens.swap(0, 1);
        assert_ne!(rig_hash(&other, Stereo::Mono), number);
    }

    #[test]
    fn no_bytes_are_a_message_by_mistake() {
        assert!(read::<FromHub>(b"Swap(hub:1,frame:2)").is_ok());
        for bad in [&b"Swap(hub:1)"[..], b"", b"Swap(hub:-1,frame:2)", b"\xff\xfe", b"Stop"] {
            assert!(read::<FromHub>(bad).is_err(), "{bad:?}");
        }
        let long = vec![b' '; MAX_BYTES + 1];
        assert!(read::<FromNode>(&long).expect_err("too long").contains("65536"));
        // Nested brackets must not overflow the stack.
        assert!(read::<FromHub>("(".repeat(MAX_BYTES).as_bytes()).is_err());
    }
}
