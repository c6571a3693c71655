//! Numbers on the command line: done, refused, or a failed check; never a panic, an abort or memory without bound.

use std::{
    path::Path,
    process::{Command, Stdio},
};

use osp_session::recording::{Flush, RonWriter, SynthKind, synthesize};

use super::generator::Generator;
use crate::OSP;
use osp_testkit::stderr;

const NUMBERS: &str = "NaN|-NaN|inf|-inf|-1|-0|0|1|7|1.5|0x10|1e39|-1e39|1e-320|1e400|65536|2147483648|4294967295|\
    4294967296|18446744073709551615|18446744073709551616|| |٣|1_000|samples:0|samples:1|samples:4294967295|\
    samples:4294967296|samples:-1|last";

/// What is asked (`S` is a session, `O` an output), and the option that gets a number, or two with a `,` or an `x`
/// between them.
const ASKED: &[(&str, &str)] = &[
    ("replay S", "--pace"),
    ("replay S", "--budget"),
    ("replay S --index osp --occlusion auto", "--polygon-ns"),
    ("replay S --index osp --occlusion msvbsp,auto", "--occluders"),
    ("replay S --index osp --occlusion msvbsp", "--verify-frames"),
    ("verify S --views 1 --pixels 64x48", "--occluders"),
    ("verify S --views 1 --pixels 64x48", "--size x"),
    ("verify S --views 1", "--pixels x"),
    ("bake S O.pvs --samples 1 --pixels 16", "--cells"),
    ("bake S O.pvs --cells 1 --pixels 16", "--samples"),
    ("bake S O.pvs --cells 1 --samples 1", "--pixels"),
    ("draw-index S O.svg", "--frame"),
    ("draw-index S O.svg", "--pace"),
    ("draw-insertion S O.gif", "--polygons"),
    ("draw-insertion S O.gif --polygons 2", "--levels"),
    ("draw-occlusion S O.svg", "--occluders"),
    ("draw-occlusion S O.gif", "--every"),
    ("race S", "--pace"),
    ("pick S", "--at ,"),
    ("pick S --at 0.5,0.5", "--frame"),
    ("synth scribble --polygons 20 O.ron", "--seed"),
];

#[test]
fn command_line() {
    let folder = tempfile::tempdir().unwrap();
    let session = folder.path().join("s.ron");
    let mut made = synthesize(SynthKind::Scribble, 60, 1);
    let mut writer = RonWriter::create(&session, &made.header, Flush::AtEnd).unwrap();
    made.by_ref().for_each(|event| writer.write(&event.unwrap()).unwrap());
    writer.finish().unwrap();
    let mut generator = Generator::new(7);
    let numbers: Vec<&str> = NUMBERS.split('|').collect();
    let cases = std::env::var("OSP_FUZZ_CASES").ok().map_or(1, |text| text.parse::<usize>().unwrap()) * 80;
    for case in 0..cases {
        let (asked, option) = ASKED[case % ASKED.len()];
        let mut number = || numbers[generator.below(numbers.len())].to_owned();
        let (option, value) = match option.split_once(' ') {
            Some((option, between)) => (option, format!("{}{between}{}", number(), number())),
            None => (option, number()),
        };
        let mut args: Vec<String> = asked.split(' ').map(|word| place(word, folder.path())).collect();
        args.push(format!("{option}={value}"));
        ask(&args);
    }
}

fn place(word: &str, folder: &Path) -> String {
    match word {
        "S" => folder.join("s.ron").display().to_string(),
        word if word.starts_with("O.") => folder.join(word).display().to_string(),
        word => word.to_owned(),
    }
}

fn ask(args: &[String]) {
    let osp = OSP.0;
    // 8 GB of address space: memory without bound fails at once.
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -v 8000000; exec \"$0\" \"$@\"", osp]);
        shell
    } else {
        Command::new(osp)
    };
    let output = command.args(args).stdin(Stdio::null()).output().unwrap();
    let said = stderr(&output);
    let is_sound = matches!(output.status.code(), Some(0..=2)) && !said.contains("panicked");
    assert!(is_sound, "osp {}: {}\n{said}", args.join(" "), output.status);
    assert!(output.status.code() != Some(2) || said.starts_with("error: "), "osp {}: {said}", args.join(" "));
}
