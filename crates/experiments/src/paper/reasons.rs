//! Why a number differs from the paper's: what a reading of its experiment implies, whatever comes out.

use super::arguments::{Method, NoiseIn, RelaxationName};

/// Why the error of equation (4) is as large as it is, with the noise there.
pub fn of_least_squares(noise_in: NoiseIn) -> &'static str {
    match noise_in {
        NoiseIn::Motion => {
            "the noise moves the robot, and is not in the log: the columns of Φ are correlated with it, which \
             (4) takes for physics; more logs do not help"
        }
        NoiseIn::Both => {
            "part of the noise moves the robot, and is not in the log: the columns of Φ are correlated with \
             it, which (4) takes for physics; more logs do not help"
        }
        NoiseIn::Log => {
            "the noise is on the right-hand side of (4) alone: right on average, and as uncertain as cond(Φ) \
             makes it; more logs help"
        }
        NoiseIn::Delivered => "the log has the torque that moved the robot: (4) has no noise in it",
    }
}

/// Why α is as it is.
pub fn of_alpha(relaxation: RelaxationName, method: Option<Method>) -> &'static str {
    match (relaxation, method) {
        (RelaxationName::Condition, Some(Method::Printed)) => {
            "the printed a and b: a·(cond(Φ) − b) is above α_max as long as cond(Φ) is above 2961, and cond \
             depends on the robot and on the units of its parameters"
        }
        (RelaxationName::Condition, _) => {
            "α_max by the share of motions; a such that the second α is 0.8 α_max, as cond has another scale here"
        }
        (RelaxationName::Uncertainty, _) => {
            "α_max by the share of motions; then in proportion to how uncertain the torques of all motions \
             are, the second α 0.8 α_max"
        }
    }
}

/// Why the true ZMP leaves the support on a base that is bolted down.
pub fn of_balance(noise_in: NoiseIn) -> &'static str {
    match noise_in {
        NoiseIn::Log => "the base is bolted down; the model that keeps the ZMP on the support is wrong",
        NoiseIn::Motion | NoiseIn::Both | NoiseIn::Delivered => {
            "the base is bolted down; the noise of the torques shakes the ZMP at every instant"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::method::relaxation;
    use phiw_curriculum::relaxation::Learnt;

    /// What is said of the printed numbers is what they do, and not what ours do.
    #[test]
    fn what_is_said_of_alpha_is_said_of_the_numbers_that_it_was_made_with() {
        let printed = relaxation(RelaxationName::Condition, Some(Method::Printed));
        let alpha = |condition_number: f64| {
            printed.next(&Learnt {
                first_alpha: 0.74,
                first_condition_number: 1e4,
                condition_number,
                torque_uncertainty: None,
            })
        };
        assert_eq!(alpha(2962.0), 0.74);
        assert!(alpha(2960.0) < 0.74);
        let said = |method| of_alpha(RelaxationName::Condition, method);
        assert!(said(Some(Method::Printed)).contains("2961"));
        assert!(!said(None).contains("printed") && said(Some(Method::Ours)) == said(None));
    }

    /// "The noise moves the robot, and is not in the log" was said of noise that is in the log alone.
    #[test]
    fn what_is_said_of_the_noise_follows_where_it_is() {
        assert!(of_least_squares(NoiseIn::Motion).contains("moves the robot"));
        assert!(!of_least_squares(NoiseIn::Log).contains("moves the robot"));
        assert!(!of_balance(NoiseIn::Log).contains("shakes"));
    }
}
