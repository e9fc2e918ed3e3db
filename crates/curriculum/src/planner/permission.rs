//! Which motions may be chosen: the decision by the constraint, and what happens where it allows none.

use crate::constraint::Safety;
use serde::{Deserialize, Serialize};

/// What to do where the constraint allows no motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoneAllowed {
    /// The safest motion is taken if it keeps the ZMP inside the whole region, and no motion otherwise. The
    /// default, since what is planned may be run by a real robot.
    #[default]
    Refuse,
    /// The safest motion is taken even if the robot is expected to fall. For simulated robots only: the
    /// paper's experiments start from models so wrong that nothing looks safe.
    LeastViolation,
}

/// Which motions may be chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Permission {
    /// These, ascending and never empty.
    Allowed(Vec<usize>),
    /// The constraint allows none, and this one is the safest.
    Forced(usize),
    /// No motion may be chosen. This is the safest one that the robot has not fallen on; none if it has
    /// fallen on all.
    Refused(Option<usize>),
}

/// Decides which motions may be chosen at the reduction coefficient `alpha`, from how safe each is. The robot
/// has fallen on the `excluded` ones.
///
/// A motion whose safety is not a number is never allowed. Of motions that are equally safe the first is
/// forced.
pub fn permission(motions: &[Safety], excluded: &[usize], alpha: f64, policy: NoneAllowed) -> Permission {
    let fell = |motion: &usize| excluded.contains(motion);
    let mut open: Vec<usize> = (0..motions.len()).filter(|motion| !fell(motion)).collect();
    if open.is_empty() && policy == NoneAllowed::LeastViolation {
        open = (0..motions.len()).collect();
    }
    let reduction = |motion: usize| match motions[motion].largest_reduction {
        reduction if reduction.is_nan() => f64::NEG_INFINITY,
        reduction => reduction,
    };
    let allowed: Vec<usize> = open.iter().copied().filter(|&motion| reduction(motion) >= alpha).collect();
    if !allowed.is_empty() {
        return Permission::Allowed(allowed);
    }
    let safest = open.into_iter().max_by(|&a, &b| reduction(a).total_cmp(&reduction(b)).then(b.cmp(&a)));
    match (safest, policy) {
        (Some(safest), NoneAllowed::LeastViolation) => Permission::Forced(safest),
        (Some(safest), NoneAllowed::Refuse) if reduction(safest) >= 0.0 => Permission::Forced(safest),
        (safest, _) => Permission::Refused(safest),
    }
}
