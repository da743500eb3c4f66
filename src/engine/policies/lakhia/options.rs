//! The constants of the thesis's table 6.1, and those that it uses without a value.

/// The constants of the thesis's table 6.1, and those that it uses without giving a value.
///
/// `c_desiredTris`, `c_levelFactor` and `c_textured` are the build's.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct LakhiaOptions {
    /// `c_vis`: what being in view adds to the benefit of a node, at least 0.
    pub vis: f64,
    /// `c_fore`: how much the angle at which a node is seen matters, 0 to 1.
    pub fore: f64,
    /// `c_hystSwitch`: how far a counter goes before it counts, above 0. Larger values switch
    /// later and keep to the target less closely.
    pub hyst_switch: f64,
    /// `c_hystLimit`: how far counters go at most, at least `hyst_switch`.
    pub hyst_limit: f64,
    /// Where counters begin; the thesis does not say.
    pub hyst_start: StartOfHysteresis,
    /// Seconds of the camera's present velocity by which its position is moved on before
    /// distances are taken ("slightly adjusted", thesis section 4.2); at least 0.
    pub lookahead_s: f64,
    /// Metres; what is nearer counts as this near. The static benefit is that at 1 m.
    pub least_distance: f64,
    /// Children are drawn only where all of them are in memory, not only those in view (thesis
    /// section 5.2, flickering from unavailability of culled nodes).
    pub all_siblings: bool,
    /// The part of the last frame's deviation by which `v_time` follows, 0 to 1; 0 turns the
    /// first feedback loop off.
    pub v_time_gain: f64,
    /// The part by which `shareTime` grows or shrinks in a frame, 0 to 1; 0 turns the second
    /// feedback loop off.
    pub share_gain: f64,
    /// The part of the target that a frame must miss it by before `shareTime` changes
    /// ("substantially", thesis section 4.2).
    pub share_slack: f64,
    /// How many times the time that the target leaves for nodes `shareTime` may be, at least 1.
    /// Near nodes do not use all of theirs, so that more than once can be given out; but what was
    /// given out is taken back slowly when more comes into view.
    pub share_limit: f64,
    /// How the second feedback loop is kept from swinging.
    pub share_feedback: ShareFeedback,
    /// What frames are expected to take before any was drawn.
    pub time: TimeModel,
}

impl LakhiaOptions {
    /// Table 6.1's; where it says nothing, what was found best.
    pub const DEFAULT: Self = Self {
        vis: 1.275,
        fore: 0.45,
        hyst_switch: 1500.0,
        hyst_limit: 4510.0,
        hyst_start: StartOfHysteresis::Affordable,
        lookahead_s: 0.5,
        least_distance: 1.0,
        all_siblings: false,
        v_time_gain: 0.1,
        share_gain: 0.01,
        share_slack: 0.05,
        share_limit: 10.0,
        share_feedback: ShareFeedback::Damped,
        time: TimeModel::DEFAULT,
    };
}

impl Default for LakhiaOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Where the hysteresis counters of siblings begin when they are visited for the first time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum StartOfHysteresis {
    /// At 0: whatever is in memory is drawn until its counters have fallen by `c_hystSwitch`,
    /// which takes at least as many frames.
    Zero,
    /// At 0 where the siblings' share of time suffices for all of them (the thesis's rule without
    /// hysteresis) and the frame has room for them; otherwise twice `c_hystSwitch` below, so that
    /// they must earn their place.
    Affordable,
}

/// When the second feedback loop changes `shareTime`.
///
/// Counters answer a change after hundreds of frames. A loop that goes on changing `shareTime`
/// all that time overshoots, and all nodes then switch together, up and down without end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum ShareFeedback {
    /// As the thesis words it: up while nodes in memory are refused and frames are substantially
    /// below the target, down while they are substantially above.
    Plain,
    /// Up only where what is refused would fit below the target, and not while counters are on
    /// their way that will use the time; down not while counters are on their way that will
    /// free it.
    Damped,
}

/// How drawing time follows from what is drawn.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TimeModel {
    /// Milliseconds of a frame in which nothing is drawn (the fixed overhead).
    pub fixed_ms: f64,
    /// Milliseconds for one unit of cost: `v_time` before any feedback.
    pub ms_per_cost: f64,
    /// What filling the whole picture takes beside the triangles' own time, in units of cost, at
    /// least 0. The thesis's card filled pixels at no cost; on others it is most of a frame.
    pub fill_cost: f64,
}

impl TimeModel {
    /// lavapipe on two cores: 0.7 ms for an empty frame of 1280 × 720, some 8 ms to fill it, and
    /// some 20 ms for 80,000 textured triangles (cost 0.6 each).
    pub const DEFAULT: Self = Self { fixed_ms: 0.7, ms_per_cost: 0.0004, fill_cost: 20_000.0 };
}

impl Default for TimeModel {
    fn default() -> Self {
        Self::DEFAULT
    }
}
