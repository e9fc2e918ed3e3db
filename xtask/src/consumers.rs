//! Published crates as a new user meets them: the examples of each `README.md`, compiled and run in a workspace of its own that knows nothing of this one
//! but where the crates lie.

use crate::environment;
use anyhow::Context;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// What crates.io shows of a crate, beside its README.
const METADATA: [&str; 5] = ["description", "license", "keywords", "categories", "rust_version"];

/// A workspace in a temporary folder, with one crate for each published crate.
pub struct Consumers {
    folder: TempDir,
    /// Published crates without an example that can be run, or with metadata that are not complete: one line each.
    pub problems: Vec<String>,
}

impl Consumers {
    /// Reads the READMEs and writes the crates that use them.
    ///
    /// # Errors
    /// The workspace cannot be read, or the temporary folder cannot be written.
    pub fn generate() -> anyhow::Result<Self> {
        let root = environment::workspace_root()?;
        let folder = tempfile::Builder::new().prefix("phiw-consumers-").tempdir()?;
        let mut problems = Vec::new();
        for package in packages()?.iter().filter(|package| package["publish"].is_null()) {
            let name = package["name"].as_str().unwrap_or_default();
            let empty =
                |key: &&str| matches!(&package[key], Value::Null) || package[key] == Value::Array(vec![]);
            problems
                .extend(METADATA.iter().filter(|key| empty(key)).map(|key| format!("{name} has no {key}")));
            let readme = directory(package).join(package["readme"].as_str().unwrap_or("README.md"));
            let text = fs::read_to_string(&readme).unwrap_or_default();
            match examples(&text, &name.replace('-', "_")) {
                Ok(tests) => write_crate(&folder.path().join(name), name, package, &tests)?,
                Err(problem) => problems.push(format!("{}: {problem}", readme.display())),
            }
        }
        // The same versions and profiles, so that what others wrote is compiled once; ours need no optimisation for an example.
        let manifest = fs::read_to_string(root.join("Cargo.toml"))?;
        let shared = |section: &&str| section.starts_with("profile.") && !section.contains(".phiw-");
        let profiles: Vec<String> =
            manifest.split("\n[").filter(shared).map(|text| format!("[{text}\n")).collect();
        let workspace = format!("[workspace]\nresolver = \"3\"\nmembers = [\"*\"]\n\n{}", profiles.concat());
        fs::write(folder.path().join("Cargo.toml"), workspace)?;
        fs::copy(root.join("Cargo.lock"), folder.path().join("Cargo.lock"))?;
        Ok(Consumers { folder, problems })
    }

    /// The call of cargo that compiles and runs the examples. Their dependencies are those of this workspace, which has been built: no network.
    ///
    /// # Errors
    /// The task was not started by `cargo xtask`.
    pub fn arguments(&self) -> anyhow::Result<Vec<String>> {
        let manifest = self.folder.path().join("Cargo.toml").display().to_string();
        let target = environment::target_directory()?.display().to_string();
        let paths = ["--manifest-path", &manifest, "--target-dir", &target];
        let before = ["test", "--workspace", "--offline", "--no-fail-fast"];
        let after = ["--", "--show-output"];
        Ok(before.iter().chain(&paths).chain(&after).map(|&argument| argument.to_owned()).collect())
    }
}

/// The packages of the workspace, as `cargo metadata` has them.
fn packages() -> anyhow::Result<Vec<Value>> {
    let output = environment::cargo()?
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .output()?;
    let mut metadata: Value = serde_json::from_slice(&output.stdout).context("cargo metadata")?;
    Ok(metadata["packages"].as_array_mut().map(std::mem::take).unwrap_or_default())
}

fn directory(package: &Value) -> PathBuf {
    Path::new(package["manifest_path"].as_str().unwrap_or_default()).with_file_name("")
}

