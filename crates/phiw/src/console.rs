//! What is shown while the work goes on.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use phiw_identification::Interruption;
use std::io::Write;

/// Characters of a message that are shown; a name in a broken file can fill screens.
const LONGEST_MESSAGE: usize = 1000;

/// One message on standard error, of one line. Where nobody listens any more, nothing is lost but the
/// message.
pub fn say(prefix: &str, message: &str) {
    let mut line = String::from(prefix);
    message.chars().take(LONGEST_MESSAGE).for_each(|c| push_visible(&mut line, c));
    let left = message.chars().skip(LONGEST_MESSAGE).count();
    if left > 0 {
        line.push_str(&format!("… ({left} more characters)"));
    }
    line.push('\n');
    let _ = std::io::stderr().write_all(line.as_bytes());
}

/// A text of several lines on standard output. A reader that has seen enough (`| head`) is no failure.
pub fn print(text: &str) {
    let _ = std::io::stdout().write_all(visible(text).as_bytes());
}

/// The text as a terminal may have it: names in logs and robots can hold characters that move its cursor,
/// colour it or turn its direction.
pub fn visible(text: &str) -> String {
    let mut clean = String::with_capacity(text.len());
    for c in text.chars() {
        if c == '\n' { clean.push(c) } else { push_visible(&mut clean, c) }
    }
    clean
}

fn push_visible(text: &mut String, c: char) {
    let turns_direction =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if c.is_control() || turns_direction {
        text.extend(c.escape_default());
    } else {
        text.push(c);
    }
}

/// Shows how far the work is on standard error, or nothing.
pub struct Console {
    bar: ProgressBar,
    listener: Option<Listener>,
    interruption: Interruption,
}

/// Is told how far the work is: what is being done, how much of it is done, and how much there is.
pub type Listener = Box<dyn Fn(&str, u64, u64) + Send + Sync>;

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
        Console { bar, listener: None, interruption: Interruption::default() }
    }

    /// Shows nothing, but tells a listener; `interruption` can call the work off.
    pub fn told_to(listener: Listener, interruption: Interruption) -> Self {
        let mut console = Console::silent();
        console.listener = Some(listener);
        console.interruption = interruption;
        console
    }

    /// Shows nothing.
    pub fn silent() -> Self {
        Console::of_terminal(true)
    }

    /// Whether the work is called off.
    pub fn is_interrupted(&self) -> bool {
        self.interruption.is_called_off()
    }

    /// `done` bytes of `total` of what is being done.
    pub fn progress(&self, what: &str, done: u64, total: u64) {
        if let Some(listener) = &self.listener {
            listener(what, done, total);
        }
        if self.bar.is_hidden() {
            return;
        }
        let what = visible(what).replace('\n', "\\n");
        if self.bar.message() != what {
            self.bar.set_message(what);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_of_inputs_do_not_reach_the_terminal() {
        assert_eq!(
            visible("a\u{1b}[2Jb\r\u{9b}c\u{202e}d\nε — ü"),
            "a\\u{1b}[2Jb\\r\\u{9b}c\\u{202e}d\nε — ü"
        );
    }
}
