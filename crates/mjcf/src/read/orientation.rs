//! Where a frame is.

use super::MjcfReadError;
use super::element::Element;
use phiw_dynamics::{Mat3, Placement, Vec3};

/// How angles are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angles {
    /// Radians in a unit.
    pub unit: f64,
    /// Axes of Euler's angles, 0 to 2, and whether each turns with the frame.
    pub sequence: [(usize, bool); 3],
}

impl Angles {
    /// Of `<compiler>`: degrees, and x, y, z that turn with the frame, where it says nothing.
    pub fn read(compiler: Option<&Element<'_, '_>>) -> Result<Self, MjcfReadError> {
        let mut angles = Angles { unit: 1.0_f64.to_radians(), sequence: [(0, true), (1, true), (2, true)] };
        let Some(compiler) = compiler else { return Ok(angles) };
        match compiler.text("angle") {
            None | Some("degree") => {}
            Some("radian") => angles.unit = 1.0,
            Some(other) => return Err(compiler.wrong("angle", other, "degree or radian")),
        }
        if let Some(text) = compiler.text("eulerseq") {
            let axis = |letter: char| {
                let place = ['x', 'y', 'z'].iter().position(|axis| *axis == letter.to_ascii_lowercase());
                place.map(|axis| (axis, letter.is_ascii_lowercase()))
            };
            let sequence: Option<Vec<(usize, bool)>> = text.chars().map(axis).collect();
            let exact = sequence.and_then(|sequence| <[(usize, bool); 3]>::try_from(sequence).ok());
            angles.sequence =
                exact.ok_or_else(|| compiler.wrong("eulerseq", text, "three of x, y, z, X, Y, Z"))?;
        }
        Ok(angles)
    }

    /// The placement that `pos` and one of the five orientations of an element give.
    pub fn placement(&self, element: &Element<'_, '_>) -> Result<Placement<f64>, MjcfReadError> {
        let translation = Vec3(element.numbers::<3>("pos")?.unwrap_or_default());
        Ok(Placement { rotation: self.rotation(element)?, translation })
    }

    fn rotation(&self, element: &Element<'_, '_>) -> Result<Mat3<f64>, MjcfReadError> {
        let zero = |name, text| element.wrong(name, text, "a direction that is not zero");
        if let Some([w, x, y, z]) = element.numbers::<4>("quat")? {
            let norm = (w * w + x * x + y * y + z * z).sqrt();
            let text = element.text("quat").unwrap_or_default();
            return unit(norm, zero("quat", text))
                .map(|norm| Mat3::from_quaternion([x / norm, y / norm, z / norm, w / norm]));
        }
        if let Some([x, y, z, angle]) = element.numbers::<4>("axisangle")? {
            let text = element.text("axisangle").unwrap_or_default();
            let axis = direction(Vec3([x, y, z]), zero("axisangle", text))?;
            return Ok(about(axis, angle * self.unit));
        }
        if let Some(angles) = element.numbers::<3>("euler")? {
            let turn = |rotation: Mat3<f64>, ((axis, inner), angle): ((usize, bool), f64)| {
                let own =
                    about(Vec3(std::array::from_fn(|at| f64::from(u8::from(at == axis)))), angle * self.unit);
                if inner { rotation * own } else { own * rotation }
            };
            return Ok(self.sequence.into_iter().zip(angles).fold(Mat3::identity(), turn));
        }
        if let Some([x0, x1, x2, y0, y1, y2]) = element.numbers::<6>("xyaxes")? {
            let text = element.text("xyaxes").unwrap_or_default();
            let x = direction(Vec3([x0, x1, x2]), zero("xyaxes", text))?;
            let y = Vec3([y0, y1, y2]);
            let y = direction(y - x.scale(x.dot(y)), zero("xyaxes", text))?;
            let z = x.cross(y);
            return Ok(Mat3([x.0, y.0, z.0]).transpose());
        }
        if let Some(z) = element.numbers::<3>("zaxis")? {
            let text = element.text("zaxis").unwrap_or_default();
            return Ok(from_z_to(direction(Vec3(z), zero("zaxis", text))?));
        }
        Ok(Mat3::identity())
    }
}

fn unit(norm: f64, error: MjcfReadError) -> Result<f64, MjcfReadError> {
    if norm > 1e-14 { Ok(norm) } else { Err(error) }
}

/// A vector of length one.
pub(super) fn direction(vector: Vec3<f64>, error: MjcfReadError) -> Result<Vec3<f64>, MjcfReadError> {
    let norm = unit(vector.dot(vector).sqrt(), error)?;
    Ok(vector.scale(1.0 / norm))
}

/// The rotation about a unit axis (Rodrigues).
pub(super) fn about(axis: Vec3<f64>, angle: f64) -> Mat3<f64> {
    let skew = Mat3::skew(axis);
    Mat3::identity() + skew.scale(angle.sin()) + (skew * skew).scale(1.0 - angle.cos())
}

/// The smallest rotation that takes the z axis to a unit vector.
pub(super) fn from_z_to(z: Vec3<f64>) -> Mat3<f64> {
    let axis = Vec3([0.0, 0.0, 1.0]).cross(z);
    let (sine, cosine) = (axis.dot(axis).sqrt(), z.0[2]);
    if sine < 1e-14 {
        // The same way, or half a turn about x.
        return if cosine > 0.0 {
            Mat3::identity()
        } else {
            Mat3([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
        };
    }
    about(axis.scale(1.0 / sine), sine.atan2(cosine))
}

/// Roll, pitch and yaw of a rotation, as URDF takes them. At a pitch of a right angle any yaw will do: roll
/// is taken from what yaw leaves.
pub(super) fn roll_pitch_yaw(rotation: Mat3<f64>) -> [f64; 3] {
    let r = rotation.0;
    let yaw = r[1][0].atan2(r[0][0]);
    let pitch = (-r[2][0]).atan2(r[0][0].hypot(r[1][0]));
    let (sine, cosine) = yaw.sin_cos();
    let roll = (sine * r[0][2] - cosine * r[1][2]).atan2(cosine * r[1][1] - sine * r[0][1]);
    [roll, pitch, yaw]
}
