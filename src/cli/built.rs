//! Commands and options that need a missing feature. Every build parses them, and refuses them with an error that
//! names the feature.

use std::fmt;

use anyhow::bail;
use clap::{ArgMatches, parser::ValueSource};

/// A feature of the crate that commands or options need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    Live,
    Parquet,
    Peers,
    Render,
    Serve,
    Window,
    Worlds,
}

impl Feature {
    const ALL: [Self; 7] =
        [Self::Live, Self::Parquet, Self::Peers, Self::Render, Self::Serve, Self::Window, Self::Worlds];

    /// Its name in Cargo.toml.
    const fn name(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Parquet => "parquet",
            Self::Peers => "peers",
            Self::Render => "render",
            Self::Serve => "serve",
            Self::Window => "window",
            Self::Worlds => "worlds",
        }
    }

    /// Whether this build has it.
    pub(super) const fn is_built(self) -> bool {
        match self {
            Self::Live => cfg!(feature = "live"),
            Self::Parquet => cfg!(feature = "parquet"),
            Self::Peers => cfg!(feature = "peers"),
            Self::Render => cfg!(feature = "render"),
            Self::Serve => cfg!(feature = "serve"),
            Self::Window => cfg!(feature = "window"),
            Self::Worlds => cfg!(feature = "worlds"),
        }
    }
}

/// Refuses what needs these features.
pub(super) fn refuse<T>(what: impl fmt::Display, needed: &[Feature]) -> anyhow::Result<T> {
    bail!("{what} {}", Lacking(needed))
}

/// Features that a build lacks, and the command that builds one with them and all that this build has.
#[derive(Debug)]
pub(super) struct Lacking<'a>(pub(super) &'a [Feature]);

impl fmt::Display for Lacking<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_wanted = |feature: &Feature| self.0.contains(feature) || feature.is_built();
        let has_window = is_wanted(&Feature::Window);
        let is_within = |feature: &Feature| *feature == Feature::Render && has_window;
        let all = Feature::ALL.iter().filter(|feature| is_wanted(feature) && !is_within(feature));
        let all: Vec<_> = all.map(|feature| feature.name()).collect();
        let names: Vec<_> = self.0.iter().map(|feature| format!("`{}`", feature.name())).collect();
        write!(
            f,
            "needs a build with {} {}, which this one lacks: cargo install --path . --features {}",
            if names.len() == 1 { "the feature" } else { "the features" },
            names.join(" and "),
            all.join(",")
        )
    }
}

/// Commands and options that need a feature: names of the command, ids of the options (none: the command itself).
const NEEDS: &[(&[&str], &[&str], Feature)] = &[
    (&["replay"], &["window", "paused", "trace"], Feature::Window),
    (&["replay"], &["draw"], Feature::Render),
    (&["replay"], &["world"], Feature::Worlds),
    (&["pack"], &[], Feature::Worlds),
    (&["render"], &[], Feature::Render),
    (&["rig", "monitors"], &[], Feature::Window),
    (&["serve"], &[], Feature::Serve),
    (&["sketch"], &[], Feature::Window),
    (&["sketch"], &["join"], Feature::Live),
    (&["send"], &[], Feature::Window),
    (&["join"], &[], Feature::Live),
    (&["wall"], &[], Feature::Live),
    (&["wall"], &["tracker"], Feature::Window),
];

/// Refuses a command line that needs a feature which this build lacks.
pub(super) fn check(matches: &ArgMatches) -> anyhow::Result<()> {
    let (mut names, mut below) = (Vec::new(), matches);
    while let Some((name, matches)) = below.subcommand() {
        names.push(name);
        below = matches;
    }
    let command = names.join(" ");
    let is_given = |id: &&&str| below.value_source(id) == Some(ValueSource::CommandLine);
    let mut lacking = Vec::new();
    let mut what = None;
    for (_, options, feature) in NEEDS.iter().filter(|(of, _, feature)| *of == names && !feature.is_built()) {
        let given = options.iter().find(is_given);
        if options.is_empty() || given.is_some() {
            what.get_or_insert_with(|| {
                given.map_or(format!("osp {command}"), |id| format!("osp {command} --{id}"))
            });
            lacking.push(*feature);
        }
    }
    what.map_or(Ok(()), |what| refuse(what, &lacking))
}
