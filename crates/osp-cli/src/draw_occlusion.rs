//! `osp draw-occlusion`: pictures of a view's occluders, their shadows, and the tree of their planes.

use anyhow::{Context, anyhow, ensure};

use super::{
    draw_args::{DrawOcclusionArgs, Form, SideArg},
    gif_file::GifFile,
    output::{Outcome, file_name, one_line, print_result, warn},
    outputs::{Output, ending},
    played::Played,
    progress,
};
use osp::{occlusion::SelectConfig, view::View};
use osp_lab::{
    oracle::OracleConfig,
    report::{ChartFormat, ShadowLook, ShadowPicture, Side, thousands},
    shadows::{ShadowForm, ShadowSteps, occluder_name},
};
use osp_session::replay::{CameraChoice, CameraPath, Moment};

/// Duration of a film without its last picture, hundredths of a second.
const GROWING: u16 = 1500;
/// Duration of a film's last picture, hundredths of a second.
const END: u16 = 300;
/// Longest duration of any other picture, hundredths of a second.
const LONGEST: u16 = 80;
/// Resolution of the oracle that determines the visible polygons. It finds smaller polygons by rays.
const TRUTH: OracleConfig = OracleConfig { width: 1280, height: 720 };

pub(super) fn run(args: &DrawOcclusionArgs) -> anyhow::Result<Outcome> {
    let ending = ending(&args.out);
    let ending = ending.as_str();
    let forms: &[ShadowForm] = match args.form {
        Form::Conservative => &[ShadowForm::Conservative],
        Form::Paper => &[ShadowForm::Paper],
        Form::Both => &[ShadowForm::Conservative, ShadowForm::Paper],
    };
    ensure!(
        ending != "dot" || forms.len() == 1,
        "{}: a .dot holds one tree: expected --form conservative or paper",
        args.out.display()
    );
    ensure!(args.every.is_none() || ending == "gif", "--every: expected a name that ends in .gif");
    let output =
        args.force.outputs().reads([&args.session.file]).add(&args.out, &[".svg", ".png", ".gif", ".dot"])?;
    let Played { header, summary, scene, moment, .. } = Played::model(&args.session, |_, _| {})?;
    let view = match args.view {
        // The default moment has no head pose, so the fixed camera determines the view.
        Some(_) => CameraPath::new(CameraChoice::Auto, args.view, &summary.bounds).view(&Moment::default()),
        None => CameraPath::new(args.camera, header.camera, &summary.bounds).view(&moment),
    };
    let select = SelectConfig { occluders: args.occluders, score: args.score, ..SelectConfig::default() };
    let title = format!("{}, frame {}", file_name(&args.session.file), moment.frame);
    let look = ShadowLook::new(&scene, &view, select, TRUTH)
        .ok_or_else(|| anyhow!("{title}: expected a camera with a valid frustum"))?;
    let trees: Vec<ShadowSteps> = forms.iter().map(|&form| look.view.steps(form)).collect();
    let side = side_of(args.from, &view);
    let picture = |planes| ShadowPicture {
        title: title.clone(),
        look: &look,
        panels: trees.iter().map(|steps| look.panel(steps, planes)).collect(),
        side,
    };
    let whole = picture(usize::MAX);
    match ending {
        "gif" => film(&output, most_planes(&trees), args.every.unwrap_or(1) as usize, &picture)?,
        "dot" => {
            let panel = &whole.panels[0];
            let name = format!("{title}, {}", panel.step.form.name());
            output.write(panel.step.structure.to_dot(&name).as_bytes())?;
        }
        _ => output.write_by(|file| file.write_all(&whole.encode(ChartFormat::of(output.path()))?))?,
    }
    if look.view.occluders.is_empty() {
        warn("warning: no polygon of this view is an occluder");
    }
    for (i, occluder) in look.view.occluders.iter().enumerate() {
        let (share, corners) = (100.0 * look.view.share(occluder), occluder.corners().len());
        let (name, away_m) = (occluder_name(i), occluder.cap_distance_m());
        print_result(&format!(
            "occluder {name}: {share:.2} % of the window, {corners} corners, {away_m:.2} m away"
        ))?;
    }
    for panel in &whole.panels {
        let counts = look.counts(panel);
        print_result(&format!(
            "{}, {}: {} planes, {} levels, hides {} of {} hidden polygons and {} visible ones -> {}",
            one_line(&title),
            panel.step.form.name(),
            thousands(panel.step.planes_in_all as u64),
            panel.step.structure.levels(),
            thousands(counts.hidden_culled as u64),
            thousands(look.hidden() as u64),
            thousands(counts.visible_culled as u64),
            one_line(&args.out.to_string_lossy())
        ))?;
    }
    Ok(Outcome::Done)
}

fn most_planes(trees: &[ShadowSteps]) -> usize {
    trees.iter().map(ShadowSteps::planes).max().unwrap_or(0)
}

/// Selects the side from which the picture shows the shadows. Avoids the eye's own direction, in which the occluders
/// cover their shadows.
fn side_of(given: Option<SideArg>, view: &View) -> Side {
    match given {
        Some(from) => from.side(),
        None => {
            let along = view.forward_in_world().abs();
            if along.y <= along.x.max(along.z) {
                Side::Top
            } else if along.z <= along.x {
                Side::Front
            } else {
                Side::Right
            }
        }
    }
}

/// Writes a film of a growing tree. Each picture adds `every` planes.
fn film<'a>(
    output: &Output,
    planes: usize,
    every: usize,
    picture: &dyn Fn(usize) -> ShadowPicture<'a>,
) -> anyhow::Result<()> {
    let name = || output.path().display().to_string();
    let steps = planes.div_ceil(every);
    let delay = (GROWING / u16::try_from(steps.max(1)).unwrap_or(u16::MAX)).clamp(4, LONGEST);
    let mut file = GifFile::begin(output.create()?, picture(0).size()).with_context(name)?.of_drawings();
    let progress = progress::bar(steps as u64, "pictures", &name());
    for step in 0..=steps {
        let rgb =
            picture((step * every).min(planes)).rgb().map_err(|error| anyhow!("{}: {error}", name()))?;
        file.add(&rgb, if step == steps { END } else { delay }).with_context(name)?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    output.commit(file.finish().with_context(name)?)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use osp::view::Projection;

    #[test]
    fn shadows_are_seen_from_a_side_that_the_eye_does_not_look_along() {
        let side = |to: Vec3| {
            side_of(None, &View::look_at(Vec3::ZERO, to, Projection::symmetric(60.0, 1.0, 0.1, 9.0)))
        };
        assert_eq!(side(Vec3::new(1.0, -0.5, 2.0)), Side::Top);
        assert_eq!(side(Vec3::new(0.6, -2.0, 0.5)), Side::Front);
        assert_eq!(side(Vec3::new(0.1, 2.0, 0.5)), Side::Right);
        let down = View::look_at(Vec3::ZERO, Vec3::NEG_Y, Projection::symmetric(60.0, 1.0, 0.1, 9.0));
        assert_eq!(side_of(Some(SideArg::Top), &down), Side::Top);
    }
}
