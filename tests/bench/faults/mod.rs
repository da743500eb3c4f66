//! What may go wrong in a run. A second later all is as if it had not.

mod cap;
mod clock;
mod cuts;
mod places;
mod rig;
mod stalls;
mod steady;
