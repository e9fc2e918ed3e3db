//! The extent of a mesh: only where its corners lie, never its faces, so that a few lines read what would
//! else take a library for each format.

use phiw_dynamics::urdf::Extent;

/// Bytes before the triangles of a binary STL, and of each triangle.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: usize = 50;

/// The extent of the corners of an STL (text or binary) or an OBJ in the file's own units; in words why not,
/// where the file is neither, cut short, or empty. `extension` is that of the file's name, in lower case.
pub fn mesh_extent(bytes: &[u8], extension: &str) -> Result<Extent, &'static str> {
    let extent = match extension {
        "stl" => match binary_stl(bytes) {
            Some(extent) => extent,
            None => corners(bytes, "vertex")?,
        },
        "obj" => corners(bytes, "v")?,
        _ => return Err("only STL and OBJ are read"),
    };
    let finite = extent.lower.iter().chain(&extent.upper).all(|value| value.abs() < 1e6);
    match (extent.is_empty(), finite) {
        (true, _) => Err("it has no corners"),
        (false, false) => Err("its corners are not numbers of a robot"),
        (false, true) => Ok(extent),
    }
}

/// A binary STL is as long as its number of triangles says, whatever its head says.
fn binary_stl(bytes: &[u8]) -> Option<Extent> {
    let count = u32::from_le_bytes(*bytes.get(80..STL_HEAD)?.first_chunk()?) as usize;
    if bytes.len() < STL_HEAD.checked_add(count.checked_mul(STL_TRIANGLE)?)?
        || (count == 0 && bytes.starts_with(b"solid"))
    {
        return None;
    }
    let triangles = bytes[STL_HEAD..].chunks_exact(STL_TRIANGLE).take(count);
    let mut extent = Extent::EMPTY;
    for triangle in triangles {
        // The normal comes first, and an attribute last.
        for corner in triangle[12..48].chunks_exact(12) {
            let number = |at: usize| {
                f64::from(f32::from_le_bytes([corner[at], corner[at + 1], corner[at + 2], corner[at + 3]]))
            };
            let point = [number(0), number(4), number(8)];
            // NaN would slip through a minimum.
            let point = point.map(|value| if value.is_nan() { f64::INFINITY } else { value });
            extent = extent.with_point(point);
        }
    }
    Some(extent)
}

/// Lines of text that begin with a word and three numbers.
fn corners(bytes: &[u8], word: &str) -> Result<Extent, &'static str> {
    let mut extent = Extent::EMPTY;
    for line in bytes.split(|byte| *byte == b'\n') {
        let Ok(line) = std::str::from_utf8(line) else { continue };
        let mut words = line.split_whitespace();
        if words.next() != Some(word) {
            continue;
        }
        let mut number = || words.next()?.parse::<f64>().ok().filter(|number| number.is_finite());
        let (Some(x), Some(y), Some(z)) = (number(), number(), number()) else {
            return Err("a corner of it is not three numbers");
        };
        extent = extent.with_point([x, y, z]);
    }
    Ok(extent)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED: Extent = Extent { lower: [-1.0, 0.0, -3.5], upper: [2.0, 4.0, 0.25] };
    const CORNERS: [[f32; 3]; 3] = [[-1.0, 4.0, 0.0], [2.0, 0.0, 0.25], [0.5, 1.0, -3.5]];

    fn binary(corners: [[f32; 3]; 3]) -> Vec<u8> {
        let mut bytes = [b"solid, says the head".as_slice(), &[0; 60]].concat();
        bytes.extend(1_u32.to_le_bytes());
        let numbers = [[9.0; 3]].into_iter().chain(corners).flatten();
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
        bytes
    }

    #[test]
    fn the_same_corners_have_the_same_extent_in_every_format() {
        let lines = |word: &str| CORNERS.map(|[x, y, z]| format!(" {word} {x} {y} {z}\r\n")).concat();
        let text = format!("solid a\nfacet normal 9 9 9\nouter loop\n{}endloop\nendfacet\n", lines("vertex"));
        assert_eq!(mesh_extent(text.as_bytes(), "stl"), Ok(EXPECTED));
        assert_eq!(mesh_extent(&binary(CORNERS), "stl"), Ok(EXPECTED));
        let obj = format!("# nothing\nvn 9 9 9\n{}f 1 2 3\n", lines("v"));
        assert_eq!(mesh_extent(obj.as_bytes(), "obj"), Ok(EXPECTED));
    }

    #[test]
    fn a_file_that_is_no_mesh_is_told_and_never_a_panic() {
        let whole = binary(CORNERS);
        for length in 0..whole.len() {
            assert!(mesh_extent(&whole[..length], "stl").is_err(), "{length}");
        }
        for (bytes, extension) in [
            (&b"v 1 2\n"[..], "obj"),
            (b"v 1 2 nan\n", "obj"),
            (b"v 1 2 1e300\n", "obj"),
            (b"<COLLADA/>", "dae"),
            (b"\xff\xfe\x00", "obj"),
            (&[0xff; 200], "stl"),
        ] {
            assert!(mesh_extent(bytes, extension).is_err(), "{extension}");
        }
        let nan = [[f32::NAN, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0; 3]];
        assert!(mesh_extent(&binary(nan), "stl").is_err());
    }
}
