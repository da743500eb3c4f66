//! The loading thread (thesis, section 4.3).

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use super::{Arrival, NodeFiles, Reading};
use crate::runtime::residency::{NodeState, Residency, Step};
use crate::{Error, Result};

/// After so long without a word it looks again whether there is something to do.
const LONGEST_SLEEP: Duration = Duration::from_millis(100);

/// Reads the most important node that is not in memory, in small chunks, and looks after each
/// whether another has become more important; that one is then read first, and the other goes on
/// later where it was.
#[derive(Debug)]
pub struct LoadingThread {
    shared: Arc<Shared>,
    arrivals: Receiver<Result<Arrival>>,
    handle: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    residency: Arc<Mutex<Residency>>,
    wake: Condvar,
    stop: Mutex<bool>,
    /// Changed only while `residency` is locked, as is the next.
    paused: AtomicBool,
    /// A step is under way.
    busy: AtomicBool,
    /// Told when a step is over.
    idle: Condvar,
}

/// While this lives, the loading thread does nothing.
#[derive(Debug)]
pub struct PauseGuard<'a>(&'a Shared);

impl Drop for PauseGuard<'_> {
    fn drop(&mut self) {
        // A thread that died needs no one to tell it to go on.
        if let Ok(_residency) = self.0.residency.lock() {
            self.0.paused.store(false, Ordering::Relaxed);
        }
        self.0.wake.notify_one();
    }
}

impl LoadingThread {
    /// Starts to load what `residency` asks for.
    pub fn start(files: NodeFiles, residency: Arc<Mutex<Residency>>) -> Result<Self> {
        Self::start_with(files, residency, NodeFiles::finish)
    }

    /// The same with another way to decode.
    fn start_with(
        files: NodeFiles,
        residency: Arc<Mutex<Residency>>,
        decode: Decode,
    ) -> Result<Self> {
        let (sender, arrivals) = channel();
        let shared = Arc::new(Shared {
            residency,
            wake: Condvar::new(),
            stop: Mutex::new(false),
            paused: AtomicBool::new(false),
            busy: AtomicBool::new(false),
            idle: Condvar::new(),
        });
        let of_thread = Arc::clone(&shared);
        let handle = std::thread::Builder::new()
            .name("loading".into())
            .spawn(move || Loader { shared: of_thread, files, sender, decode }.run())
            .map_err(|error| {
                Error::Internal(format!("cannot start the loading thread: {error}"))
            })?;
        Ok(Self { shared, arrivals, handle: Some(handle) })
    }

    /// Says that there may be something new to do.
    pub fn wake(&self) {
        self.shared.wake.notify_one();
    }

    /// Has the thread stand still, once it is done with the chunk that it is reading or the node
    /// that it is decoding.
    pub fn pause(&self) -> Result<PauseGuard<'_>> {
        let died = || Error::Internal("the loading thread died".into());
        let mut residency = self.shared.residency.lock().map_err(|_| died())?;
        self.shared.paused.store(true, Ordering::Relaxed);
        let guard = PauseGuard(&self.shared);
        while self.shared.busy.load(Ordering::Relaxed) && self.check().is_ok() {
            let waited = self.shared.idle.wait_timeout(residency, LONGEST_SLEEP);
            residency = waited.map_err(|_| died())?.0;
        }
        drop(residency);
        Ok(guard)
    }

    /// What arrived since the last call; errors name files that cannot be used. A node comes here
    /// before [`Residency::begin_frame`] says that it arrived.
    pub fn arrivals(&self) -> impl Iterator<Item = Result<Arrival>> + '_ {
        self.arrivals.try_iter()
    }

    /// Fails where the thread has ended, so that nothing will be loaded any more.
    pub fn check(&self) -> Result<()> {
        match &self.handle {
            Some(handle) if !handle.is_finished() => Ok(()),
            _ => Err(Error::Internal("the loading thread died".into())),
        }
    }
}

impl Drop for LoadingThread {
    fn drop(&mut self) {
        if let Ok(mut stop) = self.shared.stop.lock() {
            *stop = true;
        }
        self.wake();
        if let Some(handle) = self.handle.take() {
            // `check` has told of a thread that died.
            let _ = handle.join();
        }
    }
}

struct Loader {
    shared: Arc<Shared>,
    files: NodeFiles,
    sender: Sender<Result<Arrival>>,
    decode: Decode,
}

/// Makes a node of what was read of its files.
type Decode = fn(&NodeFiles, Reading) -> Result<Arrival>;

impl Loader {
    fn run(&self) {
        super::background::give_way();
        let mut readings = BTreeMap::new();
        while let Some((step, reading)) = self.next(&mut readings) {
            let go_on = self.carry_out(step, reading, &mut readings);
            let Some(residency) = self.lock() else { return };
            self.shared.busy.store(false, Ordering::Relaxed);
            drop(residency);
            self.shared.idle.notify_one();
            if !go_on {
                return;
            }
        }
    }

    fn stopped(&self) -> bool {
        self.shared.stop.lock().map_or(true, |stop| *stop)
    }

    fn lock(&self) -> Option<MutexGuard<'_, Residency>> {
        self.shared.residency.lock().ok()
    }

    /// Waits for something to read; `None` at the end.
    fn next(&self, readings: &mut BTreeMap<u32, Reading>) -> Option<(Step, Reading)> {
        let mut residency = self.lock()?;
        loop {
            if self.stopped() {
                return None;
            }
            let paused = self.shared.paused.load(Ordering::Relaxed);
            let step = if paused { None } else { residency.next_step() };
            // Loads that were given up.
            readings.retain(|&node, _| matches!(residency.state(node), NodeState::Loading { .. }));
            if let Some(step) = step {
                let suspended = readings.remove(&step.node);
                let reading = suspended.filter(|reading| reading.done() == step.from);
                let reading = reading.unwrap_or_else(|| {
                    self.files.begin(step.node, |texture| residency.has_texture(texture))
                });
                self.shared.busy.store(true, Ordering::Relaxed);
                return Some((step, reading));
            }
            residency = self.shared.wake.wait_timeout(residency, LONGEST_SLEEP).ok()?.0;
        }
    }

    /// Reads a chunk and decodes the node where it was the last; false at the end.
    fn carry_out(
        &self,
        step: Step,
        mut reading: Reading,
        readings: &mut BTreeMap<u32, Reading>,
    ) -> bool {
        let read = reading.read(step.bytes);
        let whole = {
            let Some(mut residency) = self.lock() else { return false };
            if let Err(error) = read {
                residency.broken(step.node);
                drop(residency);
                return self.sender.send(Err(error)).is_ok();
            }
            residency.chunk_read(step.node, step.bytes)
        };
        if !whole {
            readings.insert(step.node, reading);
            return true;
        }
        let arrival = (self.decode)(&self.files, reading);
        let usable = arrival.is_ok();
        let Some(mut residency) = self.lock() else { return false };
        // Given up while it was decoded: nobody waits for it.
        if !matches!(residency.state(step.node), NodeState::Loading { .. }) {
            return true;
        }
        // It is there before anybody is told that it is.
        let sent = self.sender.send(arrival).is_ok();
        if usable {
            residency.loaded(step.node);
        } else {
            residency.broken(step.node);
        }
        sent
    }
}

#[cfg(test)]
mod tests;
