//! Selections against the naive way: merge every candidate, decompose, compare.

use crate::arm;

use arm::{motions, tree};
use phiw_curriculum::motion::MotionDataset;
use phiw_curriculum::selection::{
    AOptimal, DOptimal, MotionCandidates, Question, RandomMotion, Selection, SmallestCondition,
    TorqueOptimal, TorqueOptimalPerSecond, Triangle,
};
use phiw_effects::Catalogue;
use phiw_estimation::Robot;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn dataset(count: usize) -> MotionDataset {
    MotionDataset::new(7, motions(&tree(), count)).unwrap()
}

fn candidates(count: usize) -> MotionCandidates {
    candidates_of(&dataset(count))
}

fn candidates_of(dataset: &MotionDataset) -> MotionCandidates {
    let robot = Robot::with_viscous_friction(tree(), [0.0; 10], Catalogue::default()).unwrap();
    MotionCandidates::new(&robot, robot.declared(), dataset, &[1.0; 7]).unwrap()
}

fn random() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(3)
}

/// The allowed motions by cond of the stack, each merged and decomposed in full.
fn ranked(candidates: &MotionCandidates, allowed: &[usize], measured: Option<&Triangle>) -> Vec<usize> {
    let cond = |motion: usize| {
        let mut rows = Vec::new();
        let parts = [Some(&candidates.all()[motion].triangle), measured];
        for triangle in parts.into_iter().flatten() {
            for row in 0..triangle.size() {
                rows.extend(
                    (0..triangle.size())
                        .map(|column| triangle.column(column).get(row).copied().unwrap_or(0.0)),
                );
                rows.push(0.0);
            }
        }
        let size = candidates.all()[motion].triangle.size();
        phiw_regressor::factor::Factor::of_rows(size + 1, &rows).unwrap().condition_number().unwrap()
    };
    let mut order: Vec<(f64, usize)> = allowed.iter().map(|&motion| (cond(motion), motion)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|(_, motion)| motion).collect()
}

#[test]
fn pruning_loses_neither_the_best_nor_the_next() {
    let (dataset, candidates) = (dataset(12), candidates(12));
    let all: Vec<usize> = (0..12).collect();
    for allowed in [&all[..], &all[3..9], &all[5..6]] {
        let mut measured: Option<Triangle> = None;
        for _ in 0..5 {
            let question = Question {
                dataset: &dataset,
                candidates: &candidates,
                allowed,
                measured: measured.as_ref(),
                history: &[],
            };
            let choice = SmallestCondition.choose(&question, &mut random());
            let order = ranked(&candidates, allowed, measured.as_ref());
            assert_eq!(choice.motion, order[0]);
            assert_eq!(choice.runner_up.map(|next| next.0), order.get(1).copied());
            measured = Some(question.stack(choice.motion));
        }
    }
}

#[test]
fn optimal_designs_are_best_by_their_own_measure() {
    let (dataset, candidates) = (dataset(8), candidates(8));
    let allowed: Vec<usize> = (1..8).collect();
    let measured = candidates.all()[0].triangle.clone();
    let question = Question {
        dataset: &dataset,
        candidates: &candidates,
        allowed: &allowed,
        measured: Some(&measured),
        history: &[],
    };
    let best = DOptimal.choose(&question, &mut random());
    let determinant = |motion: usize| question.stack(motion).log_determinant();
    assert!(allowed.iter().all(|&motion| determinant(motion) <= determinant(best.motion)));
    let best = AOptimal.choose(&question, &mut random());
    let trace = |motion: usize| question.stack(motion).inverse_trace();
    assert!(allowed.iter().all(|&motion| trace(motion) >= trace(best.motion)));
    let best = TorqueOptimal.choose(&question, &mut random());
    let variance = |motion: usize| question.stack(motion).variance_along(candidates.everything());
    assert!(allowed.iter().all(|&motion| variance(motion) >= variance(best.motion)));
}

/// The variance falls most for each second of motion, and not most for each motion; the first motion is the
/// one that would leave least if all took the same time.
#[test]
fn a_second_of_motion_is_what_is_paid() {
    let dataset = dataset(6).with_slower(&[3.0]).unwrap();
    let candidates = candidates_of(&dataset);
    let allowed: Vec<usize> = (0..dataset.len()).collect();
    let duration_s = |motion: usize| dataset.motions()[motion].duration_s();
    for measured in [None, Some(candidates.all()[0].triangle.clone())] {
        let question = Question {
            dataset: &dataset,
            candidates: &candidates,
            allowed: &allowed,
            measured: measured.as_ref(),
            history: &[],
        };
        let variance = |motion: usize| question.stack(motion).variance_along(candidates.everything());
        let worth = |motion: usize| match &measured {
            None => 1.0 / (variance(motion) * duration_s(motion)),
            Some(measured) => {
                (measured.variance_along(candidates.everything()) / variance(motion)).ln()
                    / duration_s(motion)
            }
        };
        let best = TorqueOptimalPerSecond.choose(&question, &mut random()).motion;
        assert!(allowed.iter().all(|&motion| worth(motion) <= worth(best)));
        assert!(worth(best) > 0.0);
        let most = TorqueOptimal.choose(&question, &mut random()).motion;
        assert!(duration_s(best) <= duration_s(most));
    }
}

/// cond of a motion done twice is that of one; the torques are known better after the second.
#[test]
fn doing_a_motion_again_is_worth_something_to_the_torques_alone() {
    let candidates = candidates(4);
    let once = candidates.all()[2].triangle.clone();
    let mut twice = once.clone();
    twice.absorb(&mut once.clone());
    assert!((twice.condition_number() / once.condition_number() - 1.0).abs() < 1e-6);
    let [first, second] = [&once, &twice].map(|stack| stack.variance_along(candidates.everything()));
    assert!((second / first - 0.5).abs() < 1e-6);
}

#[test]
fn random_choice_takes_all_that_is_allowed_and_nothing_else() {
    let (dataset, candidates) = (dataset(6), candidates(6));
    let question = Question {
        dataset: &dataset,
        candidates: &candidates,
        allowed: &[1, 4, 5],
        measured: None,
        history: &[],
    };
    let mut rng = random();
    let mut seen = [0; 6];
    (0..300).for_each(|_| seen[RandomMotion.choose(&question, &mut rng).motion] += 1);
    assert_eq!([seen[0], seen[2], seen[3]], [0; 3]);
    assert!([1, 4, 5].iter().all(|&motion| seen[motion] > 60), "{seen:?}");
}
