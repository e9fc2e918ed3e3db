//! The maps of `docs/log-maps.md` are maps.

use phiw_telemetry::LogMap;
use std::path::Path;

#[test]
fn every_map_of_the_documentation_is_read() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/log-maps.md");
    let text = std::fs::read_to_string(&file).unwrap();
    let maps: Vec<&str> =
        text.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert!(maps.len() >= 10, "{} maps in {}", maps.len(), file.display());
    for map in maps {
        LogMap::parse(&file, map).unwrap_or_else(|error| panic!("{error} in\n{map}"));
    }
}
