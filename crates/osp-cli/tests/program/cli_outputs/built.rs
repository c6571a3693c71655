//! What the program under test was built with.

/// Whether this build has what these arguments need: benchmarks and charts are a feature.
pub(crate) fn has<S: AsRef<str>>(args: &[S]) -> bool {
    let is_of_bench = |arg: &S| {
        ["bench", "draw-index", "draw-insertion", "draw-occlusion", "race", "--chart"].contains(&arg.as_ref())
    };
    cfg!(feature = "bench") || !args.iter().any(is_of_bench)
}
