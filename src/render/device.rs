//! The graphics device: opened, waited for, and asked what went wrong.

use std::sync::{Arc, Mutex, PoisonError};

use wgpu::{Adapter, DeviceDescriptor, Features, MemoryHints, PollType, Queue, SubmissionIndex};

use super::adapter::{self, AdapterLabel};
use super::content::{LONGEST_COMPRESSED, TextureFormat};
use super::timestamps;
use crate::{Error, Result};

/// A graphics device and what it was last heard to complain of.
pub(super) struct Device {
    pub device: wgpu::Device,
    pub queue: Queue,
    pub label: AdapterLabel,
    /// The first complaint that nobody was told of yet.
    complaint: Arc<Mutex<Option<String>>>,
}

impl Device {
    /// Opens the adapter that `wanted` names, or the best that can be opened.
    pub fn open(wanted: Option<&str>) -> Result<Self> {
        let mut refusals = String::new();
        for adapter in adapter::choose(wanted)? {
            match Self::try_open(&adapter) {
                Ok(device) => return Ok(device),
                Err(error) => refusals += &format!("\n  {}: {error}", adapter::label(&adapter)),
            }
        }
        Err(Error::NoAdapter(format!("no graphics adapter can be used:{refusals}")))
    }

    fn try_open(adapter: &Adapter) -> Result<Self, wgpu::RequestDeviceError> {
        let (device, queue) = pollster::block_on(adapter.request_device(&DeviceDescriptor {
            label: Some("hlod"),
            required_features: adapter.features()
                & (timestamps::FEATURES | Features::TEXTURE_COMPRESSION_BC),
            required_limits: adapter.limits(),
            // Nodes come and go all the time; large blocks set aside for them would be memory
            // that no ledger knows of.
            memory_hints: MemoryHints::MemoryUsage,
            ..Default::default()
        }))?;
        let complaint = Arc::new(Mutex::new(None));
        let heard = Arc::clone(&complaint);
        let complain = move |what: String| {
            heard.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
        };
        let lost = complain.clone();
        // Otherwise wgpu would end the process.
        device.on_uncaptured_error(Arc::new(move |error| complain(error.to_string())));
        device.set_device_lost_callback(move |reason, what| {
            lost(format!("the graphics device was lost ({reason:?}): {what}"));
        });
        let label = adapter::label(adapter);
        Ok(Self { device, queue, label, complaint })
    }

    /// Whether it samples pictures of a format.
    pub fn samples(&self, format: TextureFormat) -> bool {
        match format {
            TextureFormat::Rgba8 => true,
            TextureFormat::Bc7 => {
                self.device.features().contains(Features::TEXTURE_COMPRESSION_BC)
                    && self.device.limits().max_texture_dimension_2d >= LONGEST_COMPRESSED
            }
        }
    }

    /// Waits until what was submitted is done.
    pub fn wait(&self, submission: SubmissionIndex) -> Result<()> {
        let wait = PollType::Wait { submission_index: Some(submission), timeout: None };
        let waited = self.device.poll(wait);
        self.check()?;
        waited.map(|_| ()).map_err(|error| Error::Graphics(error.to_string()))
    }

    /// Fails where something went wrong since it was last asked.
    pub fn check(&self) -> Result<()> {
        match self.complaint.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(what) => Err(Error::Graphics(format!("{}: {what}", self.label))),
            None => Ok(()),
        }
    }
}
