use clap::{Args, Command};
use clap_complete::{Shell, generate};

use super::{outcome::Outcome, output::print_result};

/// Print a completion script for a shell.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp completions bash > ~/.local/share/bash-completion/completions/osp
  osp completions zsh > ~/.zfunc/_osp
  osp completions fish > ~/.config/fish/completions/osp.fish")]
pub(super) struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

pub(super) fn run(args: &CompletionsArgs, mut program: Command) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    generate(args.shell, &mut program, "osp", &mut script);
    print_result(String::from_utf8(script)?.trim_end())?;
    Ok(Outcome::Done)
}
