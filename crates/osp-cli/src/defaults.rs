//! The user's defaults of options: a file of TOML, `osp/config.toml` in the folder of the user's settings.
//!
//! They become words of the command line, so that every rule about options holds for them, too. An option that is given
//! replaces the default, and turns off those defaults that it cannot be combined with.

use std::{
    env,
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail, ensure};
use clap::{Arg, ArgAction, ArgMatches, Command, parser::ValueSource};
use toml_edit::{Document, Item, TableLike, Value};

use super::{built::lacks_option, output::one_line};
use osp_session::{platform::user_folder, small_file::read_text};

/// Names another file of defaults; none if it is empty.
pub(super) const VARIABLE: &str = "OSP_CONFIG";
/// Largest file of defaults that is read.
const MOST_BYTES: u64 = 1 << 20;
/// Commands that ignore the file, so that they run even if it is damaged.
const WITHOUT: [&str; 4] = ["completions", "config", "help", "man"];

/// A default that the file gives.
pub(super) struct UserDefault {
    /// Its tables and its name, as they are in the file.
    pub(super) key: Vec<String>,
    /// Several for an option that takes a list.
    pub(super) values: Vec<String>,
    is_bool: bool,
    /// The line of the file, from 1.
    line: usize,
}

impl UserDefault {
    /// The name of the option, without dashes.
    pub(super) fn option(&self) -> &str {
        self.key.last().map_or("", String::as_str)
    }

    /// The commands that the default is for: the names on the way to a command, or none for all.
    pub(super) fn tables(&self) -> &[String] {
        &self.key[..self.key.len().saturating_sub(1)]
    }
}

/// Where the defaults are; `None` if there are to be none.
pub(super) fn path() -> Option<PathBuf> {
    match env::var_os(VARIABLE) {
        Some(path) if path.is_empty() => None,
        Some(path) => Some(PathBuf::from(path)),
        // A file of the working folder is not the user's.
        None if ["XDG_CONFIG_HOME", "APPDATA", "HOME"].iter().all(|name| env::var_os(name).is_none()) => None,
        None => Some(user_folder("XDG_CONFIG_HOME", ".config/osp").join("config.toml")),
    }
}

/// The text of the file; empty if there is none.
pub(super) fn text(path: &Path) -> anyhow::Result<String> {
    match read_text(path, MOST_BYTES) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(String::new()),
        text => text.with_context(|| path.display().to_string()),
    }
}

/// Adds the file's defaults to the words of a command line, as words behind the names of its command.
pub(super) fn added(program: &Command, words: &[OsString]) -> anyhow::Result<Vec<OsString>> {
    let is_there = |path: &PathBuf| {
        fs::metadata(path).map_or_else(|error| error.kind() != io::ErrorKind::NotFound, |_| true)
    };
    let Some(path) = path().filter(is_there) else { return Ok(words.to_vec()) };
    // Only to know the command and what is given: whether the words can be understood is seen later.
    let Ok(matches) = program.clone().ignore_errors(true).try_get_matches_from(words) else {
        return Ok(words.to_vec());
    };
    let mut names = Vec::new();
    let mut below = &matches;
    while let Some((name, matches)) = below.subcommand() {
        names.push(name);
        below = matches;
    }
    if names.first().is_none_or(|name| WITHOUT.contains(name)) {
        return Ok(words.to_vec());
    }
    let text = text(&path)?;
    let found = read(&path, &text)?;
    let mut built = program.clone();
    built.build();
    let Some(command) = at(&built, &names) else { return Ok(words.to_vec()) };
    let mut all = words.to_vec();
    let behind = (1 + names.len()).min(all.len());
    for (arg, default) in chosen(command, &names, &found) {
        if is_left_to(command, arg, below) {
            let more = words_for(arg, default).map_err(|what| placed(&path, default, &what))?;
            all.splice(behind..behind, more.into_iter().map(OsString::from));
        }
    }
    Ok(all)
}

