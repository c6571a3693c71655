use std::sync::LazyLock;

/// The commit from which the program was built, with `-dirty` if there were changes.
pub(super) const COMMIT: Option<&str> = option_env!("OSP_COMMIT");

/// Version, commit and features, in the form of `osp --version`.
pub(super) static VERSION: LazyLock<String> = LazyLock::new(|| {
    let features: Vec<&str> = [
        ("bench", cfg!(feature = "bench")),
        ("render", cfg!(feature = "render")),
        ("window", cfg!(feature = "window")),
        ("live", cfg!(feature = "live")),
        ("peers", cfg!(feature = "peers")),
    ]
    .into_iter()
    .filter_map(|(name, is_built)| is_built.then_some(name))
    .collect();
    let commit = COMMIT.map(|commit| format!(" ({commit})")).unwrap_or_default();
    let features = if features.is_empty() { "none".to_owned() } else { features.join(", ") };
    format!("{}{commit}\nfeatures: {features}", env!("CARGO_PKG_VERSION"))
});
