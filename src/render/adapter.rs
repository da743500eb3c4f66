//! Finding a graphics adapter.

use std::fmt;

use wgpu::{Adapter, Backends, DeviceType, Instance, InstanceDescriptor, InstanceFlags};

use crate::{Error, Result};

/// What is said when there is none.
const INSTALL: &str = "install a driver for the graphics card, or one that draws on the processor \
     (Debian and Ubuntu: sudo apt-get install mesa-vulkan-drivers)";

/// A graphics adapter, for people.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct AdapterLabel {
    /// As its driver calls it.
    pub name: String,
    /// The interface: `vulkan`, `metal`, `dx12`, `gl`.
    pub backend: &'static str,
    /// The driver and its version.
    pub driver: String,
    /// It is the processor that draws.
    pub is_processor: bool,
}

impl fmt::Display for AdapterLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}", self.name, self.backend)?;
        if !self.driver.is_empty() {
            write!(f, ", {}", self.driver)?;
        }
        f.write_str(")")
    }
}

/// All adapters, best first: their numbers are what [`RenderOptions::adapter`] takes.
///
/// [`RenderOptions::adapter`]: super::RenderOptions::adapter
pub fn adapters() -> Vec<AdapterLabel> {
    find().iter().map(label).collect()
}

/// All adapters, best first.
fn find() -> Vec<Adapter> {
    let list = |backends| {
        let instance = Instance::new(InstanceDescriptor {
            backends,
            flags: InstanceFlags::empty(),
            ..InstanceDescriptor::new_without_display_handle()
        });
        pollster::block_on(instance.enumerate_adapters(backends))
    };
    let mut adapters = list(Backends::PRIMARY);
    if adapters.is_empty() {
        // OpenGL shows the same cards again, and its libraries write to the console where there
        // is no display.
        adapters = list(Backends::GL);
    }
    adapters.sort_by_key(rank);
    adapters
}

/// Lower is better.
fn rank(adapter: &Adapter) -> u8 {
    match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

/// How an adapter is called in messages.
pub(super) fn label(adapter: &Adapter) -> AdapterLabel {
    let info = adapter.get_info();
    AdapterLabel {
        backend: info.backend.to_str(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        is_processor: info.device_type == DeviceType::Cpu,
        name: info.name,
    }
}

/// The adapters to try, best first: all, or the one that `wanted` names.
pub(super) fn choose(wanted: Option<&str>) -> Result<Vec<Adapter>> {
    let mut adapters = find();
    if adapters.is_empty() {
        return Err(Error::NoAdapter(format!("no graphics adapter was found; {INSTALL}")));
    }
    let Some(wanted) = wanted else { return Ok(adapters) };
    let labels: Vec<AdapterLabel> = adapters.iter().map(label).collect();
    let index =
        position(&labels, wanted).ok_or_else(|| Error::NoAdapter(none_of(&labels, wanted)))?;
    Ok(vec![adapters.swap_remove(index)])
}

/// Which adapter is meant by its number, or by part of its name in any case.
fn position(labels: &[AdapterLabel], wanted: &str) -> Option<usize> {
    let wanted = wanted.trim().to_lowercase();
    let by_number = wanted.parse().ok().filter(|number| *number < labels.len());
    by_number.or_else(|| {
        labels.iter().position(|label| label.to_string().to_lowercase().contains(&wanted))
    })
}

fn none_of(labels: &[AdapterLabel], wanted: &str) -> String {
    let mut message = format!("no graphics adapter is called \"{wanted}\"; there are");
    for (number, label) in labels.iter().enumerate() {
        message += &format!("\n  {number}: {label}");
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels() -> Vec<AdapterLabel> {
        let label = |name: &str, backend, is_processor| AdapterLabel {
            name: name.into(),
            backend,
            driver: "Mesa 22.3.6".into(),
            is_processor,
        };
        vec![label("NVIDIA H200", "vulkan", false), label("llvmpipe (LLVM 15)", "vulkan", true)]
    }

    #[test]
    fn adapters_are_found_by_number_and_by_part_of_their_name() {
        let labels = labels();
        for (wanted, index) in [("1", 1), ("0", 0), ("LLVM", 1), ("nvidia", 0), (" h200 ", 0)] {
            assert_eq!(position(&labels, wanted), Some(index), "{wanted}");
        }
        // A number beyond the list may still be part of a name.
        assert_eq!(position(&labels, "15"), Some(1));
        assert_eq!(position(&labels, "99"), None);
        let message = none_of(&labels, "radeon");
        assert!(message.contains("radeon") && message.contains("1: llvmpipe"), "{message}");
    }
}
