use super::{document::Document, player::Player};
use osp::math::Aabb;
use osp_render::background_for;
use osp_session::{recording::Header, scene::Scene};

/// The subject of the window: a session being drawn, or one being replayed.
#[derive(Debug)]
pub enum Subject {
    /// A session being drawn.
    Sketch(Box<Document>),
    /// A session being replayed.
    Replay(Box<Player>),
}

impl Subject {
    /// Linear red, green, blue where nothing is: what the model stood out from when it was opened.
    pub fn background(&self) -> [f64; 3] {
        match self {
            Self::Sketch(document) => background_for(document.scene()),
            Self::Replay(player) => player.background(),
        }
    }

    /// The session's header.
    pub fn header(&self) -> &Header {
        match self {
            Self::Sketch(document) => document.header(),
            Self::Replay(player) => player.header(),
        }
    }

    /// The model.
    pub fn scene(&self) -> &Scene {
        match self {
            Self::Sketch(document) => document.scene(),
            Self::Replay(player) => player.scene(),
        }
    }

    /// Box of everything.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Sketch(document) => document.bounds(),
            Self::Replay(player) => player.bounds(),
        }
    }
}
