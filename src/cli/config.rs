//! `osp config`: the user's defaults of options.

use std::{fs, io::Write, path::Path};

use anyhow::{Context, bail, ensure};
use clap::{Args, Command, Subcommand};
use toml_edit::{Array, DocumentMut, Item, Table, Value, value};

use super::{Outcome, defaults, output::say};
use crate::atomic_file::AtomicFile;

/// Show or change the defaults of options: what a command takes where the command line says nothing.
///
/// They are kept in a file of TOML, osp/config.toml in the folder XDG_CONFIG_HOME (else ~/.config), which may also be edited by
/// hand. The variable OSP_CONFIG names another file; if it is empty, commands run without defaults.
#[derive(Args, Debug)]
#[command(
    after_help = "A key is an option without its dashes, for every command that has it, or after the name of one command:
  index = \"osp\"
  lenient = true
  [replay]
  pace = \"samples:16\"
  index = [\"osp\", \"brute-simd\"]
  [study.report]
  html = \"study.html\"
What the command line says counts more, also an option there that excludes one of the file.

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
    /// Print the file's path and the defaults in it, checked (this is what `osp config` does).
    Show,
    /// Print the file's path.
    Path,
    /// Set a default.
    Set {
        /// OPTION, for every command that has it, or COMMAND.OPTION.
        key: String,
        /// The value; several for an option that takes a list; true or false for one that takes none.
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
            change(&program, &path, |document| set(document, &key_parts(key)?, values))?;
            say(&format!("{key} = {} in {}", values.join(" "), path.display()))?;
        }
        What::Unset { key } => {
            change(&program, &path, |document| unset(document, &key_parts(key)?, key))?;
            say(&format!("{key} removed from {}", path.display()))?;
        }
    }
    Ok(Outcome::Done)
}

fn show(program: &Command, path: &Path) -> anyhow::Result<()> {
    let text = defaults::text(path)?;
    let found = defaults::read(program, path, &text)?;
    if found.is_empty() {
        return say(&format!("{}: no defaults; osp config set OPTION VALUE adds one", path.display()));
    }
    say(&format!("{}", path.display()))?;
    for default in found {
        say(&format!("  {} = {}", default.key.join("."), default.values.join(" ")))?;
    }
    Ok(())
}

/// Changes the file, leaving its comments and what it does not name as they are. A change after which the file could not be
/// read is not made.
fn change(
    program: &Command,
    path: &Path,
    how: impl FnOnce(&mut DocumentMut) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let named = || path.display().to_string();
    let text = defaults::text(path)?;
    let mut document: DocumentMut = text.parse().with_context(named)?;
    how(&mut document)?;
    let text = document.to_string();
    defaults::read(program, path, &text)?;
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

fn key_parts(key: &str) -> anyhow::Result<Vec<&str>> {
    let parts: Vec<&str> = key.trim_start_matches('-').split('.').collect();
    ensure!(parts.iter().all(|part| !part.is_empty()), "{key}: expected OPTION or COMMAND.OPTION");
    Ok(parts)
}

fn set(document: &mut DocumentMut, key: &[&str], values: &[String]) -> anyhow::Result<()> {
    let Some((option, commands)) = key.split_last() else { bail!("expected OPTION or COMMAND.OPTION") };
    let mut table = document.as_table_mut();
    for command in commands {
        let below = table.entry(command).or_insert_with(|| Item::Table(Table::new()));
        table = below.as_table_mut().with_context(|| format!("{command}: expected a table in the file"))?;
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
        Ok(number) => number.into(),
        Err(_) => text.parse::<bool>().map_or_else(|_| text.into(), Value::from),
    }
}

fn unset(document: &mut DocumentMut, key: &[&str], named: &str) -> anyhow::Result<()> {
    let Some((option, commands)) = key.split_last() else { bail!("expected OPTION or COMMAND.OPTION") };
    let mut table = document.as_table_mut();
    for command in commands {
        let below = table.get_mut(command).and_then(Item::as_table_mut);
        table = below.with_context(|| format!("{named}: the file has no such default"))?;
    }
    ensure!(table.remove(option).is_some(), "{named}: the file has no such default");
    Ok(())
}
