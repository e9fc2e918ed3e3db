//! The rules of CONTRIBUTING.md that no tool checks.

use std::path::{Path, PathBuf};

/// Widest line of code (rustfmt.toml), and so of a comment \[columns\]. Stable rustfmt leaves comments as
/// they are.
const WIDEST: usize = 110;

/// Lines of a source text, counted from 1, whose comment goes beyond [`WIDEST`]. A row of a table in a
/// documentation comment cannot be broken and may be wider.
fn wide_comments(source: &str) -> Vec<usize> {
    let is_wide = |line: &str| {
        let line = line.trim_end();
        // `//` in the middle of a word is part of an address.
        let mut starts = line.match_indices("//").map(|(at, _)| at);
        let comment = starts.find(|&at| line[..at].is_empty() || line[..at].ends_with(' '));
        line.chars().count() > WIDEST
            && comment.is_some_and(|at| !line[at..].trim_start_matches(['/', '!', ' ']).starts_with('|'))
    };
    source.lines().enumerate().filter(|(_, line)| is_wide(line)).map(|(at, _)| at + 1).collect()
}

/// All Rust sources below a folder, but for what is built.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Comments grew to 137 columns, as rustfmt does not look at them.
#[test]
fn comments_are_no_wider_than_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    for folder in ["crates", "xtask", "fuzz"] {
        sources(&root.join(folder), &mut files);
    }
    assert!(
        files.iter().any(|file| file.ends_with("dynamics/src/lib.rs")),
        "no sources in {}",
        root.display()
    );
    let mut wide = Vec::new();
    for file in &files {
        let source = std::fs::read_to_string(file).unwrap();
        wide.extend(wide_comments(&source).iter().map(|line| format!("{}:{line}", file.display())));
    }
    assert!(wide.is_empty(), "break these comments at {WIDEST} columns:\n{}", wide.join("\n"));
}

/// The integration tests of a crate are one program, which knows only the files that it lists: one that it
/// does not list would never run.
#[test]
fn every_file_of_tests_is_in_the_program_of_its_crate() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (mut programs, mut forgotten) = (0, Vec::new());
    for entry in std::fs::read_dir(&crates).unwrap() {
        let tests = entry.unwrap().path().join("tests");
        let Ok(program) = std::fs::read_to_string(tests.join("main.rs")) else { continue };
        programs += 1;
        for entry in std::fs::read_dir(&tests).unwrap() {
            let path = entry.unwrap().path();
            let is_module = path.join("mod.rs").exists() || path.extension().is_some_and(|end| end == "rs");
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            if is_module && name != "main" && !program.lines().any(|line| line == format!("mod {name};")) {
                forgotten.push(path.display().to_string());
            }
        }
    }
    assert!(programs > 10, "{programs} programs of tests in {}", crates.display());
    assert!(forgotten.is_empty(), "list these in the main.rs beside them:\n{}", forgotten.join("\n"));
}

#[track_caller]
fn check(line: &str, is_wide: bool) {
    let source = format!("fn f() {{}}\n{line}\n");
    assert_eq!(wide_comments(&source), if is_wide { vec![2] } else { vec![] }, "{line}");
}

#[test]
fn a_wide_comment_is_found_wherever_it_stands() {
    let words = "word ".repeat(22); // 110 columns with the space at its end
    check(&format!("// {words}"), true);
    check(&format!("    /// {words}"), true);
    check(&format!("//! {words}"), true);
    check(&format!("let x = 1; // {words}"), true);
    check(&format!("// {}", &words[..107]), false);
    check(&format!("// {}", &words[..108].replace(' ', "é")), true);
    check(&format!("// {}", "é".repeat(107)), false);
    check(&format!("let x = \"{words}\";"), false);
    check(&format!("let x = \"https://{words}\";"), false);
    check(&format!("/// | {words} |"), false);
}
