//! The graphics device: opened, waited for, and asked what went wrong.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

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
    /// How it was lost; nothing can be done with it from then on.
    loss: Arc<OnceLock<String>>,
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
        // Otherwise wgpu would end the process.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            heard.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error.to_string());
        }));
        let loss = Arc::new(OnceLock::new());
        let lost = Arc::clone(&loss);
        device.set_device_lost_callback(move |reason, what| {
            lost.get_or_init(|| format!("the graphics device was lost ({reason:?}): {what}"));
        });
        let label = adapter::label(adapter);
        Ok(Self { device, queue, label, complaint, loss })
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
        if waited.is_err() {
            // What is submitted to a device that is lost is left out without a word; of the loss it tells when
            // it is polled.
            drop(self.device.poll(PollType::Poll));
        }
        self.check()?;
        waited.map(|_| ()).map_err(|error| Error::Graphics(format!("{}: {error}", self.label)))
    }

    /// Fails where something went wrong since it was last asked, and always once it is known to be lost.
    pub fn check(&self) -> Result<()> {
        let complaint = self.complaint.lock().unwrap_or_else(PoisonError::into_inner).take();
        match self.loss.get().cloned().or(complaint) {
            Some(what) => Err(Error::Graphics(format!("{}: {what}", self.label))),
            None => Ok(()),
        }
    }
}
