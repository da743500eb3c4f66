//! Work that gives way to drawing.

/// Has the system run this thread when others leave it time: loading must not make frames late
/// where it is the processor that draws. Where the system does not do so, nothing is lost but that.
#[cfg(target_os = "linux")]
pub(super) fn give_way() {
    // On Linux it is a thread, not a process, that such a number belongs to.
    let _ = rustix::process::setpriority_process(Some(rustix::thread::gettid()), NICENESS);
}

/// Out of 19, which would be no more than what is left over.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 15;

#[cfg(not(target_os = "linux"))]
pub(super) fn give_way() {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn only_the_thread_that_asks_gives_way() {
        let own = || rustix::process::getpriority_process(Some(rustix::thread::gettid()));
        let before = own().expect("priority");
        let there = std::thread::spawn(move || {
            give_way();
            own().expect("priority")
        });
        assert_eq!(there.join().expect("thread"), NICENESS.max(before));
        assert_eq!(own().expect("priority"), before);
    }
}
