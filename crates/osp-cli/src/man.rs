use std::{fs, path::PathBuf};

use anyhow::{Context, ensure};
use clap::{Args, Command};
use clap_mangen::Man;

use super::{outcome::Outcome, output::say, outputs::Outputs};
use osp_session::{atomic_file::Destination, output_file::OutputKind};

/// Write the manual for `man`: one page for each command.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  osp man --to ~/.local/share/man/man1 && man osp-replay")]
pub(super) struct ManArgs {
    /// A folder for the pages. The command makes it if it does not exist.
    #[arg(long, value_name = "DIR")]
    to: PathBuf,
    /// Replace files of another kind.
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: &ManArgs, program: Command) -> anyhow::Result<Outcome> {
    let named = || args.to.display().to_string();
    ensure!(args.to.is_dir() || !args.to.exists(), "{}: expected a folder", named());
    fs::create_dir_all(&args.to).with_context(named)?;
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    add_pages(&program, "osp", &mut pages);
    let mut outputs = Outputs::new(args.force);
    let mut written = Vec::new();
    for (file, command) in &pages {
        let mut page = Vec::new();
        Man::new(command.clone()).render(&mut page)?;
        let path = args.to.join(file);
        let is_file = matches!(Destination::of(&path), Ok(Destination::File(_)));
        ensure!(is_file, "{}: expected a regular file; found a pipe or a device", path.display());
        written.push((outputs.add("--to", &path, OutputKind::Manual)?, page));
    }
    written.iter().try_for_each(|(output, page)| output.write(page))?;
    say(&format!("{} pages in {}", pages.len(), named()))?;
    Ok(Outcome::Done)
}

/// Adds the page of a command and the pages of its subcommands.
fn add_pages(command: &Command, name: &str, pages: &mut Vec<(String, Command)>) {
    pages.push((format!("{name}.1"), command.clone()));
    for part in command.get_subcommands() {
        add_pages(part, &format!("{name}-{}", part.get_name()), pages);
    }
}
