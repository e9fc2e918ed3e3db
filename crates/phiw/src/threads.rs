//! The threads that work.

/// Starts one thread a core, or fewer where the system gives fewer, at the least the one that is there.
pub fn start() {
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok());
    let mut threads = asked.filter(|&threads| threads > 0).unwrap_or(most);
    while threads > 1 {
        if rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().is_ok() {
            return;
        }
        threads /= 2;
    }
    // Whether this succeeds or there is a pool already: there is nothing more to try.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
}
