//! The decisions of a curriculum as tables of cases.

use phiw_curriculum::IterationRecord;
use phiw_curriculum::constraint::Safety;
use phiw_curriculum::end::{Certain, Converged, EndCriterion, EndReason, FixedCount};
use phiw_curriculum::growth::{rivals_to_separate, saved_by_family, unconfirmed};
use phiw_curriculum::planner::{NoneAllowed, Permission, permission};
use phiw_curriculum::relaxation::{
    ConditionRelaxation, ConstantReduction, Learnt, Maximum, Relaxation, Scale, UncertaintyRelaxation,
};
use phiw_curriculum::selection::Choice;
use phiw_estimation::RobotModel;

fn safety(reductions: &[f64]) -> Vec<Safety> {
    reductions
        .iter()
        .map(|&largest_reduction| Safety {
            largest_reduction,
            margin_m: 0.1 * largest_reduction,
            sure_margin_m: 0.1 * largest_reduction,
        })
        .collect()
}

#[test]
fn permission_is_decided_by_alpha_falls_and_policy() {
    use NoneAllowed::{LeastViolation, Refuse};
    use Permission::{Allowed, Forced, Refused};
    let (nan, never) = (f64::NAN, f64::NEG_INFINITY);
    // Largest reductions, motions on which the robot fell, α, policy, decision.
    type Case<'a> = (&'a [f64], &'a [usize], f64, NoneAllowed, Permission);
    let cases: &[Case<'_>] = &[
        (&[0.5, 0.2, 0.7], &[], 0.4, Refuse, Allowed(vec![0, 2])),
        (&[0.5, 0.2, 0.7], &[], 0.5, Refuse, Allowed(vec![0, 2])),
        (&[0.5, 0.2, 0.7], &[2], 0.4, Refuse, Allowed(vec![0])),
        // None is allowed, but the safest stays on the support.
        (&[0.5, 0.2, 0.7], &[], 0.8, Refuse, Forced(2)),
        (&[0.5, 0.2, 0.7], &[2], 0.8, Refuse, Forced(0)),
        (&[0.0, -0.1], &[], 0.8, Refuse, Forced(0)),
        // Of equally safe motions the first.
        (&[0.1, 0.3, 0.3], &[], 0.8, Refuse, Forced(1)),
        (&[0.1, 0.3, 0.3], &[], 0.8, LeastViolation, Forced(1)),
        // All leave the support.
        (&[-0.2, -0.1], &[], 0.0, Refuse, Refused(Some(1))),
        (&[-0.2, -0.1], &[], 0.0, LeastViolation, Forced(1)),
        (&[never, never], &[], 0.0, Refuse, Refused(Some(0))),
        (&[never, never], &[], 0.0, LeastViolation, Forced(0)),
        // The robot has fallen on all of them.
        (&[0.5, 0.7], &[0, 1], 0.4, Refuse, Refused(None)),
        (&[0.5, 0.7], &[1, 0], 0.6, LeastViolation, Allowed(vec![1])),
        (&[0.5, 0.7], &[1, 0], 0.8, LeastViolation, Forced(1)),
        // What is not a number is not safe.
        (&[nan, 0.3], &[], 0.2, Refuse, Allowed(vec![1])),
        (&[nan, -0.3], &[], 0.2, LeastViolation, Forced(1)),
        (&[nan], &[], 0.2, Refuse, Refused(Some(0))),
        (&[], &[], 0.2, Refuse, Refused(None)),
        (&[], &[], 0.2, LeastViolation, Refused(None)),
    ];
    for (reductions, excluded, alpha, policy, expected) in cases {
        let found = permission(&safety(reductions), excluded, *alpha, *policy);
        assert_eq!(found, *expected, "{reductions:?} without {excluded:?} at {alpha}, {policy:?}");
    }
    assert_eq!(NoneAllowed::default(), Refuse);
}

