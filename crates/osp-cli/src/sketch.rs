//! `osp sketch`: opens the window to draw in.

use std::path::PathBuf;

use anyhow::{bail, ensure};

#[cfg(feature = "live")]
use super::shared;
use super::{
    film,
    output::{Outcome, warn},
    session::rescue_of,
    sketch_args::SketchArgs,
    tracker,
};
use osp::occlusion::Occlusion;
use osp_app::{
    Access, Autosaves, Command, Opened, Opening, Question, Session, Settings, Studio, WindowOptions,
    run as run_window, tracker::TrackerAddress,
};
#[cfg(feature = "live")]
use osp_app::{Live, Unjoined};
use osp_rivals::IndexKind;
use osp_session::output_file::{check_new_output, files_read_with};

#[cfg(feature = "live")]
impl SketchArgs {
    /// Starts to take part in a shared session.
    fn join(&self, address: &str, autosaves: &Autosaves) -> anyhow::Result<(Session, Opened)> {
        let role = shared::role(self.read_only, &self.name);
        let address = self.server.address(address)?;
        let join = || Live::join(&address, &role, autosaves);
        let Some(path) = &self.file else {
            return Ok((Session::joining(join()?, autosaves)?, Opened::default()));
        };
        let (unjoined, opened) = Unjoined::open(path, &address.session, autosaves, self.limits.limits())?;
        Ok((unjoined.join(join()?), opened))
    }
}

impl SketchArgs {
    /// Returns an error if the trace would replace a file.
    fn check_trace(&self) -> anyhow::Result<()> {
        let Some(trace) = &self.trace else { return Ok(()) };
        let tracker = self.tracker.as_ref().and_then(|tracker| match tracker {
            TrackerAddress::File(path) => Some(path.clone()),
            _ => None,
        });
        let session = self.file.iter().flat_map(|path| files_read_with(path));
        let inputs: Vec<PathBuf> = session.chain(self.rig.file()).chain(tracker).collect();
        check_new_output(trace, &[], false, &inputs, &[])?;
        Ok(())
    }
}

pub(super) fn run(args: &SketchArgs) -> anyhow::Result<Outcome> {
    args.check_trace()?;
    ensure!(
        !args.read_only || args.file.is_some() || args.join.is_some(),
        "--read-only: expected a session, or --join ADDRESS"
    );
    let tracker_options = tracker::options(args.tracker.as_ref())?;
    #[cfg(feature = "live")]
    ensure!(
        args.join.is_some() || !args.server.is_given(),
        "--credentials, --unencrypted: expected --join ADDRESS"
    );
    let room = args.rig.room()?;
    let autosaves = Autosaves::new(args.autosave.clone());
    #[cfg(feature = "live")]
    let joined = match &args.join {
        Some(address) => Some(args.join(address, &autosaves)?),
        None => None,
    };
    #[cfg(not(feature = "live"))]
    let joined: Option<(Session, Opened)> = None;
    let file = args.file.as_ref().filter(|_| joined.is_none());
    let (session, opened) = match (joined, file) {
        (Some(joined), _) => joined,
        (None, Some(_)) => (Session::new(&autosaves), Opened::default()),
        (None, None) => Session::recover_or_new(&autosaves, args.limits.limits()),
    };
    let mut studio = Studio::new(session, autosaves, IndexKind::Osp);
    studio.set_room(room);
    studio.set_film_maker(film::maker());
    studio.set_limits(args.limits.limits());
    studio.command(Command::Occlusion(Occlusion::Auto.into()));
    opened.remarks.into_iter().for_each(|remark| studio.show_message(remark));
    if let Some(path) = file {
        let how = Opening {
            access: if args.read_only { Access::ReadOnly } else { Access::Write },
            lenient: args.lenient,
            ..Opening::default()
        };
        studio.work_in_background();
        studio.command(Command::OpenAs(path.clone(), how));
        studio.wait_for_small(path);
        let refused = match (studio.take_file_outcome(), studio.question()) {
            (Some(Err(why)), _) => Some(why),
            (_, Some(Question::Damaged { path, damage })) => {
                Some(format!("{damage}{}", rescue_of(path).unwrap_or_default()))
            }
            _ => None,
        };
        if let Some(why) = refused {
            studio.close()?;
            bail!(why);
        }
    }
    studio.messages().iter().for_each(|said| warn(said));
    let options = WindowOptions {
        size: args.window,
        tracker: args.tracker.clone(),
        tracker_options,
        trace: args.trace.clone(),
        settings: Some(Settings::default_path()),
    };
    run_window(studio, options)?;
    Ok(Outcome::Done)
}
