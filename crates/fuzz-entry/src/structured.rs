//! Robots and logs made of bytes: of the right form, with values that nobody would write.

use arbitrary::{Result, Unstructured};

/// Joints of the logs.
pub const JOINTS: [&str; 2] = ["a", "b"];

/// A number as somebody may have written it.
fn number(bytes: &mut Unstructured<'_>) -> Result<String> {
    const ODD: [&str; 12] =
        ["", "nan", "inf", "-inf", "1e400", "1e308", "-0", "1e-320", "0x1p3", " 1 ", "1,5", "1e50"];
    Ok(match bytes.int_in_range(0..=7)? {
        0 => (*bytes.choose(&ODD)?).to_owned(),
        1 => bytes.arbitrary::<f64>()?.to_string(),
        2 => bytes.arbitrary::<i16>()?.to_string(),
        _ => (f64::from(bytes.arbitrary::<i16>()?) / 4096.0).to_string(),
    })
}

fn numbers(bytes: &mut Unstructured<'_>, count: usize) -> Result<String> {
    let count = if bytes.ratio(1, 30)? { bytes.int_in_range(0..=5)? } else { count };
    Ok((0..count).map(|_| number(bytes)).collect::<Result<Vec<_>>>()?.join(" "))
}

/// A URDF of up to eight bodies, some of which hang on the wrong ones.
///
/// # Errors
/// There are too few bytes.
pub fn robot(bytes: &[u8]) -> Result<String> {
    let bytes = &mut Unstructured::new(bytes);
    let mut text = "<robot name=\"r\"><link name=\"l0\"/>".to_owned();
    let bodies = bytes.int_in_range(1..=8_usize)?;
    for body in 1..=bodies {
        text += &format!("<link name=\"l{body}\">");
        if bytes.ratio(9, 10)? {
            text +=
                &format!("<inertial><origin xyz=\"{}\" rpy=\"{}\"/>", numbers(bytes, 3)?, numbers(bytes, 3)?);
            text += &format!("<mass value=\"{}\"/><inertia", number(bytes)?);
            for name in ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"] {
                text += &format!(" {name}=\"{}\"", number(bytes)?);
            }
            text += "/></inertial>";
        }
        text += "</link>";
        let parent = if bytes.ratio(9, 10)? {
            bytes.int_in_range(0..=body - 1)?
        } else {
            bytes.int_in_range(0..=bodies)?
        };
        let kinds = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];
        let kind = if bytes.ratio(9, 10)? {
            kinds[bytes.int_in_range(0..=3_usize)?]
        } else {
            *bytes.choose(&kinds)?
        };
        text += &format!(
            "<joint name=\"j{body}\" type=\"{kind}\"><parent link=\"l{parent}\"/><child link=\"l{body}\"/>"
        );
        if bytes.ratio(4, 5)? {
            text += &format!("<origin xyz=\"{}\" rpy=\"{}\"/>", numbers(bytes, 3)?, numbers(bytes, 3)?);
        }
        if bytes.ratio(4, 5)? {
            text += &format!("<axis xyz=\"{}\"/>", numbers(bytes, 3)?);
        }
        text += &format!(
            "<limit lower=\"{}\" upper=\"{}\" effort=\"9\" velocity=\"9\"/>",
            number(bytes)?,
            number(bytes)?
        );
        if bytes.ratio(1, 5)? {
            text += &format!("<dynamics damping=\"{}\" friction=\"{}\"/>", number(bytes)?, number(bytes)?);
        }
        if bytes.ratio(1, 10)? {
            let leader = bytes.int_in_range(1..=bodies)?;
            text += &format!(
                "<mimic joint=\"j{leader}\" multiplier=\"{}\" offset=\"{}\"/>",
                number(bytes)?,
                number(bytes)?
            );
        }
        text += "</joint>";
    }
    Ok(text + "</robot>")
}

/// A log of two joints, of up to 400 rows.
///
/// # Errors
/// There are too few bytes.
pub fn log(bytes: &[u8]) -> Result<String> {
    let bytes = &mut Unstructured::new(bytes);
    let mut columns = vec!["t", "q.a", "q.b", "tau.a", "tau.b"];
    for optional in ["qd.a", "qd.b", "qdd.a", "temp.b", "note"] {
        if bytes.ratio(1, 4)? {
            columns.push(optional);
        }
    }
    let mut text = columns.join(",") + "\n";
    let period = f64::from(bytes.int_in_range(1..=100_u8)?) / 1000.0;
    let mut t = if bytes.ratio(1, 3)? { bytes.arbitrary::<f64>()? } else { 0.0 };
    let rows = bytes.int_in_range(0..=400_u32)?;
    for row in 0..rows {
        let mut cells = vec![t.to_string()];
        for column in 1..columns.len() {
            let smooth = (0.1 * f64::from(row) + column as f64).sin();
            // Mostly a signal: the bytes would soon be used up, and all rows be odd.
            cells.push(if bytes.is_empty() || !bytes.ratio(1, 100)? {
                smooth.to_string()
            } else {
                number(bytes)?
            });
        }
        if !bytes.is_empty() && bytes.ratio(1, 200)? {
            cells.truncate(bytes.int_in_range(0..=5)?);
        }
        text += &cells.join(",");
        text.push('\n');
        t += if bytes.is_empty() || !bytes.ratio(1, 100)? {
            period
        } else {
            period * f64::from(bytes.arbitrary::<i8>()?)
        };
    }
    Ok(text)
}
