//! Commands and options that need a missing feature. Every build parses them, and refuses them with an error that names
//! the feature.

use std::fmt;

use anyhow::bail;
use clap::{ArgMatches, parser::ValueSource};

/// A feature of the crate that commands or options need: its name in Cargo.toml, and whether this build has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Feature(&'static str, bool);

impl Feature {
    const ALL: [Self; 5] = [Self::BENCH, Self::LIVE, Self::PEERS, Self::RENDER, Self::WINDOW];
    pub(super) const BENCH: Self = Self("bench", cfg!(feature = "bench"));
    const LIVE: Self = Self("live", cfg!(feature = "live"));
    pub(super) const PEERS: Self = Self("peers", cfg!(feature = "peers"));
    pub(super) const RENDER: Self = Self("render", cfg!(feature = "render"));
    pub(super) const WINDOW: Self = Self("window", cfg!(feature = "window"));

    pub(super) const fn is_built(self) -> bool {
        self.1
    }
}

pub(super) fn refuse<T>(what: impl fmt::Display, needed: &[Feature]) -> anyhow::Result<T> {
    bail!("{what} {}", Lacking(needed))
}

/// Features that a build lacks. Its text includes the command that builds osp with them and with all features of this
/// build.
#[derive(Debug)]
pub(super) struct Lacking<'a>(pub(super) &'a [Feature]);

impl fmt::Display for Lacking<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_wanted = |feature: &Feature| self.0.contains(feature) || feature.is_built();
        let has_window = is_wanted(&Feature::WINDOW);
        let is_within = |feature: &Feature| *feature == Feature::RENDER && has_window;
        let all = Feature::ALL.iter().filter(|feature| is_wanted(feature) && !is_within(feature));
        let all: Vec<_> = all.map(|feature| feature.0).collect();
        let names: Vec<_> = self.0.iter().map(|feature| format!("`{}`", feature.0)).collect();
        write!(
            f,
            "needs a build with {} {}, which this one lacks: cargo install --path crates/osp-cli --features {}",
            if names.len() == 1 { "the feature" } else { "the features" },
            names.join(" and "),
            all.join(",")
        )
    }
}

/// Commands and options that need a feature: the names of the command, then the names of the options. Without options,
/// the command and its subcommands need it.
const NEEDS: &[(&[&str], &[&str], Feature)] = &[
    (&["replay"], &["window", "paused", "trace"], Feature::WINDOW),
    (&["bench"], &[], Feature::BENCH),
    (&["draw-index"], &[], Feature::BENCH),
    (&["draw-insertion"], &[], Feature::BENCH),
    (&["draw-occlusion"], &[], Feature::BENCH),
    (&["race"], &[], Feature::BENCH),
    (&["replay"], &["chart"], Feature::BENCH),
    (&["replay"], &["draw"], Feature::RENDER),
    (&["render"], &[], Feature::RENDER),
    (&["film"], &[], Feature::RENDER),
    (&["thumbs"], &[], Feature::RENDER),
    (&["export"], &["compress"], Feature::RENDER),
    (&["convert"], &["compress"], Feature::RENDER),
    (&["rig", "monitors"], &[], Feature::WINDOW),
    (&["sketch"], &[], Feature::WINDOW),
    (&["sketch"], &["join", "name", "credentials", "unencrypted"], Feature::LIVE),
    (&["send"], &[], Feature::WINDOW),
    (&["join"], &[], Feature::LIVE),
];

/// Returns the parts of a command that this build lacks: the entries of [`NEEDS`] for it and for the commands above it.
fn lacking<'a>(
    names: &'a [&str],
) -> impl Iterator<Item = &'static (&'static [&'static str], &'static [&'static str], Feature)> + 'a {
    NEEDS.iter().filter(move |(of, options, feature)| {
        let is_of = if options.is_empty() { names.starts_with(of) } else { *of == names };
        is_of && !feature.is_built()
    })
}

/// Refuses a command line that needs a feature that this build lacks.
pub(super) fn check(matches: &ArgMatches) -> anyhow::Result<()> {
    let (mut names, mut below) = (Vec::new(), matches);
    while let Some((name, matches)) = below.subcommand() {
        names.push(name);
        below = matches;
    }
    let command = names.join(" ");
    let is_given =
        |name: &&&str| below.value_source(&name.replace('-', "_")) == Some(ValueSource::CommandLine);
    let mut needed = Vec::new();
    let mut what = None;
    for (_, options, feature) in lacking(&names) {
        let given = options.iter().find(is_given);
        if options.is_empty() || given.is_some() {
            what.get_or_insert_with(|| {
                given.map_or_else(|| format!("osp {command}"), |name| format!("osp {command} --{name}"))
            });
            needed.push(*feature);
        }
    }
    what.map_or(Ok(()), |what| refuse(what, &needed))
}
