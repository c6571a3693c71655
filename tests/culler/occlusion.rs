//! Occlusion culling: what is called hidden is hidden.
//!
//! | obligation | test |
//! | --- | --- |
//! | where the paper's rules fail, the sound tree does not | `counterexamples::rule_2_…`, `rule_5_…`, `rule_6_…`, `the_eight_corners_…` |
//! | every "hidden" of random, adversarial scenes is recomputed | `stress::random_stress_…`, `pool::random_stress_of_patches_…` |
//! | no culled polygon owns a pixel, or a point between pixels | `truth::no_sound_method_…`, `command::no_sound_method_…` |
//! | hidden by ball, so by box, so by outline | `stress::hidden_by_sphere_implies_…` |
//! | one occluder hides as much in the tree as alone | `stress::one_occluder_…` |
//! | the order of occluders changes effect only | `stress::random_stress_…` |
//! | the paper's own form is caught | `stress::the_judge_catches_the_paper`, `truth::the_oracle_catches_the_paper` |
//! | no input of occluders hides what is visible or panics | `occluders::no_occluder_input_…` |
//! | no allocation, bounded trees | `allocations::…`, `pool::following_…` |
//! | `auto` never changes what can be seen | `pipeline::…` |
//! | every guard and margin matters | `guards::…`, `near_limits::…`, `window_margin::…` |
//! | the paper's node tests and score hide nothing visible, or say that they do | `literal::…`, `options::…` |
//! | what is edited hides only where it is now | `edits::…` |
//! | sixteen boxes at once get the answers of one at a time | `wide::…` |
//! | what is known of the frames before saves work | `coherence::…` |
//! | what connected surfaces hide is blocked, each margin matters | `connected::…`, `surfaces::…` |
//! | `osp verify` measures what a frame does | `as_frames_do::…` |

mod allocations;
mod as_frames_do;
mod coherence;
pub(crate) mod connected;
mod counterexamples;
mod culling;
mod edits;
mod guards;
mod judge;
mod literal;
mod near_limits;
mod occluders;
mod pipeline;
mod pool;
mod previous_frame;
mod random;
mod session;
mod stress;
mod surfaces;
mod truth;
mod wide;
mod window_margin;
