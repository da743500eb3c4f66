//! What a person may set about a comparison.

use super::limit::Limit;
use super::metrics;

/// Which figures may be how large, or rise how much.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
pub struct Limits {
    /// The most that a metric may be, or how much more than in the base: toggles=+5%, flip=0.03
    #[arg(long, value_name = "METRIC=VALUE", long_help = metrics::help())]
    pub max: Vec<Limit>,
}

impl Limits {
    /// Those of a metric.
    pub(super) fn of(&self, metric: &str) -> impl Iterator<Item = &Limit> {
        self.max.iter().filter(move |limit| limit.metric == metric)
    }
}