/// Reads a file of defaults.
pub(super) fn read(path: &Path, text: &str) -> anyhow::Result<Vec<UserDefault>> {
    let line_of = |at: usize| text.get(..at).map_or(1, |before| before.matches('\n').count() + 1);
    let document = Document::parse(text).map_err(|error| {
        let line = error.span().map_or(1, |span| line_of(span.start));
        anyhow!("{}: line {line}: expected TOML: {}", path.display(), one_line(error.message()))
    })?;
    let mut found = Vec::new();
    collect(document.as_table(), &mut Vec::new(), &line_of, &mut found)
        .map_err(|error| anyhow!("{}: {error:#}", path.display()))?;
    Ok(found)
}

/// Checks a default against every command that it is for.
pub(super) fn check(program: &Command, path: &Path, default: &UserDefault) -> anyhow::Result<()> {
    check_option(program, default).map_err(|error| placed(path, default, &format!("{error:#}")))
}

fn placed(path: &Path, default: &UserDefault, what: &str) -> anyhow::Error {
    anyhow!("{}: line {}: {}: {what}", path.display(), default.line, default.key.join("."))
}

fn collect(
    table: &dyn TableLike,
    tables: &mut Vec<String>,
    line_of: &impl Fn(usize) -> usize,
    found: &mut Vec<UserDefault>,
) -> anyhow::Result<()> {
    for (name, item) in table.iter() {
        tables.push(name.to_owned());
        let span = item.span().or_else(|| table.key(name).and_then(|key| key.span()));
        let line = span.map_or(1, |span| line_of(span.start));
        if let Some(table) = item.as_table_like() {
            collect(table, tables, line_of, found)?;
        } else {
            let of_value = |value: &Value| match value {
                Value::String(text) => Some(text.value().clone()),
                Value::Integer(number) => Some(number.display_repr().into_owned()),
                Value::Float(number) => Some(number.display_repr().into_owned()),
                Value::Boolean(is) => Some(is.value().to_string()),
                _ => None,
            };
            let values: Option<Vec<String>> = match item {
                Item::Value(Value::Array(values)) => values.iter().map(of_value).collect(),
                Item::Value(value) => of_value(value).map(|value| vec![value]),
                _ => None,
            };
            let values = values.with_context(|| {
                format!(
                    "line {line}: {}: expected text, a number, true, false, or a list of them",
                    tables.join(".")
                )
            })?;
            let is_bool = item.as_bool().is_some();
            found.push(UserDefault { key: tables.clone(), values, is_bool, line });
        }
        tables.pop();
    }
    Ok(())
}

/// The command that these names lead to.
fn at<'a>(program: &'a Command, names: &[impl AsRef<str>]) -> Option<&'a Command> {
    names.iter().try_fold(program, |command, name| command.find_subcommand(name.as_ref()))
}

fn option<'a>(command: &'a Command, name: &str) -> Option<&'a Arg> {
    let settable = |arg: &&Arg| {
        !arg.is_positional() && !matches!(arg.get_action(), ArgAction::Help | ArgAction::Version)
    };
    command.get_arguments().filter(settable).find(|arg| arg.get_long() == Some(name))
}

/// Checks that a default names an option, and that each command that has it would take its values.
fn check_option(program: &Command, default: &UserDefault) -> anyhow::Result<()> {
    let start = match at(program, default.tables()) {
        Some(command) if !default.tables().first().is_some_and(|name| WITHOUT.contains(&name.as_str())) => {
            command
        }
        _ => bail!("expected the name of a command before the option (osp --help lists them)"),
    };
    let mut commands = Vec::new();
    match default.tables().is_empty() {
        true => below(start, &mut commands),
        false => commands.push(start),
    }
    commands.retain(|command| option(command, default.option()).is_some());
    ensure!(!commands.is_empty(), "{}", no_such_option(program, start, default));
    for command in commands {
        let arg = option(command, default.option()).context("an option that was found")?;
        words_for(arg, default).map_err(|what| anyhow!("osp {}: {what}", command.get_name()))?;
    }
    Ok(())
}

fn below<'a>(command: &'a Command, found: &mut Vec<&'a Command>) {
    for command in command.get_subcommands().filter(|command| !WITHOUT.contains(&command.get_name())) {
        found.push(command);
        below(command, found);
    }
}

