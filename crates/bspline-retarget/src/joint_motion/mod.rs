//! Motions that files give as angles of a skeleton's joints: BVH, and the npz of AMASS. The centres of the
//! joints become points, which a marker map places like any others.

pub(crate) mod amass;
pub(crate) mod bvh;

/// A rotation matrix, row by row.
pub(crate) type Rotation = [[f64; 3]; 3];

/// The rotation that turns nothing.
pub(crate) const IDENTITY: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Joints that hang on each other, each after the one it hangs on; the first is the root.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Skeleton {
    pub names: Vec<String>,
    /// The joint that each hangs on; none of the root.
    pub parents: Vec<Option<usize>>,
    /// Where each joint is in the frame of the one it hangs on \[m\].
    pub offsets_m: Vec<[f64; 3]>,
}

impl Skeleton {
    /// Centres of all joints \[m\] in the frame of the root's offset, given where each joint is in the frame
    /// of the one it hangs on \[m\], and how it is turned against it.
    pub fn centres(&self, offsets_m: &[[f64; 3]], rotations: &[Rotation]) -> Vec<[f64; 3]> {
        let mut frames: Vec<(Rotation, [f64; 3])> = Vec::with_capacity(self.names.len());
        for ((parent, offset), rotation) in self.parents.iter().zip(offsets_m).zip(rotations) {
            let frame = match parent.and_then(|parent| frames.get(parent)) {
                Some((turned, centre)) => (product(turned, rotation), sum(*centre, turn(turned, *offset))),
                None => (*rotation, *offset),
            };
            frames.push(frame);
        }
        frames.into_iter().map(|(_, centre)| centre).collect()
    }
}

/// One rotation after another: first `right`, then `left`.
pub(crate) fn product(left: &Rotation, right: &Rotation) -> Rotation {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| (0..3).map(|k| left[row][k] * right[k][column]).sum())
    })
}

fn turn(rotation: &Rotation, vector: [f64; 3]) -> [f64; 3] {
    rotation.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

/// The rotation about a coordinate axis (0 x, 1 y, 2 z) by an angle \[rad\].
pub(crate) fn about_axis(axis: usize, angle: f64) -> Rotation {
    let (sine, cosine) = angle.sin_cos();
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut rotation = IDENTITY;
    rotation[next][next] = cosine;
    rotation[last][last] = cosine;
    rotation[next][last] = -sine;
    rotation[last][next] = sine;
    rotation
}

/// The rotation about a vector by its length \[rad\] (Rodrigues 1840).
pub(crate) fn about_vector(vector: [f64; 3]) -> Rotation {
    let angle = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    // Near zero sin(x)/x and (1 − cos x)/x² are taken by their series.
    let (first, second) = match angle < 1e-4 {
        true => (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0),
        false => (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle)),
    };
    let [x, y, z] = vector;
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let square = product(&cross, &cross);
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            IDENTITY[row][column] + first * cross[row][column] + second * square[row][column]
        })
    })
}

/// A point of a world whose y is up in one whose z is up: x forward, y left, if z was forward and x left.
pub(crate) fn z_up([x, y, z]: [f64; 3]) -> [f64; 3] {
    [z, x, y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn near(a: &Rotation, b: &Rotation) -> bool {
        a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    /// A rotation by a quaternion, which is another formula than Rodrigues'.
    fn of_quaternion(vector: [f64; 3]) -> Rotation {
        let angle = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        let scale = if angle > 0.0 { (angle / 2.0).sin() / angle } else { 0.5 };
        let (w, [x, y, z]) = ((angle / 2.0).cos(), vector.map(|value| value * scale));
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    proptest! {
        #[test]
        fn a_vector_turns_as_its_quaternion_does(vector in prop::array::uniform3(-4.0..4.0), scale in 0_i32..9) {
            let vector = vector.map(|x: f64| x * 10.0_f64.powi(-scale));
            prop_assert!(near(&about_vector(vector), &of_quaternion(vector)));
        }

        #[test]
        fn an_axis_turns_as_its_vector_does(axis in 0_usize..3, angle in -7.0..7.0) {
            let mut vector = [0.0; 3];
            vector[axis] = angle;
            prop_assert!(near(&about_axis(axis, angle), &about_vector(vector)));
        }
    }

    #[test]
    fn a_chain_of_two_bones_is_where_trigonometry_says() {
        let skeleton = Skeleton {
            names: ["root", "elbow", "hand"].map(str::to_owned).to_vec(),
            parents: vec![None, Some(0), Some(1)],
            offsets_m: vec![[1.0, 2.0, 3.0], [0.5, 0.0, 0.0], [0.25, 0.0, 0.0]],
        };
        let (first, second) = (0.7, -1.1);
        let rotations = [about_axis(2, first), about_axis(2, second), IDENTITY];
        let centres = skeleton.centres(&skeleton.offsets_m, &rotations);
        let elbow = [1.0 + 0.5 * first.cos(), 2.0 + 0.5 * first.sin(), 3.0];
        let both: f64 = first + second;
        let hand = [elbow[0] + 0.25 * both.cos(), elbow[1] + 0.25 * both.sin(), 3.0];
        for (found, expected) in centres.iter().zip([[1.0, 2.0, 3.0], elbow, hand]) {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
        }
    }

    #[test]
    fn up_becomes_z_and_left_stays_left() {
        assert_eq!(z_up([0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        // Left of a person who looks along z is x.
        assert_eq!(z_up([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(z_up([0.0, 0.0, 1.0]), [1.0, 0.0, 0.0]);
    }
}
