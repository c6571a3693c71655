/// The method by which a view culls hidden polygons on the GPU, while drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GpuOcclusion {
    #[default]
    None,
    /// Culling by a depth pyramid (Hi-Z).
    Hzb,
    Queries,
    /// In each frame the faster of [`GpuOcclusion::None`] and [`GpuOcclusion::Hzb`].
    Auto,
}
