//! Where the meshes of a file lie; nobody looks for them here.

use super::MjcfReadError;
use super::element::Element;
use roxmltree::Node;
use std::collections::BTreeMap;

/// Files of meshes by name.
#[derive(Clone, Debug, Default)]
pub(super) struct Meshes {
    files: BTreeMap<String, MeshFile>,
}

/// A mesh's file, as a path from the robot's folder, and what its coordinates are multiplied with.
#[derive(Clone, Debug)]
pub(super) struct MeshFile {
    pub path: String,
    pub scale: [f64; 3],
}

impl Meshes {
    /// Of the root element: `<mesh>` of `<asset>`, in the compiler's folder of meshes.
    pub fn read(root: Node<'_, '_>, compiler: Option<&Element<'_, '_>>) -> Result<Self, MjcfReadError> {
        let of_compiler = |name| compiler.and_then(|compiler| compiler.text(name));
        let folder = of_compiler("meshdir").or_else(|| of_compiler("assetdir")).unwrap_or_default();
        let assets = root.children().filter(|node| node.has_tag_name("asset"));
        let mut files = BTreeMap::new();
        for node in assets.flat_map(|asset| asset.children()).filter(|node| node.has_tag_name("mesh")) {
            let Some(file) = node.attribute("file") else { continue };
            let stem = file.rsplit(['/', '\\']).next().unwrap_or(file);
            let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
            let name = node.attribute("name").unwrap_or(stem);
            let path = match folder.trim_end_matches('/') {
                "" => file.to_owned(),
                folder if !file.starts_with('/') => format!("{folder}/{file}"),
                _ => file.to_owned(),
            };
            let scale = Element::new(node, None).numbers::<3>("scale")?.unwrap_or([1.0; 3]);
            files.insert(name.to_owned(), MeshFile { path, scale });
        }
        Ok(Meshes { files })
    }

    pub fn file(&self, name: &str) -> Option<&MeshFile> {
        self.files.get(name)
    }
}
