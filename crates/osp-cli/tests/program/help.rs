//! The commands with their options, defaults and values, the same in every build, without the text of long pages.
//! `INSTA_UPDATE=always` records them anew.

use crate::OSP;

/// The usage, arguments, options, defaults and values in a command's help.
fn options(help: &str) -> String {
    let mut is_open = false;
    let lines = help.lines().filter(|line| {
        let text = line.trim_start();
        is_open |= text.starts_with("[default: ") || text.starts_with("[possible values: ");
        let is_value = is_open;
        is_open &= !text.is_empty() && !text.ends_with(']');
        let is_option = line.len() - text.len() < 10 && text.starts_with(['-', '<', '[']);
        is_value || is_option || line.starts_with("Usage: ")
    });
    lines.map(|line| format!("{line}\n")).collect()
}

/// Adds the options of a command and of those below it.
fn add_help(command: &[&str], texts: &mut String) {
    let help = OSP.done([command, &["--help"]].concat());
    *texts += &format!("{}\n", options(&help));
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
