//! The loading thread (thesis, section 4.3), or several.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use super::{Arrival, NodeFiles, Reading};
use crate::runtime::residency::{NodeState, Residency, Step};
use crate::{Error, Result};

/// After so long without a word it looks again whether there is something to do.
const LONGEST_SLEEP: Duration = Duration::from_millis(100);

/// More would be limited by what reads the files, and by uploads.
const MOST_THREADS: usize = 4;

/// Read the most important nodes that are not in memory, each one at a time, in small chunks, and look
/// after each chunk whether another has become more important; that one is then read first, and the other
/// goes on later where it was.
#[derive(Debug)]
pub struct LoadingThreads {
    shared: Arc<Shared>,
    arrivals: Receiver<Result<Arrival>>,
    handles: Vec<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    residency: Arc<Mutex<Residency>>,
    wake: Condvar,
    stop: Mutex<bool>,
    /// Half read.
    suspended: Mutex<BTreeMap<u32, Reading>>,
    /// Changed only while `residency` is locked, as is the next.
    paused: AtomicBool,
    /// How many steps are under way.
    busy: AtomicUsize,
    /// Told when a step is over.
    idle: Condvar,
}

/// While this lives, the loading threads do nothing.
#[derive(Debug)]
pub struct PauseGuard<'a>(&'a Shared);

impl Drop for PauseGuard<'_> {
    fn drop(&mut self) {
        // A thread that died needs no one to tell it to go on.
        if let Ok(_residency) = self.0.residency.lock() {
            self.0.paused.store(false, Ordering::Relaxed);
        }
        self.0.wake.notify_all();
    }
}

impl LoadingThreads {
    /// Half as many as there are cores, since they must leave time for drawing, and four at most.
    pub fn default_count() -> NonZero<usize> {
        let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
        NonZero::new((cores / 2).min(MOST_THREADS)).unwrap_or(NonZero::<usize>::MIN)
    }

    /// Starts to load what `residency` asks for, on so many threads.
    pub fn start(
        files: &NodeFiles,
        residency: &Arc<Mutex<Residency>>,
        threads: NonZero<usize>,
    ) -> Result<Self> {
        Self::start_with(files, residency, threads, NodeFiles::finish)
    }

    /// The same with another way to decode.
    fn start_with(
        files: &NodeFiles,
        residency: &Arc<Mutex<Residency>>,
        threads: NonZero<usize>,
        decode: Decode,
    ) -> Result<Self> {
        let (sender, arrivals) = channel();
        let shared = Arc::new(Shared {
            residency: Arc::clone(residency),
            wake: Condvar::new(),
            stop: Mutex::new(false),
            suspended: Mutex::default(),
            paused: AtomicBool::new(false),
            busy: AtomicUsize::new(0),
            idle: Condvar::new(),
        });
        let mut started = Self { shared, arrivals, handles: Vec::new() };
        for _ in 0..threads.get() {
            let loader = Loader {
                shared: Arc::clone(&started.shared),
                files: files.clone(),
                sender: sender.clone(),
                decode,
            };
            let thread = std::thread::Builder::new().name("loading".into());
            let handle = thread.spawn(move || loader.run()).map_err(|error| {
                Error::Internal(format!("cannot start a loading thread: {error}"))
            })?;
            started.handles.push(handle);
        }
        Ok(started)
    }

    /// Says that there may be something new to do.
    pub fn wake(&self) {
        self.shared.wake.notify_all();
    }

    /// Has the threads stand still, once each is done with the chunk that it is reading or the node
    /// that it is decoding.
    pub fn pause(&self) -> Result<PauseGuard<'_>> {
        let died = || Error::Internal("a loading thread died".into());
        let mut residency = self.shared.residency.lock().map_err(|_| died())?;
        self.shared.paused.store(true, Ordering::Relaxed);
        let guard = PauseGuard(&self.shared);
        while self.shared.busy.load(Ordering::Relaxed) > 0 && self.check().is_ok() {
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

    /// Fails where a thread has ended, so that something may never be loaded any more.
    pub fn check(&self) -> Result<()> {
        match self.handles.iter().any(JoinHandle::is_finished) {
            true => Err(Error::Internal("a loading thread died".into())),
            false => Ok(()),
        }
    }
}

impl Drop for LoadingThreads {
    fn drop(&mut self) {
        if let Ok(mut stop) = self.shared.stop.lock() {
            *stop = true;
        }
        self.wake();
        for handle in self.handles.drain(..) {
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
        while let Some((step, reading)) = self.next() {
            let (node, go_on) = (step.node, self.carry_out(step, reading));
            let Some(mut residency) = self.lock() else { return };
            residency.put_down(node);
            self.shared.busy.fetch_sub(1, Ordering::Relaxed);
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
    fn next(&self) -> Option<(Step, Reading)> {
        let mut residency = self.lock()?;
        loop {
            if self.stopped() {
                return None;
            }
            let paused = self.shared.paused.load(Ordering::Relaxed);
            let step = if paused { None } else { residency.next_step() };
            let mut suspended = self.shared.suspended.lock().ok()?;
            // Loads that were given up.
            suspended.retain(|&node, _| matches!(residency.state(node), NodeState::Loading { .. }));
            if let Some(step) = step {
                let reading = suspended.remove(&step.node);
                let reading = reading.filter(|reading| reading.done() == step.from);
                let reading = reading.unwrap_or_else(|| {
                    self.files.begin(step.node, |texture| residency.has_texture(texture))
                });
                residency.take_up(step.node);
                self.shared.busy.fetch_add(1, Ordering::Relaxed);
                return Some((step, reading));
            }
            drop(suspended);
            residency = self.shared.wake.wait_timeout(residency, LONGEST_SLEEP).ok()?.0;
        }
    }

    /// Reads a chunk and decodes the node where it was the last; false at the end.
    fn carry_out(&self, step: Step, mut reading: Reading) -> bool {
        let read = reading.read(step.bytes);
        {
            let Some(mut residency) = self.lock() else { return false };
            if let Err(error) = read {
                residency.broken(step.node);
                drop(residency);
                return self.sender.send(Err(error)).is_ok();
            }
            if !residency.chunk_read(step.node, step.bytes) {
                let Ok(mut suspended) = self.shared.suspended.lock() else { return false };
                suspended.insert(step.node, reading);
                return true;
            }
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
