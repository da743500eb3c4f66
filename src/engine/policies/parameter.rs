//! Constants of policies that can be set by name.

use std::collections::BTreeMap;

use crate::{Error, Result};

/// A constant of a policy whose options are `O`.
pub(super) struct Parameter<O> {
    /// As it is set: lower case, words divided by underscores.
    pub name: &'static str,
    /// What it does, with its unit; one line.
    pub help: &'static str,
    /// The least and the greatest value.
    pub range: [f64; 2],
    pub get: fn(&O) -> f64,
    pub set: fn(&mut O, f64),
}

/// What can be said of a constant without its policy.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterInfo {
    /// As it is set.
    pub name: &'static str,
    /// What it does, with its unit.
    pub help: &'static str,
    /// The least and the greatest value.
    pub range: [f64; 2],
    /// Its value unless it is set.
    pub default: f64,
}

/// Values of constants, by name.
pub type Settings = BTreeMap<String, f64>;

/// `options` with some constants set; refuses names that the policy has not and values out of
/// range.
pub(super) fn with_settings<O>(
    policy: &str,
    mut options: O,
    parameters: &[Parameter<O>],
    settings: &Settings,
) -> Result<O> {
    for (name, &value) in settings {
        let Some(parameter) = parameters.iter().find(|parameter| parameter.name == name) else {
            let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name).collect();
            return Err(Error::Usage(format!(
                "--set {name}: policy {policy} has no such constant; it has {}",
                if names.is_empty() { "none".into() } else { names.join(", ") }
            )));
        };
        let [least, most] = parameter.range;
        if !(least..=most).contains(&value) {
            return Err(Error::Usage(format!(
                "--set {name}: expected {least} to {most}, found {value}"
            )));
        }
        (parameter.set)(&mut options, value);
    }
    Ok(options)
}

/// The constants of a policy, for people.
pub(super) fn info<O>(options: &O, parameters: &[Parameter<O>]) -> Vec<ParameterInfo> {
    let of = |&Parameter { name, help, range, get, .. }: &Parameter<O>| ParameterInfo {
        name,
        help,
        range,
        default: get(options),
    };
    parameters.iter().map(of).collect()
}

/// A parameter that is a field of the options.
macro_rules! parameter {
    ($field:ident, $least:expr, $most:expr, $help:expr) => {
        $crate::engine::policies::parameter::Parameter {
            name: stringify!($field),
            help: $help,
            range: [$least, $most],
            get: |options| options.$field,
            set: |options, value| options.$field = value,
        }
    };
}
pub(super) use parameter;
