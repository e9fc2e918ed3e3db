//! The threads that work.

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Does `work` with one thread a core (or `RAYON_NUM_THREADS`), or fewer where the system gives fewer, at the least
/// with the thread that is there.
///
/// The threads are a pool of their own, not the global one: that can be built once only, so that one thread too many
/// would leave none.
pub fn with<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok());
    match pool(asked.filter(|&threads| threads > 0).unwrap_or(most)) {
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
    let mut numbers = std::iter::successors(Some(threads), |&threads| (threads > 1).then_some(threads / 2));
    numbers.find_map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().ok())
}
