//! What is shown while the work goes on.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shows how far the work is on standard error, or nothing.
pub struct Console {
    bar: ProgressBar,
}

impl Console {
    /// Shows progress if standard error is a terminal and `quiet` is not asked for.
    pub fn of_terminal(quiet: bool) -> Self {
        // Standard error is not drawn on where it is no terminal.
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        if let Ok(style) = ProgressStyle::with_template("{msg:<40!} {wide_bar} {percent:>3} % {eta:>5}") {
            bar.set_style(style.progress_chars("━╸─"));
        }
        Console { bar }
    }

    /// Shows nothing.
    pub fn silent() -> Self {
        Console::of_terminal(true)
    }

    /// `done` bytes of `total` of what is being done.
    pub fn progress(&self, what: &str, done: u64, total: u64) {
        if self.bar.is_hidden() {
            return;
        }
        if self.bar.message() != what {
            self.bar.set_message(what.to_owned());
            self.bar.set_length(total);
            self.bar.reset();
        }
        self.bar.set_position(done);
    }

    /// Wipes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.finish();
    }
}
