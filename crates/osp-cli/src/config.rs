//! `osp config`: the user's defaults of options.

use std::{fs, io::Write, path::Path};

use anyhow::{Context, ensure};
use clap::{Args, Command, Subcommand};
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value, value};

use super::{
    Outcome,
    defaults::{self, UserDefault},
    output::say,
};
use osp_session::atomic_file::AtomicFile;

/// Show or change your own defaults: the values that options have when the command line does not give them.
///
/// They are kept in a file of TOML, osp/config.toml in the folder XDG_CONFIG_HOME (else ~/.config), which may also be edited by
/// hand. The variable OSP_CONFIG names another file; if it is empty, commands run without defaults.
#[derive(Args, Debug)]
#[command(
    after_help = "A key is an option's name without dashes. At the top of the file it is for every command that has the option,
under [COMMAND] for that command alone:
  max-polygons = 50000000
  index = \"osp\"
  [replay]
  pace = \"samples:16\"
  index = [\"osp\", \"brute-simd\"]
  [bench]
  html = \"bench.html\"
An option that is given on the command line replaces the default, and turns off those defaults that it cannot be
combined with. A switch that the file turns on can be turned off only by running without the file.
--help shows the program's own defaults, not yours.

Examples:
  osp config
  osp config set max-polygons 50000000
  osp config set replay.index osp brute-simd
  osp config unset replay.index
  OSP_CONFIG= osp replay recordings/portrait.ron   (without the file)"
)]
pub(super) struct ConfigArgs {
    #[command(subcommand)]
    what: Option<What>,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Print the file's path and the defaults in it, and check them (this is what `osp config` does).
    Show,
    /// Print the file's path.
    Path,
    /// Set a default.
    Set {
        /// OPTION, for every command that has it, or COMMAND.OPTION.
        key: String,
        /// The value. Give several for a list, and true or false for a switch.
        #[arg(required = true, allow_hyphen_values = true)]
        values: Vec<String>,
    },
    /// Remove a default.
    Unset {
        /// OPTION or COMMAND.OPTION.
        key: String,
    },
}

pub(super) fn run(args: &ConfigArgs, mut program: Command) -> anyhow::Result<Outcome> {
    program.build();
    let path = defaults::path()
        .with_context(|| format!("{} is empty: there is no file of defaults", defaults::VARIABLE))?;
    match args.what.as_ref().unwrap_or(&What::Show) {
        What::Path => say(&path.display().to_string())?,
        What::Show => show(&program, &path)?,
        What::Set { key, values } => {
            let (commands, option) = key_parts(key)?;
            change(
                &path,
                |document| set(document, &commands, option, values),
                |found| {
                    found
                        .iter()
                        .filter(|one| one.tables() == commands && one.option() == option)
                        .try_for_each(|one| defaults::check(&program, &path, one))
                },
            )?;
            say(&format!("{key} = {} in {}", values.join(" "), path.display()))?;
        }
        What::Unset { key } => {
            change(&path, |document| unset(document, key), |_| Ok(()))?;
            say(&format!("{key} removed from {}", path.display()))?;
        }
    }
    Ok(Outcome::Done)
}

fn show(program: &Command, path: &Path) -> anyhow::Result<()> {
    let text = defaults::text(path)?;
    let found = defaults::read(path, &text)?;
    if found.is_empty() {
        return say(&format!("{}: no defaults; osp config set OPTION VALUE adds one", path.display()));
    }
    say(&format!("{}", path.display()))?;
    for default in &found {
        say(&format!("  {} = {}", default.key.join("."), default.values.join(" ")))?;
    }
    found.iter().try_for_each(|default| defaults::check(program, path, default))
}

/// Changes the file, leaving its comments and everything else in it as they are. What does not pass the check is not written.
fn change(
    path: &Path,
    how: impl FnOnce(&mut DocumentMut) -> anyhow::Result<()>,
    check: impl FnOnce(&[UserDefault]) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let named = || path.display().to_string();
    let text = defaults::text(path)?;
    // What is wrong in the file is said with its line.
    defaults::read(path, &text)?;
    let mut document: DocumentMut = text.parse().with_context(named)?;
    how(&mut document)?;
    let text = document.to_string();
    check(&defaults::read(path, &text)?)?;
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let write = || {
        let mut file = AtomicFile::create(path)?;
        file.write_all(text.as_bytes())?;
        file.commit()
    };
    write().with_context(named)?;
    Ok(())
}

/// The names on the way to a command, and that of an option of it.
fn key_parts(key: &str) -> anyhow::Result<(Vec<&str>, &str)> {
    let mut parts: Vec<&str> = key.split('.').collect();
    let option = parts.pop().filter(|option| !option.is_empty() && parts.iter().all(|part| !part.is_empty()));
    Ok((parts, option.with_context(|| format!("{key}: expected OPTION or COMMAND.OPTION"))?))
}

fn set(document: &mut DocumentMut, commands: &[&str], option: &str, values: &[String]) -> anyhow::Result<()> {
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for command in commands {
        let below = table.entry(command).or_insert_with(|| Item::Table(Table::new()));
        table =
            below.as_table_like_mut().with_context(|| format!("{command}: expected a table in the file"))?;
    }
    let new = match values {
        [one] => typed(one),
        several => Value::Array(several.iter().map(|one| typed(one)).collect::<Array>()),
    };
    match table.get_mut(option) {
        // What stands behind it in the line stays.
        Some(Item::Value(old)) => {
            let around = old.decor().clone();
            *old = new;
            *old.decor_mut() = around;
        }
        _ => drop(table.insert(option, value(new))),
    }
    Ok(())
}

fn typed(text: &str) -> Value {
    match text.parse::<i64>() {
        // What would be written in another way is text: a key, a name.
        Ok(number) if number.to_string() == text => number.into(),
        _ => text.parse::<bool>().map_or_else(|_| text.into(), Value::from),
    }
}

fn unset(document: &mut DocumentMut, named: &str) -> anyhow::Result<()> {
    let (commands, option) = key_parts(named)?;
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for command in commands {
        let below = table.get_mut(command).and_then(Item::as_table_like_mut);
        table = below.with_context(|| format!("{named}: the file has no such default"))?;
    }
    ensure!(table.remove(option).is_some(), "{named}: the file has no such default");
    Ok(())
}