/// A crate whose only target is the test `tests`, with the dependencies that the examples name: the crate itself, and what it uses and is tested with.
fn write_crate(folder: &Path, name: &str, package: &Value, tests: &str) -> anyhow::Result<()> {
    let mut dependencies = format!("{name} = {{ path = {:?} }}\n", directory(package));
    for dependency in package["dependencies"].as_array().into_iter().flatten() {
        let other = dependency["name"].as_str().unwrap_or_default();
        if !tests.contains(&format!("{}::", other.replace('-', "_"))) {
            continue;
        }
        let source = match dependency["path"].as_str() {
            Some(path) => format!("path = {path:?}"),
            None => format!(
                "version = {}, default-features = {}, features = {}",
                dependency["req"], dependency["uses_default_features"], dependency["features"]
            ),
        };
        let line = format!("{other} = {{ {source} }}\n");
        if !dependencies.contains(&line) {
            dependencies.push_str(&line);
        }
    }
    let target = format!("[[test]]\nname = \"{}_readme\"\npath = \"README.rs\"\n", name.replace('-', "_"));
    let package = format!("[package]\nname = \"{name}-consumer\"\nedition = \"2024\"\n");
    fs::create_dir_all(folder)?;
    let lints = "[lints.rust]\nunused = \"deny\"\n";
    let manifest = format!("{package}\n[dependencies]\n{dependencies}\n{target}\n{lints}");
    fs::write(folder.join("Cargo.toml"), manifest)?;
    Ok(fs::write(folder.join("README.rs"), tests)?)
}

/// Each block of Rust as a test of its own, every line where it is in the README, so that what rustc and a panic say of a line is true of the README.
///
/// # Errors
/// There is no block, or one that would not be run.
fn examples(readme: &str, name: &str) -> Result<String, String> {
    let (mut tests, mut body) = (String::new(), None::<String>);
    for (number, line) in (1..).zip(readme.lines()) {
        match (&mut body, line.trim_start().strip_prefix("```")) {
            (None, Some("rust")) => {
                tests.push_str(&format!(
                    "#[test] fn {name}_readme_line_{number}() -> Result<(), Box<dyn std::error::Error>> {{"
                ));
                body = Some(String::new());
            }
            (None, Some(flags)) if flags.starts_with("rust") => {
                return Err(format!("line {number}: an example must run: {flags} would not"));
            }
            (Some(code), Some(_)) => {
                // As rustdoc has it: an example may be a program of its own, or end in an `Ok`, or just end.
                let is_program = code.contains("fn main(");
                let end = if is_program { "Ok(main()?)" } else { "Ok(())" };
                tests.push_str(if !is_program && code.trim_end().ends_with("(())") { "}" } else { end });
                tests.push_str(if tests.ends_with('}') { "" } else { " }" });
                body = None;
            }
            (Some(code), None) => {
                let shown = if line == "#" { "" } else { line.strip_prefix("# ").unwrap_or(line) };
                tests.push_str(shown);
                code.push_str(shown);
                code.push('\n');
            }
            (None, _) => {}
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
    fn every_line_of_an_example_stays_where_it_is() {
        check("# a\n```rust\nlet x = 1;\n```\n", Ok("\nHEAD\nlet x = 1;\nOk(()) }\n"));
        check("# a\n```rust\nf()?;\n# Ok::<(), E>(())\n```\n", Ok("\nHEAD\nf()?;\nOk::<(), E>(())\n}\n"));
        check(
            "# a\n```rust\n# fn main() -> R {\n# g() }\n```\n",
            Ok("\nHEAD\nfn main() -> R {\ng() }\nOk(main()?) }\n"),
        );
        check("# a\n```rust\n#\n```\n```text\nnot code\n```\n", Ok("\nHEAD\n\nOk(()) }\n\n\n\n"));
    }

    #[test]
    fn a_readme_whose_example_would_not_run_is_a_problem() {
        check("# a\n", Err("it has no example: a block of ```rust that a user could run"));
        check("# a\n```rust,no_run\nf();\n```\n", Err("line 2: an example must run: rust,no_run would not"));
    }
}
