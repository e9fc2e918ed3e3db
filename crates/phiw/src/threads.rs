//! The threads that work.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Address space that a thread reserves \[bytes\]: its stack, and what the allocator sets aside for it (64 MB
/// in glibc).
#[cfg(target_os = "linux")]
const RESERVED_BY_THREAD: u64 = 66 << 20;

/// Share of a limited address space that threads may reserve: the rest is for the work.
#[cfg(target_os = "linux")]
const SHARE_FOR_THREADS: f64 = 0.25;

/// Does `work` with one thread a core (or `RAYON_NUM_THREADS`), or fewer where the system gives fewer, at the
/// least with the thread that is there.
///
/// The threads are a pool of their own, not the global one: that can be built once only, so that one thread
/// too many would leave none.
pub fn with<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok());
    let threads = asked.filter(|&threads| threads > 0).unwrap_or(most);
    match pool(threads.min(most_in_address_space())) {
        Some(pool) => pool.install(work),
        None => {
            // Whether this succeeds or there is a pool already: there is nothing more to try.
            let _ = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
            work()
        }
    }
}

/// As many threads as the system gives, at most `threads`; none where it gives none.
fn pool(threads: usize) -> Option<ThreadPool> {
    let numbers = std::iter::successors(Some(threads), |&threads| Some(threads / 2));
    let mut numbers = numbers.take_while(|&threads| threads > 0);
    numbers.find_map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().ok())
}

/// Threads for which there is room where the address space is limited (`ulimit -v`).
#[cfg(target_os = "linux")]
fn most_in_address_space() -> usize {
    match rustix::process::getrlimit(rustix::process::Resource::As).current {
        Some(bytes) => (bytes as f64 * SHARE_FOR_THREADS) as usize / RESERVED_BY_THREAD as usize,
        None => usize::MAX,
    }
}

#[cfg(not(target_os = "linux"))]
fn most_in_address_space() -> usize {
    usize::MAX
}
