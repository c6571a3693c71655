//! Packets of DTrack, the program of ART's trackers (Advanced Realtime Tracking, "DTrack2 User Manual", appendix B.2):
//! lines of ASCII, millimetres, rotation matrices by columns.
//!
//! Body 0 (`6d`, or `6di` with its state) is the head; Flysticks (`6df2`, or the older `6df`) are the hands. A hand
//! draws while the first button of its Flystick is pressed. All other lines are ignored.

use glam::{Mat3, Quat, Vec3};

use super::message::Message;

/// Whether a datagram comes from DTrack: it begins with the frame number.
pub(super) fn is_dtrack(packet: &[u8]) -> bool {
    packet.starts_with(b"fr ")
}

/// Parses a packet. Appends its messages and returns the number of malformed lines. `z_up` is whether the room was
/// calibrated with z up; poses are then rotated to y up.
pub fn parse_dtrack(text: &str, z_up: bool, messages: &mut Vec<Message>) -> u64 {
    let mut malformed = 0;
    for line in text.lines() {
        let (kind, rest) = line.split_once(' ').unwrap_or((line, ""));
        let taken = match kind {
            "6d" => take(rest, 3, z_up, messages, |[id, quality, ..], pose| head(*id, *quality >= 0.0, pose)),
            "6di" => take(rest, 3, z_up, messages, |[id, state, ..], pose| head(*id, *state > 0.0, pose)),
            "6df" => take(rest, 3, z_up, messages, |[id, quality, buttons], pose| {
                hand(*id, *quality, *buttons, pose)
            }),
            "6df2" => take_flysticks(rest, z_up, messages),
            _ => Some(()),
        };
        malformed += u64::from(taken.is_none());
    }
    malformed
}

/// Position, and rotation from the body to the world.
type Pose = (Vec3, Quat);

fn head(id: f64, is_tracked: bool, (p, q): Pose) -> Option<Message> {
    (id == 0.0 && is_tracked).then_some(Message::Head { p, q })
}

fn hand(id: f64, quality: f64, buttons: f64, (p, q): Pose) -> Option<Message> {
    let is_hand = (0.0..256.0).contains(&id) && quality >= 0.0;
    let is_pressed = (0.0..=f64::from(u32::MAX)).contains(&buttons) && buttons as u32 & 1 == 1;
    let pressure = if is_pressed { 1.0 } else { 0.0 };
    is_hand.then_some(Message::Hand { hand: id as u8, p, q, pressure })
}

/// Parses the objects of a line, each with `blocks_each` blocks in brackets; `None` if the line is malformed.
fn take(
    line: &str,
    blocks_each: usize,
    z_up: bool,
    messages: &mut Vec<Message>,
    message: impl Fn(&[f64; 3], Pose) -> Option<Message>,
) -> Option<()> {
    let blocks = blocks_of(line)?;
    if !blocks.len().is_multiple_of(blocks_each) {
        return None;
    }
    for thing in blocks.chunks(blocks_each) {
        let mut state = [0.0; 3];
        let said = thing[0].len().min(3);
        state[..said].copy_from_slice(&thing[0][..said]);
        // An untracked object has a matrix of zeros.
        let Some(pose) = pose_of(&thing[1], &thing[2], z_up) else { continue };
        messages.extend(message(&state, pose).and_then(Message::checked));
    }
    Some(())
}

fn take_flysticks(line: &str, z_up: bool, messages: &mut Vec<Message>) -> Option<()> {
    let blocks = blocks_of(line)?;
    if !blocks.len().is_multiple_of(4) {
        return None;
    }
    for flystick in blocks.chunks(4) {
        let ([id, quality, ..], buttons) = (&flystick[0][..], flystick[3].first()) else { return None };
        let Some(pose) = pose_of(&flystick[1], &flystick[2], z_up) else { continue };
        let message = hand(*id, *quality, buttons.copied().unwrap_or(0.0), pose);
        messages.extend(message.and_then(Message::checked));
    }
    Some(())
}

/// The numbers of each block in brackets.
fn blocks_of(line: &str) -> Option<Vec<Vec<f64>>> {
    let inside = line.split('[').skip(1).map(|block| block.split_once(']').map(|(inside, _)| inside));
    let numbers = |inside: &str| inside.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    inside.map(|inside| numbers(inside?)).collect()
}

/// The pose; `None` if the numbers are not a pose.
fn pose_of(place: &[f64], turn: &[f64], z_up: bool) -> Option<Pose> {
    let &[x, y, z, ..] = place else { return None };
    let turn: &[f64; 9] = turn.try_into().ok()?;
    let matrix = Mat3::from_cols_array(&turn.map(|part| part as f32));
    // The matrix must be a rotation, except for rounding to the three digits of older programs.
    let is_rotation = (matrix.determinant() - 1.0).abs() < 0.1
        && (0..3).all(|axis| (matrix.col(axis).length() - 1.0).abs() < 0.1);
    if !is_rotation {
        return None;
    }
    let p = Vec3::new(x as f32, y as f32, z as f32) * 1.0e-3;
    let q = Quat::from_mat3(&matrix);
    Some(match z_up {
        true => (Vec3::new(p.x, p.z, -p.y), Quat::from_xyzw(q.x, q.z, -q.y, q.w)),
        false => (p, q),
    })
}
