use std::path::PathBuf;

use clap::{Args, Subcommand};
use comfy_table::CellAlignment;
use glam::Quat;

#[cfg(not(all(feature = "bench", feature = "window")))]
use super::built::{self, Feature};
use super::{
    output::{Outcome, one_line, print_result, warn},
    outputs::ForceArgs,
    rig_args::rig_file,
};
use osp_lab::report::columns_table;
#[cfg(feature = "bench")]
use osp_lab::report::{ChartFormat, RigPlan};
use osp_session::rig::{Eye, Eyes, Output, Rig, Screen, Viewport};

/// Check and show a rig, the screens around a tracked head.
#[derive(Args, Debug)]
#[command(after_help = FORMAT)]
pub(super) struct RigCommand {
    #[command(subcommand)]
    what: What,
}

const FORMAT: &str = "A rig is a RON file. In the comments, [ ] contains the default of an optional field:
  (
    name: \"two walls\",
    // Position of the head before a tracker reports it, metres, y up.
    head: (0.0, 1.6, 0.0),
    // Distance between the eyes, metres [0.064].
    eye_separation_m: 0.064,
    // Mono, SideBySide, TopBottom, Anaglyph or Windows [Mono].
    stereo: SideBySide,
    // Whether to exchange the pictures of the two eyes [false].
    swap_eyes: false,
    // Transform from the tracker's space to the room's space [the same space].
    room_from_tracker: (p: (0, 0, 0), q: (0, 0, 0, 1)),
    // 1 to 16 rectangles, each given by three corners, as seen from the front.
    screens: [
      (
        name: \"left\",
        lower_left: (-1.7, 0.3, 0.0),
        lower_right: (0.0, 0.3, -1.7),
        upper_left: (-1.7, 2.1, 0.0),
        // Monitors that show this screen [a part of the first window].
        outputs: [(monitor: \"2\", viewport: (0, 0, 1, 1))],
      ),
    ],
  )
An output contains the name or number of a monitor (`osp rig monitors` lists them). A window without borders and \
panels covers this monitor. `viewport` is the part of the monitor that shows the screen: left, top, width and \
height, each from 0 to 1 [all]. With `stereo: Windows`, the outputs `eyes: Left` and `eyes: Right` of a screen show \
the picture of one eye each, for two projectors. The first window has the panels and opens on a monitor that the \
rig does not use.
osp draws with wgpu, which supports neither quad-buffered stereo nor genlock (the locking of several displays to \
one frame). Drivers and projectors apply warp meshes.
Rigs in osp: desktop, dual-wall, cave4.

Examples:
  osp rig show dual-wall plan.svg
  osp rig monitors
  osp sketch --rig walls.ron --stereo side-by-side";

#[derive(Subcommand, Debug)]
enum What {
    /// List the monitors that a rig may name.
    Monitors,
    /// Print the sizes of a rig's screens and their distances and angles from the head. Optionally draw a plan. The exit
    /// code is 1 if the head is behind a screen, 2 if the file is no rig.
    Show {
        /// A file, or the name of a rig in osp.
        #[arg(value_name = "RIG")]
        rig: String,
        /// The plan of the room to write, .svg or .png: from above and from the front.
        #[arg(value_name = "PLAN")]
        plan: Option<PathBuf>,
        #[command(flatten)]
        force: ForceArgs,
    },
}

pub(super) fn run(args: &RigCommand) -> anyhow::Result<Outcome> {
    match &args.what {
        #[cfg(feature = "window")]
        What::Monitors => monitors(),
        #[cfg(not(feature = "window"))]
        What::Monitors => built::refuse("osp rig monitors", &[Feature::Window]),
        What::Show { rig, plan, force } => show(rig, plan.as_ref(), *force),
    }
}

/// Warns of screens whose picture the head cannot see.
fn check(name: &str, rig: &Rig) -> Outcome {
    let mut outcome = Outcome::Done;
    for screen in &rig.screens {
        let is_blind = |eye: &&Eye| {
            let eye = rig.eye_in_room(**eye, rig.head, Quat::IDENTITY);
            screen.view(eye, NEAR_M, FAR_M).is_none()
        };
        if let Some(eye) = rig.stereo.eyes().iter().find(is_blind) {
            outcome = Outcome::CheckFailed;
            warn(&format!(
                "{name}: the {} of the head at {} is not in front of screen `{}`: the corners of the screen are in the wrong order, or \
                 the head is behind the screen",
                eye.name(),
                rig.head,
                screen.name
            ));
        }
    }
    outcome
}

#[cfg(feature = "window")]
fn monitors() -> anyhow::Result<Outcome> {
    let monitors = osp_app::monitors()?;
    if monitors.is_empty() {
        warn("the display has no monitors");
    }
    for monitor in monitors {
        print_result(&monitor.to_string())?;
    }
    Ok(Outcome::Done)
}

/// Near plane, which a view requires. It does not affect the output.
const NEAR_M: f32 = 0.01;
/// Far plane, like [`NEAR_M`].
const FAR_M: f32 = 100.0;

fn show(name: &str, plan: Option<&PathBuf>, force: ForceArgs) -> anyhow::Result<Outcome> {
    #[cfg(not(feature = "bench"))]
    if plan.is_some() {
        return built::refuse("osp rig show RIG PLAN", &[Feature::Bench]);
    }
    let rig = Rig::open(name)?;
    let mut outputs = force.outputs().reads(&rig_file(name));
    let output = outputs.add_any(plan, &[".svg", ".png"])?;
    print_result(&format!(
        "{}: {}, eyes {} mm apart, head at {}",
        one_line(&rig.name),
        rig.stereo.name(),
        (rig.eye_separation_m * 1000.0).round(),
        rig.head
    ))?;
    let mut table = columns_table();
    let header = ["screen", "width\nm", "height\nm", "from head\nm", "across\ndegrees", "up\ndegrees"];
    table.set_header(header);
    for screen in &rig.screens {
        table.add_row(row(&rig, screen));
    }
    table.column_iter_mut().skip(1).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    print_result(&table.to_string())?;
    for screen in &rig.screens {
        for output in &screen.outputs {
            print_result(&shown_on(screen, output))?;
        }
    }
    #[cfg(not(feature = "bench"))]
    let _ = output;
    #[cfg(feature = "bench")]
    if let Some(output) = output {
        output.write_by(|file| file.write_all(&RigPlan(&rig).encode(ChartFormat::of(output.path()))?))?;
    }
    Ok(check(name, &rig))
}

/// Returns a line about an output: the monitor, the viewport and the eyes.
fn shown_on(screen: &Screen, output: &Output) -> String {
    let Viewport(x, y, width, height) = output.viewport;
    let part = match output.viewport == Viewport::WHOLE {
        true => String::new(),
        false => format!(", from ({x}, {y}) {width} wide and {height} high"),
    };
    let eyes = match output.eyes {
        Eyes::Both => "",
        Eyes::Left => ", left eye",
        Eyes::Right => ", right eye",
    };
    format!("{}: monitor `{}`{part}{eyes}", one_line(&screen.name), one_line(&output.monitor))
}

/// Returns the row of a screen: name, width, height, distance from the head, and its angles in view.
fn row(rig: &Rig, screen: &Screen) -> [String; 6] {
    let (across, upwards) = screen.sides();
    let degrees = |low: f32, high: f32| format!("{:.1}", (high.atan() - low.atan()).to_degrees());
    let view = screen.view(rig.head, NEAR_M, FAR_M).map(|view| view.projection);
    [
        one_line(&screen.name).into_owned(),
        format!("{:.3}", across.length()),
        format!("{:.3}", upwards.length()),
        format!("{:.3}", (rig.head - screen.lower_left).dot(screen.towards_eye())),
        view.map_or("behind".to_owned(), |seen| degrees(seen.left, seen.right)),
        view.map_or("behind".to_owned(), |seen| degrees(seen.bottom, seen.top)),
    ]
}