#[test]
fn alpha_follows_what_has_been_learnt() {
    let (condition, uncertainty) = (ConditionRelaxation::default(), UncertaintyRelaxation::default());
    let paper = ConditionRelaxation { maximum: Maximum::Fixed(0.74), scale: Scale::Fixed(2.5e-4), bias: 1.0 };
    let infinite = Some(f64::INFINITY);
    // Relaxation, α of the first iteration, cond after each iteration, torque uncertainty after each, α.
    type Case<'a> = (&'a dyn Relaxation, f64, &'a [Option<f64>], &'a [Option<f64>], f64);
    let cases: &[Case<'_>] = &[
        // Nothing has been learnt.
        (&condition, 0.7, &[], &[], 0.7),
        (&condition, 0.7, &[None], &[None], 0.7),
        (&condition, 0.7, &[infinite], &[], 0.7),
        (&condition, 0.7, &[Some(101.0), None], &[], 0.7),
        // After the first measurement 0.8 of α_max, then in proportion to cond − 1.
        (&condition, 0.7, &[Some(101.0)], &[], 0.56),
        (&condition, 0.7, &[Some(101.0), Some(51.0)], &[], 0.28),
        (&condition, 0.7, &[Some(101.0), Some(1.0)], &[], 0.0),
        (&condition, 0.7, &[Some(101.0), Some(1e6)], &[], 0.7),
        // What was not determined at first is not what α is relaxed from.
        (&condition, 0.7, &[None, Some(101.0)], &[], 0.56),
        (&condition, 0.7, &[infinite, Some(101.0), Some(51.0)], &[], 0.28),
        (&paper, 0.74, &[Some(2961.0), Some(1201.0)], &[], 0.3),
        (&uncertainty, 0.5, &[Some(9.0)], &[Some(0.2)], 0.4),
        (&uncertainty, 0.5, &[Some(9.0), Some(9.0)], &[Some(0.2), Some(0.05)], 0.1),
        (&uncertainty, 0.5, &[Some(9.0), Some(9.0)], &[None, Some(0.05)], 0.4),
        (&uncertainty, 0.5, &[Some(9.0), Some(9.0)], &[], 0.5),
        (&ConstantReduction(0.2), 0.2, &[Some(9.0), Some(8.0)], &[], 0.2),
    ];
    for (relaxation, first, conds, uncertainties, expected) in cases {
        let learnt = Learnt::of(*first, conds, uncertainties);
        let alpha = learnt.map_or(*first, |learnt| relaxation.next(&learnt));
        assert!((alpha - expected).abs() < 1e-12, "{first} {conds:?} {uncertainties:?}: {alpha}, {expected}");
    }
}

#[test]
fn the_first_alpha_lets_a_share_of_the_motions_in() {
    let share = |share: f64| ConditionRelaxation { maximum: Maximum::Share(share), ..Default::default() };
    let fixed = ConditionRelaxation { maximum: Maximum::Fixed(0.9), ..Default::default() };
    let cases: &[(ConditionRelaxation, &[f64], f64)] = &[
        (share(0.05), &[0.1, 0.4, 0.2], 0.4),
        (share(0.5), &[0.1, 0.4, 0.2], 0.2),
        (share(1.0), &[0.1, 0.4, 0.2], 0.1),
        // A region can shrink to a point and no further, and cannot grow.
        (share(0.05), &[3.0], 1.0),
        (share(0.05), &[-0.2], 0.0),
        (share(0.05), &[], 0.0),
        (fixed, &[0.1], 0.9),
    ];
    for (relaxation, reductions, expected) in cases {
        assert_eq!(relaxation.first(&safety(reductions)), *expected, "{relaxation:?} {reductions:?}");
    }
}

fn record(cond: Option<f64>, change: Option<f64>, uncertainty: Option<f64>) -> IterationRecord {
    IterationRecord {
        motion: String::new(),
        choice: Choice { motion: 0, merit: None, runner_up: None },
        allowed: 1,
        forced: false,
        alpha: 0.5,
        margin_m: None,
        sure_margin_m: None,
        kept: None,
        fell_at_s: None,
        still_share: 1.0,
        tracking_error: Vec::new(),
        condition_number: cond,
        torque_uncertainty: uncertainty,
        torque_change: change,
        separates: None,
        model: RobotModel { standard: Vec::new(), effects: Vec::new() },
        standard_deviations: Vec::new(),
        misfit: Vec::new(),
    }
}

#[test]
fn a_curriculum_stops_when_its_criterion_says_so() {
    let converged = Converged { torque_change: 0.02, condition_change: 0.1, least: 2, most: 4 };
    let patient = Converged { least: 3, ..converged };
    let certain = Certain { torque_uncertainty: 0.3, most: 4 };
    let settled = || record(Some(100.0), Some(0.01), Some(0.3));
    let moving = || record(Some(100.0), Some(0.5), Some(0.31));
    let better = || record(Some(80.0), Some(0.01), None);
    let fallen = || record(None, None, None);
    let (by_count, done) = (Some(EndReason::Count), Some(EndReason::Converged));
    let cases: Vec<(&dyn EndCriterion, Vec<IterationRecord>, Option<EndReason>)> = vec![
        (&FixedCount(2), vec![], None),
        (&FixedCount(2), vec![settled()], None),
        (&FixedCount(2), vec![settled(), settled()], by_count),
        (&converged, vec![], None),
        (&converged, vec![settled()], None),
        (&converged, vec![moving(), settled()], done),
        (&patient, vec![moving(), settled()], None),
        (&patient, vec![moving(), moving(), settled()], done),
        (&converged, vec![settled(), moving()], None),
        // cond falls by a fifth: another motion may be worth as much.
        (&converged, vec![settled(), better()], None),
        (&converged, vec![settled(), fallen()], None),
        (&converged, vec![fallen(), settled()], None),
        (&converged, vec![moving(), moving(), moving(), moving()], by_count),
        (&certain, vec![settled()], done),
        (&certain, vec![moving()], None),
        (&certain, vec![settled(), fallen()], None),
        (&certain, vec![fallen(), fallen(), fallen(), fallen()], by_count),
        (&certain, vec![fallen(), fallen(), fallen(), settled()], done),
    ];
    for (index, (criterion, history, expected)) in cases.iter().enumerate() {
        assert_eq!(criterion.reason(history), *expected, "case {index}");
    }
}

