/// The result of a command that ran; an error stands for bad input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    CheckFailed,
}
