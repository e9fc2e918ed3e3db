//! Published crates as a new user meets them: the examples of each `README.md`, compiled and run in a
//! workspace outside of this one.

use anyhow::Context;
use phiw_experiments::environment;
use serde_json::Value;
use std::{collections::BTreeSet, fs, path::Path};

/// Writes a workspace into `folder`, with a crate for each published crate that uses it as its README does.
/// What is returned are published crates without an example that can be run, or with metadata that are not
/// complete: one line each.
pub fn generate(folder: &Path) -> anyhow::Result<Vec<String>> {
    let mut problems = Vec::new();
    let metadata = ["metadata", "--no-deps", "--offline", "--format-version", "1"];
    let metadata: Value = serde_json::from_slice(&environment::cargo()?.args(metadata).output()?.stdout)?;
    let packages = metadata["packages"].as_array().context("cargo metadata names no packages")?;
    for package in packages.iter().filter(|package| package["publish"].is_null()) {
        let name = package["name"].as_str().context("a package without a name")?;
        let missing = |key: &&str| package[key].is_null() || package[key] == Value::Array(vec![]);
        let keys = ["description", "license", "keywords", "categories"].into_iter();
        problems.extend(keys.filter(missing).map(|key| format!("{name} has no {key}")));
        let manifest = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        let readme = fs::read_to_string(manifest.with_file_name("README.md")).unwrap_or_default();
        match examples(&readme, &name.replace('-', "_")) {
            Ok(tests) => write_crate(&folder.join(name), name, package, &tests)?,
            Err(problem) => problems.push(format!("README.md of {name}: {problem}")),
        }
    }
    // The same versions and profiles, so that what others wrote is compiled once. Ours need no optimisation
    // for an example.
    let root = environment::workspace_root()?;
    let manifest = fs::read_to_string(root.join("Cargo.toml"))?;
    let shared = |section: &&str| {
        let profile = section.starts_with("profile.") && !section.contains(".phiw-");
        profile || section.starts_with("workspace.dependencies]")
    };
    let shared: String =
        manifest.split("\n[").filter(shared).map(|section| format!("[{section}\n")).collect();
    let shared = shared.replace("path = \"", &format!("path = \"{}/", root.display()));
    let workspace = format!("[workspace]\nresolver = \"3\"\nmembers = [\"*\"]\n\n{shared}");
    fs::write(folder.join("Cargo.toml"), workspace)?;
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock"))?;
    Ok(problems)
}

/// The call of cargo that compiles and runs the examples. All that they depend on has been fetched for this
/// workspace: no network.
pub fn arguments(folder: &Path) -> anyhow::Result<Vec<String>> {
    let manifest = folder.join("Cargo.toml").display().to_string();
    let target = environment::target_directory()?.display().to_string();
    let before = ["test", "--workspace", "--offline", "--no-fail-fast", "--manifest-path"];
    let after = [&manifest, "--target-dir", &target, "--", "--show-output"];
    Ok(before.into_iter().chain(after).map(str::to_owned).collect())
}

/// A crate whose only target is the test `tests`. It depends on what the examples name, of the crate itself
/// and what that uses or is tested with.
fn write_crate(folder: &Path, name: &str, package: &Value, tests: &str) -> anyhow::Result<()> {
    let all = package["dependencies"].as_array().into_iter().flatten();
    let named = |other: &&str| tests.contains(&format!("{}::", other.replace('-', "_")));
    let all = all.filter_map(|dependency| dependency["name"].as_str());
    let dependencies: BTreeSet<&str> = all.filter(named).chain([name]).collect();
    let dependencies: String =
        dependencies.iter().map(|dependency| format!("{dependency}.workspace = true\n")).collect();
    let manifest = format!(
        "[package]\nname = \"{name}-consumer\"\nedition = \"2024\"\n\n[dependencies]\n{dependencies}\n\
         [[test]]\nname = \"{}_readme\"\npath = \"README.rs\"\n\n[lints.rust]\nunused = \"deny\"\n",
        name.replace('-', "_")
    );
    fs::create_dir_all(folder)?;
    fs::write(folder.join("Cargo.toml"), manifest)?;
    Ok(fs::write(folder.join("README.rs"), tests)?)
}

/// Each block of Rust as a test of its own, every line where it is in the README, so that what rustc and a
/// panic say of a line is true of the README. A README without any, or with one that would not be run, is an
/// error.
fn examples(readme: &str, name: &str) -> Result<String, String> {
    let (mut tests, mut start) = (String::new(), None);
    for (number, line) in (1..).zip(readme.lines()) {
        match (start, line.trim_start().strip_prefix("```")) {
            (None, Some("rust")) => {
                let head =
                    format!("fn {name}_readme_line_{number}() -> Result<(), Box<dyn std::error::Error>>");
                tests += &format!("#[test] {head} {{");
                start = Some(tests.len());
            }
            (None, Some(flags)) if flags.starts_with("rust") => {
                return Err(format!("line {number}: an example must run: {flags} would not"));
            }
            (Some(from), Some(_)) => {
                // As rustdoc has it: an example is a program, or ends in an `Ok`, or just ends.
                let code = tests[from..].trim_end();
                let (is_program, has_result) = (code.contains("fn main("), code.ends_with("(())"));
                tests += if is_program {
                    "Ok(main()?) }"
                } else if has_result {
                    "}"
                } else {
                    "Ok(()) }"
                };
                start = None;
            }
            (Some(_), None) if line != "#" => tests += line.strip_prefix("# ").unwrap_or(line),
            _ => {}
        }
        tests.push('\n');
    }
    match tests.trim() {
        "" => Err("it has no example: a block of ```rust that a user could run".to_owned()),
        _ => Ok(tests),
    }
}

#[cfg(test)]
mod tests {
    use super::examples;

    fn check(readme: &str, expected: Result<&str, &str>) {
        let head = "#[test] fn a_readme_line_2() -> Result<(), Box<dyn std::error::Error>> {";
        let expected = expected.map(|tests| tests.replace("HEAD", head)).map_err(str::to_owned);
        assert_eq!(examples(readme, "a"), expected);
    }

    #[test]
    fn every_line_of_an_example_stays_where_it_is_and_is_run() {
        check("\n```rust\nlet x = 1;\n```\n", Ok("\nHEAD\nlet x = 1;\nOk(()) }\n"));
        check("\n```rust\nf()?;\n# Ok::<(), E>(())\n```\n", Ok("\nHEAD\nf()?;\nOk::<(), E>(())\n}\n"));
        check("a\n```rust\n# fn main() {\n}\n```\n", Ok("\nHEAD\nfn main() {\n}\nOk(main()?) }\n"));
        check("a\n```rust\n#\n```\n```text\nno code\n```\n", Ok("\nHEAD\n\nOk(()) }\n\n\n\n"));
        check("# a\n", Err("it has no example: a block of ```rust that a user could run"));
        check("```rust,no_run\n```\n", Err("line 1: an example must run: rust,no_run would not"));
    }
}
