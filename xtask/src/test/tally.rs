//! Counts of passed, failed and skipped tests, read from what the test binaries print.

/// Beginning of the line that a test prints instead of testing, where it lacks data.
const SKIPPED: &str = "skipped: ";
/// Lines of what a failed test printed that are kept.
const KEPT_LINES: usize = 24;

/// What became of the tests so far.
///
/// A test that passes but prints a line `skipped: …` has not shown anything: it counts as skipped, not as
/// passed. So does an ignored one.
#[derive(Debug, Default, PartialEq)]
pub struct Tally {
    passed: u64,
    failed: u64,
    skipped: u64,
    /// Within the outputs of passed tests, that `--show-output` prints.
    in_successes: bool,
    /// Whether the test whose output is being read has said that it skipped itself.
    said_so: bool,
    /// Tests of the present binary that have said so; the binary counts them as passed.
    said_so_here: u64,
    /// Within the outputs of failed tests.
    in_failures: bool,
    /// How many more lines of the failed test whose output is being read are kept.
    kept_lines_left: usize,
    /// What failed tests printed, as far as it is kept.
    said_by_failures: Vec<String>,
}

impl Tally {
    /// Takes the next line of the tests' output.
    pub fn read_line(&mut self, line: &str) {
        if let Some(result) = line.strip_prefix("test result: ") {
            let said_so = std::mem::take(&mut self.said_so_here);
            self.in_successes = false;
            self.in_failures = false;
            self.passed += count(result, "passed").saturating_sub(said_so);
            self.failed += count(result, "failed");
            self.skipped += count(result, "ignored") + said_so;
        } else if line == "successes:" {
            self.in_successes = true;
            self.said_so = false;
        } else if line == "failures:" {
            self.in_successes = false;
            // The outputs come first, then, under the same heading, the names.
            self.in_failures = !self.in_failures;
        } else if line.starts_with("---- ") && line.ends_with(" stdout ----") {
            self.said_so = false;
            self.kept_lines_left = KEPT_LINES;
            self.keep(line);
        } else if self.in_failures {
            self.keep(line);
        } else if line.starts_with(SKIPPED) && self.in_successes && !self.said_so {
            self.said_so = true;
            self.said_so_here += 1;
        }
    }

    /// Keeps a line that a failed test printed.
    fn keep(&mut self, line: &str) {
        if self.in_failures && self.kept_lines_left > 0 && !line.is_empty() {
            self.kept_lines_left -= 1;
            self.said_by_failures.push(line.to_owned());
        }
    }

    /// The beginning of what each failed test printed: it stands far above the end of a long output.
    pub fn said_by_failures(&self) -> &[String] {
        &self.said_by_failures
    }

    /// Takes the next line of what pytest prints: the last one counts, `2 passed, 1 skipped in 0.10s`.
    pub fn read_line_of_pytest(&mut self, line: &str) {
        let plain = line.trim_matches('=').trim();
        let starts_with_count = plain.starts_with(|c: char| c.is_ascii_digit());
        if starts_with_count && plain.contains(" in ") && plain.ends_with('s') {
            self.passed += count(plain, "passed");
            self.failed += count(plain, "failed") + count(plain, "error") + count(plain, "errors");
            self.skipped += count(plain, "skipped");
        }
    }

    /// Counts a group of tests that cannot be run here.
    pub fn add_skip(&mut self) {
        self.skipped += 1;
    }

    /// Counts failures that no test reports.
    pub fn add_failures(&mut self, failures: u64) {
        self.failed += failures;
    }

    /// How many tests and checks have failed.
    pub fn failures(&self) -> u64 {
        self.failed
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

/// The number before `what` in `ok. 2 passed; 0 failed; …`, 0 if there is none.
fn count(result: &str, what: &str) -> u64 {
    let words: Vec<&str> = result.split_whitespace().collect();
    let number = words.windows(2).find(|pair| pair[1].trim_end_matches([';', ',']) == what);
    number.and_then(|pair| pair[0].parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::Tally;

    fn check(output: &str, expected: &str) {
        let mut tally = Tally::default();
        output.lines().for_each(|line| tally.read_line(line));
        assert_eq!(tally.to_string(), expected);
    }

    #[test]
    fn sums_over_binaries() {
        check(
            "\
running 3 tests
test result: ok. 2 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s

running 5 tests
test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.10s
",
            "5 passed, 2 failed, 1 skipped",
        );
    }

    #[test]
    fn a_test_that_skips_itself_counts_once_and_not_as_passed() {
        check(
            "\
successes:

---- robots stdout ----
skipped: no a.urdf
skipped: no b.urdf

---- logs stdout ----
skipped: no c.csv

---- talkative stdout ----
nothing was skipped: all is well


successes:
    logs
    robots
    talkative

test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s
",
            "1 passed, 0 failed, 2 skipped",
        );
    }

    #[test]
    fn a_test_that_fails_after_a_skip_has_failed() {
        check(
            "\
failures:

---- robots stdout ----
skipped: no a.urdf
thread 'robots' panicked

failures:
    robots

test result: FAILED. 0 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s
",
            "0 passed, 1 failed, 0 skipped",
        );
    }

    #[test]
    fn what_failed_tests_printed_is_kept_and_nothing_else() {
        let long: Vec<String> = (0..100).map(|line| format!("line {line}")).collect();
        let output = format!(
            "\
successes:

---- talkative stdout ----
all is well

failures:

---- robots stdout ----
{}

---- logs stdout ----
thread 'logs' panicked

failures:
    robots
    logs

test result: FAILED. 1 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s

successes:

---- more stdout ----
of the next binary
",
            long.join("\n")
        );
        let mut tally = Tally::default();
        output.lines().for_each(|line| tally.read_line(line));
        let kept = tally.said_by_failures();
        assert_eq!(kept[..2], ["---- robots stdout ----", "line 0"]);
        assert_eq!(kept[kept.len() - 2..], ["---- logs stdout ----", "thread 'logs' panicked"]);
        assert!(kept.len() < 40, "{kept:?}");
    }

    #[test]
    fn pytest_is_counted_by_its_last_line() {
        let mut tally = Tally::default();
        let lines = [
            "........s.F                                     [100%]",
            "1 failed in here, said a test",
            "===== 1 failed, 9 passed, 1 skipped, 2 errors in 5.08s =====",
        ];
        lines.iter().for_each(|line| tally.read_line_of_pytest(line));
        assert_eq!(tally.to_string(), "9 passed, 3 failed, 1 skipped");
    }

    #[test]
    fn what_tests_that_do_not_pass_say_is_not_counted() {
        check(
            "\
skipped: said by a build script
test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s
",
            "1 passed, 0 failed, 0 skipped",
        );
    }
}
