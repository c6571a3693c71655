//! `--rig` and `--stereo`: the screens around the eye.

use std::path::PathBuf;

use anyhow::bail;
use clap::{Args, builder::TypedValueParser};

use super::parsers::named;
use osp_session::{
    replay::{RigPath, RoomMotion},
    rig::{Rig, Stereo},
};

/// A rig, and the form of its pictures for two eyes.
#[derive(Args, Debug)]
pub(super) struct RigArgs {
    /// Use the views of the screens of a rig: desktop, dual-wall, cave4, or a file that describes another rig.
    #[arg(long, value_name = "RIG")]
    pub(super) rig: Option<String>,
    /// Form of the pictures for the two eyes: mono, side-by-side, top-bottom, anaglyph, or windows (one for each screen
    /// and eye) [default: the form in the rig's file].
    #[arg(long, value_name = "HOW", value_parser = named(Stereo::ALL, Stereo::name))]
    pub(super) stereo: Option<Stereo>,
}

/// A rig around the eye of a replay.
#[derive(Args, Debug)]
pub(super) struct RigPathArgs {
    #[command(flatten)]
    pub(super) screens: RigArgs,
    /// Motion of the rig's room. `follows`: the room moves with the eye, and turns with it about the vertical axis. The
    /// eye is then always at the rig's position of the head. `stands`: the eye of the first frame determines the
    /// position of the room. After that the room stands still, and the eye moves in it.
    #[arg(long, value_name = "HOW", default_value = "follows", requires = "rig", value_parser = room_parser())]
    pub(super) room: RoomMotion,
}

fn room_parser() -> impl TypedValueParser<Value = RoomMotion> {
    named(RoomMotion::ALL, RoomMotion::name)
}

/// Returns the file of a rig. `None` if the name is that of a shipped rig.
pub(super) fn rig_file(name: &str) -> Option<PathBuf> {
    (!Rig::shipped().any(|shipped| shipped == name)).then(|| PathBuf::from(name))
}

impl RigArgs {
    /// Returns the file of the rig, which no output may replace. `None` for a shipped rig.
    pub(super) fn file(&self) -> Option<PathBuf> {
        self.rig.as_deref().and_then(rig_file)
    }

    pub(super) fn open(&self) -> anyhow::Result<Option<(Rig, Stereo)>> {
        let Some(name) = &self.rig else { return Ok(None) };
        let mut rig = Rig::open(name)?;
        if let Some(stereo) = self.stereo {
            rig = rig.with_stereo(stereo)?;
        }
        let stereo = rig.stereo;
        Ok(Some((rig, stereo)))
    }

    #[cfg(feature = "window")]
    pub(super) fn room(&self) -> anyhow::Result<osp_app::Room> {
        let mut room = match self.open()? {
            Some((rig, _)) => osp_app::Room::new(rig),
            None if self.stereo == Some(Stereo::Windows) => {
                bail!("--stereo windows needs a --rig: its screens are the windows")
            }
            None => osp_app::Room::default(),
        };
        if let Some(stereo) = self.stereo {
            room.stereo = stereo;
        }
        Ok(room)
    }
}

impl RigPathArgs {
    /// Returns the rig at the start of a replay. `None` without a rig.
    pub(super) fn path(&self) -> anyhow::Result<Option<RigPath>> {
        let Some((rig, stereo)) = self.screens.open()? else {
            if self.screens.stereo.is_some() {
                bail!("--stereo needs a --rig: its screens show the pictures for two eyes");
            }
            return Ok(None);
        };
        Ok(Some(RigPath::new(rig, stereo, self.room)))
    }
}
