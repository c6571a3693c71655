//! Commands and options that need a missing feature. Every build parses them, and refuses them with an error that names
//! the feature.

use std::fmt;

use anyhow::bail;
use clap::{ArgMatches, parser::ValueSource};

/// A feature of the crate that commands or options need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    Bench,
    Live,
    Peers,
    Render,
    Window,
}

impl Feature {
    const ALL: [Self; 5] = [Self::Bench, Self::Live, Self::Peers, Self::Render, Self::Window];

    /// Returns the feature's name in Cargo.toml.
    const fn name(self) -> &'static str {
        match self {
            Self::Bench => "bench",
            Self::Live => "live",
            Self::Peers => "peers",
            Self::Render => "render",
            Self::Window => "window",
        }
    }

    /// Whether this build has the feature.
    pub(super) const fn is_built(self) -> bool {
        match self {
            Self::Bench => cfg!(feature = "bench"),
            Self::Live => cfg!(feature = "live"),
            Self::Peers => cfg!(feature = "peers"),
            Self::Render => cfg!(feature = "render"),
            Self::Window => cfg!(feature = "window"),
        }
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
        let has_window = is_wanted(&Feature::Window);
        let is_within = |feature: &Feature| *feature == Feature::Render && has_window;
        let all = Feature::ALL.iter().filter(|feature| is_wanted(feature) && !is_within(feature));
        let all: Vec<_> = all.map(|feature| feature.name()).collect();
        let names: Vec<_> = self.0.iter().map(|feature| format!("`{}`", feature.name())).collect();
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
    (&["replay"], &["window", "paused", "trace"], Feature::Window),
    (&["bench"], &[], Feature::Bench),
    (&["draw-index"], &[], Feature::Bench),
    (&["draw-insertion"], &[], Feature::Bench),
    (&["draw-occlusion"], &[], Feature::Bench),
    (&["race"], &[], Feature::Bench),
    (&["replay"], &["chart"], Feature::Bench),
    (&["replay"], &["draw"], Feature::Render),
    (&["render"], &[], Feature::Render),
    (&["film"], &[], Feature::Render),
    (&["thumbs"], &[], Feature::Render),
    (&["export"], &["compress"], Feature::Render),
    (&["convert"], &["compress"], Feature::Render),
    (&["rig", "monitors"], &[], Feature::Window),
    (&["sketch"], &[], Feature::Window),
    (&["sketch"], &["join", "name", "credentials", "unencrypted"], Feature::Live),
    (&["send"], &[], Feature::Window),
    (&["join"], &[], Feature::Live),
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
