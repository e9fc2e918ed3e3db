//! How many of our crates each of our crates depends on.

use std::path::Path;

/// Crates that a library may depend on.
const MOST: usize = 7;
/// What joins the others: docs/architecture.md says why they may depend on more.
const JOIN_OTHERS: [&str; 2] = ["phiw", "experiments"];

/// `curriculum` depended on plants, on every effect and on the tracer, so that whoever wanted an estimator
/// got all of them.
#[test]
fn no_library_depends_on_more_than_seven_of_ours() -> std::io::Result<()> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let mut counted = 0;
    for folder in std::fs::read_dir(crates)? {
        let folder = folder?;
        let name = folder.file_name().to_string_lossy().into_owned();
        let Ok(manifest) = std::fs::read_to_string(folder.path().join("Cargo.toml")) else { continue };
        let sections = manifest.split("\n[").filter(|section| section.starts_with("dependencies]"));
        let ours = sections.flat_map(str::lines).filter(|line| line.starts_with("phiw-")).count();
        assert!(ours <= MOST || JOIN_OTHERS.contains(&name.as_str()), "{name} depends on {ours} of ours");
        counted += 1;
    }
    assert!(counted > 20, "{counted}");
    Ok(())
}
