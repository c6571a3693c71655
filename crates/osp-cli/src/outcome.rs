/// How a command ended, other than by bad input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    CheckFailed,
}
