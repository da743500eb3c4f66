//! The constants of the thesis's table 6.1, and those that it uses without a value.

use crate::engine::policies::parameter::{Parameter, parameter};

/// Seconds of a frame of the thesis (`c_targetTime`). Its rates are by frames; here they are by as
/// many seconds, so that a faster machine is not more hasty.
pub(super) const FRAME_S: f64 = 0.030;

/// The constants of the thesis's table 6.1, and those that it uses without giving a value.
///
/// `c_desiredTris` and `c_levelFactor` are the build's, and `c_textured` is measured on the machine
/// that draws, as it was for the thesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LakhiaOptions {
    /// `c_vis`.
    pub vis: f64,
    /// `c_fore`.
    pub fore: f64,
    /// `c_hystSwitch`.
    pub hyst_switch: f64,
    /// `c_hystLimit`; no less than `hyst_switch` counts.
    pub hyst_limit: f64,
    /// Seconds of the camera's present velocity by which its position is moved on before
    /// distances are taken ("slightly adjusted", thesis section 4.2).
    pub lookahead_s: f64,
    /// Not 0: children are drawn only where all of them are in memory, not only those in view
    /// (thesis section 5.2, flickering from unavailability of culled nodes).
    pub all_siblings: f64,
    /// The part of the last frame's deviation by which `v_time` follows.
    pub v_time_gain: f64,
    /// The part by which `shareTime` grows or shrinks in 30 ms.
    pub share_gain: f64,
    /// The part of the target that a frame must miss it by before `shareTime` changes
    /// ("substantially", thesis section 4.2).
    pub share_slack: f64,
}

impl LakhiaOptions {
    /// Table 6.1's; those without a value there are ours: the last five.
    pub const DEFAULT: Self = Self {
        vis: 1.275,
        fore: 0.45,
        hyst_switch: 1500.0,
        hyst_limit: 4510.0,
        lookahead_s: 0.5,
        all_siblings: 0.0,
        v_time_gain: 0.1,
        share_gain: 0.01,
        share_slack: 0.05,
    };
}

impl Default for LakhiaOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

pub(super) const PARAMETERS: [Parameter<LakhiaOptions>; 9] = [
    parameter!(vis, 0.0, 1e6, "c_vis: weight of visibility in a node's benefit"),
    parameter!(fore, 0.0, 1.0, "c_fore: weight of foreshortening in a node's benefit"),
    parameter!(hyst_switch, 1e-6, 1e9, "c_hystSwitch: value at which a counter takes effect"),
    parameter!(hyst_limit, 1e-6, 1e9, "c_hystLimit: largest magnitude of a counter"),
    parameter!(lookahead_s, 0.0, 60.0, "seconds by which the camera is moved on"),
    parameter!(all_siblings, 0.0, 1.0, "1: draw children only where all are in memory"),
    parameter!(v_time_gain, 0.0, 1.0, "gain of the feedback on v_time in 30 ms; 0 turns it off"),
    parameter!(share_gain, 0.0, 0.99, "gain of the feedback on shareTime in 30 ms; 0 turns it off"),
    parameter!(share_slack, 0.0, 1.0, "part of the target by which frames miss it substantially"),
];
