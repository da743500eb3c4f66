//! Steady times where it is the processor that draws.
//!
//! Mesa's llvmpipe has one thread a core, all of which work at once for some milliseconds of each
//! frame. Schedulers sometimes wake two of them on one core and leave the other idle: the same
//! frame then takes half as long again, at random. Bound to a core each they cannot meet.

/// Binds each of llvmpipe's threads to a core. Where there are none, or where the system does not
/// allow it, nothing is done: pictures are the same, only their times are less steady.
#[cfg(target_os = "linux")]
pub(super) fn bind_rasteriser_threads() {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

    let Ok(allowed) = sched_getaffinity(None) else { return };
    let cores: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core)).collect();
    if cores.len() < 2 {
        return;
    }
    for (thread, number) in rasteriser_threads() {
        let mut core = CpuSet::new();
        core.set(cores[number % cores.len()]);
        // Refusal is no reason to stop.
        let _ = sched_setaffinity(Some(thread), &core);
    }
}

/// Other systems let no one choose the cores of another's threads.
#[cfg(not(target_os = "linux"))]
pub(super) fn bind_rasteriser_threads() {}

/// The threads of this process that draw, with their numbers.
#[cfg(target_os = "linux")]
fn rasteriser_threads() -> Vec<(rustix::process::Pid, usize)> {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return Vec::new() };
    let found = tasks.flatten().filter_map(|task| {
        let id = task.file_name().to_str()?.parse().ok()?;
        let name = std::fs::read_to_string(task.path().join("comm")).ok()?;
        Some((rustix::process::Pid::from_raw(id)?, thread_number(&name)?))
    });
    found.collect()
}

/// The number at the end of such a thread's name.
#[cfg(target_os = "linux")]
fn thread_number(name: &str) -> Option<usize> {
    name.trim_end().strip_prefix("llvmpipe-")?.parse().ok()
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_threads_that_draw_are_bound() {
        assert_eq!(thread_number("llvmpipe-0\n"), Some(0));
        assert_eq!(thread_number("llvmpipe-13"), Some(13));
        assert_eq!(thread_number("loading"), None);
        assert_eq!(thread_number("llvmpipe-x"), None);
    }

    #[test]
    fn each_is_bound_to_one_core_of_its_own() {
        use rustix::thread::{CpuSet, sched_getaffinity};

        let Ok(renderer) = crate::render::Renderer::new(&Default::default()) else {
            eprintln!("skipped: no graphics adapter");
            return;
        };
        let cores = sched_getaffinity(None).expect("own cores").count() as usize;
        if cores < 2 || !renderer.adapter().name.contains("llvmpipe") {
            eprintln!("skipped: not drawn by llvmpipe on two cores");
            return;
        }
        // Other tests draw in this process too: their threads end at any moment, and are bound
        // only once their renderer is whole. Those of this renderer live on, so that unbound
        // they would be seen in every round.
        let mut bound = Vec::new();
        for _ in 0..200 {
            bound = rasteriser_threads()
                .into_iter()
                .filter_map(|(thread, _)| sched_getaffinity(Some(thread)).ok())
                .map(|set| (0..CpuSet::MAX_CPU).filter(|&core| set.is_set(core)).collect())
                .collect::<Vec<Vec<usize>>>();
            if !bound.is_empty() && bound.iter().all(|cores| cores.len() == 1) {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        assert!(!bound.is_empty() && bound.iter().all(|cores| cores.len() == 1), "{bound:?}");
        let threads = bound.len();
        bound.sort();
        bound.dedup();
        assert_eq!(bound.len(), cores.min(threads));
    }
}
