use std::{fs, io::Write, path::PathBuf};

use anyhow::{Context, bail};
use clap::{Args, Command};
use clap_mangen::Man;

use super::{Outcome, output::say};
use osp_session::atomic_file::AtomicFile;

/// Write the manual: a page for each command, for `man`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  osp man --to ~/.local/share/man/man1 && man osp-replay")]
pub(super) struct ManArgs {
    /// A folder for the pages; it is made if there is none.
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
    /// Replace pages that are there.
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &ManArgs, program: Command) -> anyhow::Result<Outcome> {
    let named = || args.to.display().to_string();
    fs::create_dir_all(&args.to).with_context(named)?;
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    add_pages(&program, "osp", &mut pages);
    let there = pages.iter().map(|(file, _)| args.to.join(file)).find(|path| path.symlink_metadata().is_ok());
    if let Some(path) = there.filter(|_| !args.force) {
        bail!("{}: there is a file already; --force replaces it", path.display());
    }
    for (file, command) in &pages {
        let mut page = Vec::new();
        Man::new(command.clone()).render(&mut page)?;
        let path = args.to.join(file);
        let write = || {
            let mut file = AtomicFile::create(&path)?;
            file.write_all(&page)?;
            if args.force { file.commit() } else { file.commit_new() }
        };
        write().with_context(|| path.display().to_string())?;
    }
    say(&format!("{} pages in {}", pages.len(), named()))?;
    Ok(Outcome::Done)
}

/// The page of a command and those of the commands below it.
fn add_pages(command: &Command, name: &str, pages: &mut Vec<(String, Command)>) {
    pages.push((format!("{name}.1"), command.clone()));
    for part in command.get_subcommands() {
        add_pages(part, &format!("{name}-{}", part.get_name()), pages);
    }
}
