//! The fuzz targets of `crates/osp-cli/tests/fuzzing` with bytes from a seeded generator: changed seeds, and noise. The same cases in
//! every run. `OSP_FUZZ_CASES=20` runs twenty times as many, `OSP_FUZZ_FROM` others; `crates/osp-cli/tests/fuzz` drives the same targets
//! by libFuzzer (`docs/reliability.md`).
//!
//! `OSP_FUZZ_SEEDS=FOLDER` writes the seeds to `FOLDER/TARGET/`, for a corpus to begin with.
#![allow(unreachable_pub, reason = "the targets are a library of their own for libFuzzer")]
#![allow(missing_docs, reason = "the targets explain themselves in their modules")]
#![allow(clippy::print_stderr, clippy::unwrap_used, reason = "a test says where it stops")]

#[path = "../fuzzing/mod.rs"]
mod fuzzing;
mod generator;
mod seeds;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use generator::Generator;

/// Runs a target on its seeds, then on so many cases made from them.
fn drive(name: &str, seeds: &[Vec<u8>], cases: u64, run: fn(&[u8])) {
    let number = |name: &str, otherwise: u64| {
        std::env::var(name).ok().map_or(otherwise, |text| text.parse().expect("a number of cases"))
    };
    if let Some(folder) = std::env::var_os("OSP_FUZZ_SEEDS") {
        // Where every input is valid, noise is as good a beginning as any.
        let noise: Vec<Vec<u8>> = (0..20).map(|case| Generator::new(case).case(&[])).collect();
        let seeds = if seeds.is_empty() { noise.as_slice() } else { seeds };
        let folder = std::path::Path::new(&folder).join(name);
        std::fs::create_dir_all(&folder).expect("a folder for seeds");
        for (i, seed) in seeds.iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{i}")), seed).expect("a seed");
        }
    }
    let from = number("OSP_FUZZ_FROM", 0);
    let made = (from..from + cases * number("OSP_FUZZ_CASES", 1)).map(|case| {
        let mut generator = Generator::new(case);
        (format!("case {case}"), generator.case(seeds))
    });
    let given = seeds.iter().enumerate().map(|(i, seed)| (format!("seed {i}"), seed.clone()));
    for (which, data) in given.chain(made) {
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| run(&data))) {
            eprintln!("{name}, {which}: {} bytes", data.len());
            if let Some(folder) = std::env::var_os("OSP_FUZZ_FAILED") {
                let path = std::path::Path::new(&folder).join(format!("{name}-{}", which.replace(' ', "-")));
                std::fs::write(&path, &data).expect("the failed case");
                eprintln!("written to {}", path.display());
            }
            resume_unwind(panic);
        }
    }
}

#[test]
fn read_bytes() {
    drive("read_bytes", &seeds::recordings(), 3000, fuzzing::read_bytes::run);
}

#[test]
fn session() {
    drive("session", &[], 150, fuzzing::session::run);
}

#[test]
fn frame_occlusion() {
    drive("frame_occlusion", &[], 400, fuzzing::frame_occlusion::run);
}

/// Much of what the cases show is hidden, and a method that hides visible polygons is caught: else they would show
/// nothing.
#[test]
fn frame_occlusion_catches_unsound_methods() {
    use osp::occlusion::Occlusion;
    use osp_rivals::RivalOcclusion;
    let cases = |count| (0..count).map(|case| Generator::new(case).case(&[]));
    let of = |kind| vec![kind];
    let hidden: usize =
        cases(300).map(|data| fuzzing::frame_occlusion::judge(&data, of(Occlusion::Msvbsp.into()))).sum();
    let paper = of(RivalOcclusion::MsvbspPaper.into());
    let is_caught =
        |data: &Vec<u8>| catch_unwind(|| fuzzing::frame_occlusion::judge(data, paper.clone())).is_err();
    let caught = cases(1500).filter(is_caught).count();
    eprintln!("{hidden} polygons hidden; caught {caught}");
    assert!(hidden > 500, "{hidden} hidden");
    assert!(caught > 0, "the oracle catches nothing");
}

#[test]
fn pvs() {
    drive("pvs", &seeds::sets(), 2000, fuzzing::pvs::run);
}

#[test]
fn arguments() {
    drive("arguments", &seeds::arguments(), 4000, fuzzing::arguments::run);
}

#[cfg(feature = "window")]
#[test]
fn tracker() {
    drive("tracker", &seeds::tracker(), 10_000, fuzzing::tracker::run);
}