#[test]
fn the_best_motion_is_chosen_by_its_score() {
    use phiw_curriculum::selection::{Best, Scored, decide};
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    // Motions and scores, which end is best, the best motion and the next.
    type Case<'a> = (&'a [(usize, f64)], Best, Option<(usize, Option<usize>)>);
    let cases: &[Case<'_>] = &[
        (&[(3, 5.0), (7, 2.0), (9, 4.0)], Best::Smallest, Some((7, Some(9)))),
        (&[(3, 5.0), (7, 2.0), (9, 4.0)], Best::Largest, Some((3, Some(9)))),
        (&[(7, 2.0)], Best::Smallest, Some((7, None))),
        // Equals: the first.
        (&[(9, 2.0), (7, 2.0), (3, 4.0)], Best::Smallest, Some((7, Some(9)))),
        (&[(9, 2.0), (7, 2.0), (3, 1.0)], Best::Largest, Some((7, Some(9)))),
        // A cond of a Φ without full rank is infinite, and no reason to stop.
        (&[(3, infinite), (7, 2.0)], Best::Smallest, Some((7, Some(3)))),
        (&[(3, infinite), (7, infinite)], Best::Smallest, Some((3, Some(7)))),
        // What is not a number is never the best.
        (&[(3, nan), (7, 2.0)], Best::Smallest, Some((7, Some(3)))),
        (&[(3, -nan), (7, 2.0)], Best::Smallest, Some((7, Some(3)))),
        (&[(3, nan), (7, 2.0)], Best::Largest, Some((7, Some(3)))),
        (&[], Best::Smallest, None),
    ];
    for (scores, best, expected) in cases {
        let scored: Vec<Scored> = scores.iter().map(|&(motion, score)| Scored { motion, score }).collect();
        let found = decide(&scored, *best).map(|choice| (choice.motion, choice.runner_up.map(|next| next.0)));
        assert_eq!(found, *expected, "{scores:?} {best:?}");
    }
}

#[test]
fn an_effect_that_the_likelihood_does_not_confirm_is_left_out() {
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let cases: &[(&[f64], Option<usize>)] = &[
        (&[], None),
        (&[20.0], None),
        (&[19.9], Some(0)),
        (&[50.0, 3.0, 7.0], Some(1)),
        (&[3.0, 3.0], Some(0)),
        (&[50.0, infinite], None),
        (&[50.0, -4.0], Some(1)),
        (&[50.0, nan], Some(1)),
        (&[50.0, -nan, 3.0], Some(1)),
    ];
    for (gains, expected) in cases {
        assert_eq!(unconfirmed(gains, 20.0), *expected, "{gains:?}");
    }
}

/// What a family saves as one hypothesis, against the closed form of a normal distribution whose spread is
/// fitted: the likelihood of n values of variance m over that of variance 1.
#[test]
fn a_family_saves_what_the_spread_of_its_members_explains() {
    for (members, mean_square) in [(2, 1.5), (6, 6.25), (18, 6.25), (18, 100.0)] {
        let n = f64::from(members);
        let log_likelihood = |variance: f64| -0.5 * n * (variance.ln() + mean_square / variance);
        let expected = log_likelihood(mean_square) - log_likelihood(1.0);
        let saved = saved_by_family(0.5 * n * mean_square, members as usize);
        assert!((saved - expected).abs() < 1e-9 * expected, "{members}, {mean_square}: {saved}");
    }
    // What noise makes is nothing, one effect saves what it saves, and what is no number stays so.
    assert_eq!(saved_by_family(9.0, 18), 0.0);
    assert_eq!(saved_by_family(3.0, 18), 0.0);
    assert_eq!(saved_by_family(7.0, 1), 7.0);
    assert_eq!(saved_by_family(f64::INFINITY, 18), f64::INFINITY);
    assert!(saved_by_family(f64::NAN, 18).is_nan());
}

#[test]
fn rivals_have_one_motion_and_then_the_parameters_have_one() {
    let pair = |one: &str, other: &str| [one.to_owned(), other.to_owned()];
    let (ab, ba, ac) = (pair("a", "b"), pair("b", "a"), pair("a", "c"));
    type Case = (Vec<[String; 2]>, Vec<Option<[String; 2]>>, Option<usize>);
    let cases: Vec<Case> = vec![
        (vec![], vec![], None),
        (vec![ab.clone()], vec![], Some(0)),
        (vec![ab.clone()], vec![None], Some(0)),
        // The last motion was for rivals.
        (vec![ac.clone()], vec![None, Some(ab.clone())], None),
        (vec![ac.clone()], vec![Some(ab.clone()), None], Some(0)),
        // They have had theirs, whichever was believed then.
        (vec![ab.clone()], vec![Some(ab.clone()), None], None),
        (vec![ab.clone()], vec![Some(ba), None], None),
        (vec![ab.clone(), ac], vec![Some(ab), None], Some(1)),
    ];
    for (index, (rivals, separated, expected)) in cases.iter().enumerate() {
        assert_eq!(rivals_to_separate(rivals, separated), *expected, "case {index}");
    }
}
