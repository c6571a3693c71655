use glam::Vec3;

/// Edge of the modelling volume, metres.
pub(super) const VOLUME_M: f32 = 4.0;

/// Centre of the modelling volume, 1.5 m above the floor.
pub(super) const CENTER: Vec3 = Vec3::new(0.0, 1.5, 0.0);
