//! The help of all commands, the same in every build. `INSTA_UPDATE=always` records it anew.

use crate::OSP;

/// Adds the help of a command and of those below it.
fn add_help(command: &[&str], texts: &mut String) {
    let help = OSP.done([command, &["--help"]].concat());
    *texts += &format!("$ osp {}\n{help}\n", [command, &["--help"]].concat().join(" "));
    // The command's own list, and those of the program's groups.
    let lists = help.split("ommands:\n").skip(1).filter_map(|list| list.split("\n\n").next());
    let names = lists.flat_map(str::lines).filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    for name in names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
        add_help(&[command, &[name]].concat(), texts);
    }
}

#[test]
fn every_command_and_option_is_as_recorded() {
    let mut texts = String::new();
    add_help(&[], &mut texts);
    insta::assert_snapshot!(texts);
}
