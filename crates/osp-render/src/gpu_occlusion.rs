/// Method by which a view culls hidden polygons on the GPU, while drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GpuOcclusion {
    /// Not at all.
    #[default]
    None,
    /// By a depth pyramid (Hi-Z).
    Hzb,
    /// By hardware occlusion queries.
    Queries,
    /// In each frame whichever of none and [`GpuOcclusion::Hzb`] takes the least time.
    Auto,
}
