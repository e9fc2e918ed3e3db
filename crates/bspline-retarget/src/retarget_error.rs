//! Why a recording can not be retargeted.

use crate::bspline::{BasisError, CurveError};
use crate::human::MapError;
use crate::quality::Quality;
use crate::robot::RobotError;

/// Why a recording can not be retargeted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RetargetError {
    /// The map does not fit the recording.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The robot can not follow.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// Hardly anything moves.
    #[error(
        "most markers are frozen: {frozen} of {seen} stay at one place to the last bit; label or export the recording again"
    )]
    Frozen {
        /// Markers of the map that never move, but for spikes.
        frozen: usize,
        /// Markers of the map that are seen.
        seen: usize,
    },
    /// The splines would not fit into the memory.
    #[error(
        "{duration_s:.0} s with control points every {interval_s} s are more than {most} of them; cut the recording, or give a longer interval"
    )]
    TooManyControlPoints {
        /// The recording's duration \[s\].
        duration_s: f64,
        /// Time between control points \[s\].
        interval_s: f64,
        /// The limit.
        most: usize,
    },
    /// No spline fits the recording.
    #[error("{0}; the recording is too short or its interval of control points too long")]
    Basis(#[from] BasisError),
    /// A single frame is no motion.
    #[error("the recording holds {0} frames; a motion needs at least 2")]
    TooShort(usize),
    /// The solver's numbers do not make curves.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// A motion was found, but the markers are far from it.
    #[error(
        "no person fits: markers are {:.0} mm from where they would be (RMS), `{marker}` {:.0} mm; look for markers that are swapped, frozen or \
         in another unit", 1e3 * rms_m, 1e3 * marker_rms_m
    )]
    FarOff {
        /// Over all markers \[m\].
        rms_m: f64,
        /// The worst.
        marker: String,
        /// Its distance, RMS \[m\].
        marker_rms_m: f64,
    },
    /// Nothing fits.
    #[error("no motion fits: the objective is {0}; look for markers that are swapped or far off")]
    NoFit(f64),
}

/// A motion from which the markers are further than `largest_rms_m` \[m\] is none. What is not a number is
/// not near, either.
pub(crate) fn check_near(quality: &Quality, largest_rms_m: f64) -> Result<(), RetargetError> {
    let rms_m = quality.marker_rms_m;
    let near = rms_m <= largest_rms_m;
    if near {
        return Ok(());
    }
    let each = quality.each_marker_rms_m.iter().filter(|(_, rms_m)| rms_m.is_finite());
    let (marker, marker_rms_m) = each.max_by(|a, b| a.1.total_cmp(&b.1)).cloned().unwrap_or_default();
    Err(RetargetError::FarOff { rms_m, marker, marker_rms_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quality(marker_rms_m: f64) -> Quality {
        Quality {
            marker_rms_m,
            each_marker_rms_m: vec![("A".to_owned(), 0.02), ("B".to_owned(), f64::NAN)],
            elbow_rms_m: 0.0,
            hand_rms_m: 0.0,
            arm_length_m: 1.0,
            limit_excess: 0.0,
            peak_speed: 0.0,
            peak_speed_share: 0.0,
            jerk_rms: 0.0,
        }
    }

    /// NaN is not greater than any limit.
    #[test]
    fn a_distance_that_is_not_a_number_passed_for_a_fit() {
        assert_eq!(check_near(&quality(0.02), 0.1), Ok(()));
        for (rms_m, largest_m) in [(0.2, 0.1), (f64::NAN, 0.1), (0.02, f64::NAN)] {
            let error = check_near(&quality(rms_m), largest_m).unwrap_err();
            assert!(
                matches!(&error, RetargetError::FarOff { marker, .. } if marker == "A"),
                "{rms_m} {largest_m}: {error}"
            );
        }
    }
}