fn no_such_option(program: &Command, command: &Command, default: &UserDefault) -> String {
    let mut commands = vec![command];
    if default.tables().is_empty() {
        below(program, &mut commands);
    }
    let names = commands.iter().flat_map(|command| command.get_arguments()).filter_map(Arg::get_long);
    let nearest =
        names.max_by(|a, b| likeness(a, default.option()).total_cmp(&likeness(b, default.option())));
    let of = match default.tables() {
        [] => "a command".to_owned(),
        names => format!("osp {}", names.join(" ")),
    };
    match nearest.filter(|name| likeness(name, default.option()) > 0.7) {
        Some(name) => format!("expected an option of {of}, without its dashes; did you mean {name}?"),
        None => format!("expected an option of {of}, without its dashes"),
    }
}

fn likeness(a: &str, b: &str) -> f64 {
    strsim::jaro_winkler(a, b)
}

/// The words that give the option these values, or what is wrong with them. None for a switch that stays off.
fn words_for(arg: &Arg, default: &UserDefault) -> Result<Vec<String>, String> {
    if arg.is_required_set() {
        return Err("it has to be given each time and can have no default".to_owned());
    }
    let name = arg.get_long().unwrap_or_default();
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        let is_on = default.values.first().is_some_and(|value| value == "true");
        return match default.is_bool {
            true => Ok(is_on.then(|| format!("--{name}")).into_iter().collect()),
            false => Err("expected true or false".to_owned()),
        };
    }
    let words: Vec<String> = match (arg.get_value_delimiter(), default.values.as_slice()) {
        (_, []) => return Err("expected a value".to_owned()),
        (_, [one]) => vec![format!("--{name}={one}")],
        (Some(delimiter), several) => vec![format!("--{name}={}", several.join(&delimiter.to_string()))],
        (None, several) if matches!(arg.get_action(), ArgAction::Append) => {
            several.iter().map(|value| format!("--{name}={value}")).collect()
        }
        (None, several) if arg.get_num_args().is_some_and(|number| number.max_values() > 1) => {
            std::iter::once(format!("--{name}")).chain(several.iter().cloned()).collect()
        }
        _ => return Err("expected one value".to_owned()),
    };
    // The values are parsed as they would be on the command line.
    let mut tried = Arg::new("value").long(name.to_owned()).value_parser(arg.get_value_parser().clone());
    tried = tried.action(arg.get_action().clone()).allow_hyphen_values(true);
    if let Some(delimiter) = arg.get_value_delimiter() {
        tried = tried.value_delimiter(delimiter);
    }
    if let Some(number) = arg.get_num_args() {
        tried = tried.num_args(number);
    }
    let program = Command::new("osp").disable_help_flag(true).arg(tried);
    match program.try_get_matches_from(std::iter::once("osp").chain(words.iter().map(String::as_str))) {
        Ok(_) => Ok(words),
        Err(error) => {
            let said = error.render().to_string();
            let said = said.split("For more information").next().unwrap_or_default();
            let words: Vec<&str> = said.split_whitespace().collect();
            Err(words.join(" ").trim_start_matches("error: ").to_owned())
        }
    }
}

/// The defaults for a command: those in its table, and of the general ones those that it has no own for.
fn chosen<'a>(
    command: &'a Command,
    names: &[&str],
    found: &'a [UserDefault],
) -> Vec<(&'a Arg, &'a UserDefault)> {
    let own = |default: &&UserDefault| default.tables().iter().map(String::as_str).eq(names.iter().copied());
    let options = command.get_arguments().filter_map(|arg| option(command, arg.get_long()?));
    let default = |arg: &Arg| {
        let named = || found.iter().filter(|default| Some(default.option()) == arg.get_long());
        named().find(own).or_else(|| named().find(|default| default.tables().is_empty()))
    };
    let is_built = |arg: &&Arg| !lacks_option(names, arg.get_long().unwrap_or_default());
    options.filter(is_built).filter_map(|arg| Some((arg, default(arg)?))).collect()
}

/// Whether the command line leaves an option to its default: neither it nor one that excludes it is given.
fn is_left_to(command: &Command, arg: &Arg, matches: &ArgMatches) -> bool {
    let is_given = |arg: &Arg| matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
    let excludes =
        |a: &Arg, b: &Arg| command.get_arg_conflicts_with(a).iter().any(|arg| arg.get_id() == b.get_id());
    !command
        .get_arguments()
        .filter(|other| is_given(other))
        .any(|other| other.get_id() == arg.get_id() || excludes(other, arg) || excludes(arg, other))
}
