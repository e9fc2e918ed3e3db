//! What the command links: no simulator, one reader of XML, no `unsafe` of ours.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Names of all crates that `phiw` links on this machine, itself among them.
fn linked() -> BTreeSet<String> {
    let tree = Command::new(env!("CARGO"))
        .args(["tree", "--package", "phiw", "--edges", "normal", "--prefix", "none", "--format", "{p}"])
        .args(["--offline", "--locked"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let lines = String::from_utf8(tree.stdout).unwrap();
    lines.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

/// Those of [`linked`] whose name, in lower case, is like this.
fn linked_like(is_one: impl Fn(&str) -> bool) -> Vec<String> {
    linked().into_iter().filter(|name| is_one(&name.to_lowercase())).collect()
}

/// A command that reads logs has no use for a physics engine, nor for code that it loads while it runs.
#[test]
fn no_simulator() {
    let simulators = linked_like(|name| {
        ["phiw-sim", "rapier", "mujoco"].iter().any(|start| name.starts_with(start)) || name == "libloading"
    });
    assert_eq!(simulators, [""; 0]);
}

/// A URDF went through four readers of XML, three of them unmaintained; two of them spelled names
/// differently.
#[test]
fn one_reader_of_xml() {
    let readers = linked_like(|name| {
        name.contains("xml") || ["elementtree", "minidom", "sxd-document", "urdf-rs"].contains(&name)
    });
    assert_eq!(readers, ["roxmltree"]);
}

/// The workspace denies `unsafe`, but a crate can leave its lints out and a file can allow what is denied.
#[test]
fn no_unsafe_of_ours() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let ours = linked_like(|name| name.starts_with("phiw"));
    assert!(ours.len() > 10, "{ours:?}");
    for name in ours {
        let folder = crates.join(name.strip_prefix("phiw-").unwrap_or(&name));
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        assert!(manifest.contains("[lints]\nworkspace = true"), "{name} leaves the workspace's lints out");
        assert_eq!(allowing_unsafe(&folder.join("src")), [""; 0], "{name}");
    }
}

/// Files of a folder that name the lint `unsafe_code`.
fn allowing_unsafe(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(allowing_unsafe(&path));
        } else if std::fs::read_to_string(&path).is_ok_and(|text| text.contains("unsafe_code")) {
            found.push(path.display().to_string());
        }
    }
    found
}
