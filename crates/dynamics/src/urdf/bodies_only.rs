//! A URDF without its geometry.

use super::UrdfError;
use super::source::{children, parse};
use super::splice::Splices;

/// The URDF without visual and collision geometry: nothing in it names a file, so that every program reads it
/// that needs no geometry. MuJoCo refuses a URDF with a mesh that it cannot find, of `package://` for one.
///
/// # Errors
/// The text is no XML.
pub fn without_geometry(xml: &str) -> Result<String, UrdfError> {
    let document = parse(xml)?;
    let mut splices = Splices::new(document.input_text());
    for link in children(document.root_element(), "link") {
        let geometry = ["visual", "collision"].into_iter().flat_map(|tag| children(link, tag));
        geometry.for_each(|element| splices.remove(element));
    }
    Ok(splices.finish())
}

#[cfg(test)]
mod tests {
    use super::without_geometry;

    #[test]
    fn geometry_goes_and_all_else_stays() -> Result<(), super::UrdfError> {
        let mesh = r#"<geometry><mesh filename="package://nowhere/arm.dae"/></geometry>"#;
        let link = |geometry: &str| {
            format!(
                "<robot name=\"r\">\n  <link name=\"a\">{geometry}\n    <!-- kept -->\n    <inertial/>\n  </link>\n</robot>\n"
            )
        };
        let with = format!("\n    <visual>{mesh}</visual>\n    <visual/>\n    <collision>{mesh}</collision>");
        assert_eq!(without_geometry(&link(&with))?, link(""));
        assert_eq!(without_geometry(&link(""))?, link(""));
        Ok(())
    }
}
