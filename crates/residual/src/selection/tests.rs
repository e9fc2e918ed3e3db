//! Tables of small cases.

use super::{
    Fit, Hypothesis, Member, Multiple, Policy, Problem, Products, Torque, Variant, certainty,
    choose_variants, criterion::criterion, multiples, select,
};
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_regressor::factor::Factor;

const POLICY: Policy = Policy { finalists: 12, keep_tail: 0.01, most_members: 40, grows: true };

/// Torques of 400 rows in 10 folds. Columns of each: one of the model, then `kinds` candidates of one column
/// each; all smooth random motion. `truth` names (torque, kind, value).
fn problem(
    random: &mut RandomNumbers,
    torques: usize,
    kinds: usize,
    truth: &[(usize, usize, f64)],
    colour: f64,
) -> Problem {
    problem_with(random, torques, kinds, truth, colour, |_| {})
}

/// The same where `change` may change the candidates' columns of each row.
fn problem_with(
    random: &mut RandomNumbers,
    torques: usize,
    kinds: usize,
    truth: &[(usize, usize, f64)],
    colour: f64,
    change: impl Fn(&mut [f64]),
) -> Problem {
    let per_torque = 1 + kinds;
    let noise = |random: &mut RandomNumbers| (0..4).map(|_| random.uniform(-1.0, 1.0)).sum::<f64>() * 0.866;
    let of_torque = |torque: usize| {
        let mut state = vec![0.0; per_torque];
        let mut error = 0.0;
        let mut folds = Vec::new();
        for _ in 0..10 {
            let mut rows = Vec::new();
            for _ in 0..40 {
                for value in &mut state {
                    *value = 0.8 * *value + 0.6 * noise(random);
                }
                error = colour * error + (1.0 - colour * colour).sqrt() * noise(random);
                let known: f64 = truth
                    .iter()
                    .filter(|(of, _, _)| *of == torque)
                    .map(|(_, kind, value)| value * state[1 + kind])
                    .sum();
                let mut columns = state.clone();
                change(&mut columns[1..]);
                rows.extend_from_slice(&columns);
                rows.push(3.0 * state[0] + known + error);
            }
            folds.push(Products::of_factor(&Factor::of_rows(per_torque + 1, &rows).unwrap()));
        }
        Torque::new((torque * per_torque..(torque + 1) * per_torque).collect(), folds, 1e-3)
    };
    let all: Vec<Torque> = (0..torques).map(of_torque).collect();
    let mut hypotheses = Vec::new();
    for kind in 0..kinds {
        for torque in 0..torques {
            let parameters = vec![torque * per_torque + 1 + kind];
            let variant =
                Variant { parameters, bounds: vec![(f64::NEG_INFINITY, f64::INFINITY)], constants: 0 };
            hypotheses.push(Hypothesis {
                kind,
                textbook: false,
                familiar: true,
                torques: vec![torque],
                variants: vec![variant],
                requires: Vec::new(),
                linearised: false,
                made_of_model: false,
                declared: false,
            });
        }
    }
    Problem {
        parameters: torques * per_torque,
        model: (0..torques).map(|torque| torque * per_torque).collect(),
        absent: vec![0.0; torques * per_torque],
        torques: all,
        hypotheses,
        prior: None,
        rows_per_independent: 1.0,
    }
}

fn chosen(problem: &Problem, start: Vec<Member>) -> Vec<(usize, usize)> {
    let outcome = select(problem, start, POLICY);
    let mut found: Vec<(usize, usize)> = outcome
        .members
        .iter()
        .map(|member| &problem.hypotheses[member.hypothesis])
        .map(|hypothesis| (hypothesis.torques[0], hypothesis.kind))
        .collect();
    found.sort_unstable();
    found
}

#[test]
fn what_is_there_is_found_and_nothing_else_from_any_start() {
    let table: [&[(usize, usize, f64)]; 5] = [
        &[],
        &[(0, 2, 0.8)],
        &[(0, 2, 0.8), (1, 2, 1.0), (2, 2, 0.7), (3, 2, 0.9)],
        &[(0, 0, 2.0), (0, 1, -2.0), (0, 3, 1.0), (2, 5, 0.8)],
        &[
            (0, 0, 1.0),
            (1, 0, 1.0),
            (2, 0, 1.0),
            (3, 0, 1.0),
            (0, 1, 1.0),
            (1, 1, 1.0),
            (2, 1, 1.0),
            (3, 1, 1.0),
        ],
    ];
    for (case, truth) in table.iter().enumerate() {
        let mut random = RandomNumbers::new(case as u64 + 1);
        let problem = problem(&mut random, 4, 8, truth, 0.0);
        let mut expected: Vec<(usize, usize)> =
            truth.iter().map(|&(torque, kind, _)| (torque, kind)).collect();
        expected.sort_unstable();
        for start in [vec![], vec![0, 9], vec![3, 17, 20, 30]] {
            let start = start.into_iter().map(|hypothesis| Member { hypothesis, variant: 0 }).collect();
            assert_eq!(chosen(&problem, start), expected, "case {case}");
        }
    }
}

/// What one stretch of motion says and no other foretells nothing of that stretch. Six such effects gain more
/// than the one that is there, which was not found for them.
#[test]
fn what_foretells_nothing_does_not_bar_what_does() {
    const TORQUES: usize = 7;
    const ROWS: usize = 400;
    let truth: Vec<(usize, usize, f64)> =
        (0..TORQUES).map(|torque| (torque, 0, if torque == 0 { 0.4 } else { 5.0 })).collect();
    for seed in 0..10 {
        let row = std::cell::Cell::new(0);
        let once = |columns: &mut [f64]| {
            let (torque, own) = (row.get() / ROWS, row.get() % ROWS);
            row.set(row.get() + 1);
            if torque > 0 && own >= ROWS / 5 {
                columns[0] *= 0.02;
            }
        };
        let problem = problem_with(&mut RandomNumbers::new(seed), TORQUES, 6, &truth, 0.0, once);
        assert_eq!(chosen(&problem, Vec::new()), [(0, 0)], "seed {seed}");
    }
}

/// The end of an arc that one stretch reaches had a torque of 13 N·m there by what noise made of it
/// elsewhere: a map that left noise only foretold less than none, and gave way to nothing.
#[test]
fn what_one_stretch_alone_tells_is_next_to_nothing_where_the_others_foretell_it() {
    let row = std::cell::Cell::new(0_usize);
    let change = |columns: &mut [f64]| {
        let in_fourth = row.replace(row.get() + 1) / 40 == 3;
        columns[0] *= if in_fourth { 1.0 } else { 1e-5 };
    };
    let problem = problem_with(&mut RandomNumbers::new(3), 1, 2, &[(0, 1, 0.8)], 0.0, change);
    let members: Vec<Member> = [0, 1].map(|hypothesis| Member { hypothesis, variant: 0 }).to_vec();
    let whole = Fit::new(&problem, problem.active(&members), &[400.0], None);
    let others = whole.without(&problem, &[3]);
    assert!(others.values[1].abs() < 0.3, "{:?}", others.values);
    for place in [0, 2] {
        assert!((others.values[place] - whole.values[place]).abs() < 0.1, "{:?}", others.values);
    }
}

/// A variant of more parameters explains one stretch by what it foretells wrongly elsewhere: knots of a map
/// that one stretch alone reaches. It took the place of the variant that foretells, and left the model with
/// all that the map explained.
#[test]
fn a_variant_of_more_parameters_foretells_more_or_is_not_taken() {
    const ROWS: usize = 400;
    for seed in 0..10 {
        let row = std::cell::Cell::new(0);
        let once = |columns: &mut [f64]| {
            if row.replace(row.get() + 1) >= ROWS / 5 {
                columns[1] *= 0.02;
            }
        };
        let truth = [(0, 0, 2.0), (0, 1, 3.0)];
        let mut problem = problem_with(&mut RandomNumbers::new(seed), 1, 2, &truth, 0.0, once);
        let more = problem.hypotheses.remove(1).variants.remove(0);
        let own = problem.hypotheses[0].variants[0].clone();
        problem.hypotheses[0].variants.push(Variant {
            parameters: [own.parameters, more.parameters].concat(),
            bounds: [own.bounds, more.bounds].concat(),
            constants: 0,
        });
        let few = Member { hypothesis: 0, variant: 0 };
        let many = Member { variant: 1, ..few };
        let rows = [ROWS as f64];
        let value = |member: Member| {
            let fit = Fit::new(&problem, problem.active(&[member]), &rows, None);
            criterion(&problem, &[member], &fit, &rows)
        };
        assert!(value(many) < value(few), "seed {seed}: no gain");
        assert_eq!(choose_variants(&problem, vec![few], POLICY).members, [few], "seed {seed}");
    }
}

#[test]
fn nothing_is_named_in_noise_of_any_colour() {
    for colour in [0.0, 0.5, 0.8, 0.9] {
        let mut named = 0;
        for seed in 0..50 {
            let mut random = RandomNumbers::new(1000 + seed);
            let problem = problem(&mut random, 3, 8, &[], colour);
            let outcome = select(&problem, Vec::new(), POLICY);
            let limit = 0.01 / problem.hypotheses.len() as f64;
            let certain = |member: &&Member| certainty(&problem, &outcome.fit, **member).tail < limit;
            named += outcome.members.iter().filter(certain).count();
        }
        assert!(named <= 2, "{named} names in noise of correlation {colour}");
    }
}

/// What is declared joins an end that was reached without it: what it does the work of leaves, and nothing
/// that it opened the way for enters.
#[test]
fn a_search_that_does_not_grow_only_leaves_out() {
    let mut random = RandomNumbers::new(12);
    let problem = problem(&mut random, 2, 6, &[(0, 2, 0.8), (1, 3, 0.8)], 0.0);
    let member = |hypothesis: usize| Member { hypothesis, variant: 0 };
    let policy = Policy { grows: false, ..POLICY };
    // Hypotheses are numbered kind by kind, torque by torque.
    let outcome = select(&problem, vec![member(0), member(4), member(9)], policy);
    assert_eq!(outcome.members, [member(4)]);
}

/// A residual of a thousandth of the torque once drew in a dozen effects that polished the form of a sign.
#[test]
fn nothing_is_sought_in_a_residual_that_is_as_good_as_none() {
    let mut random = RandomNumbers::new(5);
    let mut problem = problem(&mut random, 2, 6, &[(0, 2, 0.8)], 0.0);
    problem.torques.iter_mut().for_each(|torque| torque.least = 4.0);
    assert_eq!(chosen(&problem, Vec::new()), []);
}

/// Stribeck friction stood in a model without the Coulomb friction on top of which it acts.
#[test]
fn a_form_comes_with_what_it_is_a_form_of() {
    let mut random = RandomNumbers::new(6);
    let mut problem = problem(&mut random, 2, 6, &[(0, 4, 1.0)], 0.0);
    // Hypotheses are numbered kind by kind, torque by torque: kind 4 is a form of kind 1.
    problem.hypotheses[8].requires = vec![2];
    assert_eq!(chosen(&problem, Vec::new()), [(0, 1), (0, 4)]);
}

/// A torque of little noise was fitted worse, up to the share that is as good as none, for the sake of
/// another joint: the error of all joints together then spoke against the true effect.
#[test]
fn a_residual_below_what_is_as_good_as_none_still_counts() {
    let mut random = RandomNumbers::new(7);
    let mut problem = problem(&mut random, 1, 1, &[], 0.0);
    let torque = &mut problem.torques[0];
    torque.least = 1.0;
    let rows = torque.whole.rows();
    assert!(torque.variance(0.5 * rows) > 1.2 * torque.variance(0.2 * rows));
}

/// A force on the first link has three parameters, of which the logs tell two at most, and makes the torque
/// of a balancer of the first joint, which has two: it was named for it. So it was where the search had come
/// to the force first, beside something else that was still missing.
#[test]
fn of_two_that_do_the_same_the_one_with_fewer_parameters_is_chosen() {
    for (seed, larger) in (0..20).flat_map(|seed| [(seed, 0), (seed, 1)]) {
        let mut random = RandomNumbers::new(seed);
        let turned = |columns: &mut [f64]| {
            let (sine, cosine) = (seed as f64).sin_cos();
            columns[2] = cosine * columns[0] - sine * columns[1];
            columns[3] = sine * columns[0] + cosine * columns[1];
            columns[4] = 0.0;
        };
        let mut problem = problem_with(&mut random, 1, 5, &[(0, 0, 1.0), (0, 1, 0.7)], 0.0, turned);
        problem.hypotheses.truncate(2);
        for (kind, hypothesis) in problem.hypotheses.iter_mut().enumerate() {
            let variant = &mut hypothesis.variants[0];
            variant.parameters = if kind == larger { vec![3, 4, 5] } else { vec![1, 2] };
            variant.bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); variant.parameters.len()];
        }
        for start in [vec![], vec![Member { hypothesis: larger, variant: 0 }]] {
            assert_eq!(chosen(&problem, start), [(0, 1 - larger)], "{seed}");
        }
    }
}

/// A Coulomb friction that turned over the wrong speed had a friction of the load beside it, whose own speed
/// was right, and was named: neither could leave alone, and other constants of the one were no gain beside
/// the other.
#[test]
fn one_with_other_constants_takes_the_place_of_two() {
    for seed in 0..20 {
        let both = |columns: &mut [f64]| columns[2] = columns[0] + 0.5 * columns[1];
        let mut problem = problem_with(&mut RandomNumbers::new(seed), 1, 3, &[(0, 0, 2.0)], 0.0, both);
        let right = problem.hypotheses.remove(0).variants.remove(0);
        problem.hypotheses[0].textbook = true;
        problem.hypotheses[0].variants.push(right);
        let [wrong, beside] = [0, 1].map(|hypothesis| Member { hypothesis, variant: 0 });
        let outcome = select(&problem, vec![wrong, beside], POLICY);
        assert_eq!(outcome.members, [Member { variant: 1, ..wrong }], "seed {seed}");
    }
}

/// An offset and a ripple stood for an end stop: taking either away leads nowhere, only both at once.
#[test]
fn one_that_does_the_work_of_two_takes_their_place() {
    let mut random = RandomNumbers::new(8);
    let sum = |columns: &mut [f64]| columns[2] = columns[0] + columns[1];
    let problem = problem_with(&mut random, 2, 6, &[(0, 0, 1.0), (0, 1, 1.0)], 0.0, sum);
    // Hypotheses are numbered kind by kind, torque by torque.
    let two = [0, 2].map(|hypothesis| Member { hypothesis, variant: 0 });
    assert_eq!(chosen(&problem, two.to_vec()), [(0, 2)]);
}

/// Torques that share a parameter, and gains of each: the gain of one is the opposite gain of all others, and
/// these stood in its place wherever the search had come to them first.
#[test]
fn a_gain_of_one_torque_is_not_named_as_the_opposite_gain_of_all_others() {
    let mut random = RandomNumbers::new(9);
    let truth = [(0, 0, 0.0), (1, 0, 0.3), (2, 0, 0.0)];
    // The only candidate of each torque is the column of the model once more.
    let mut problem = problem(&mut random, 3, 1, &[], 0.0);
    for (torque, _, gain) in truth {
        let mut folds = Vec::new();
        for _ in 0..10 {
            let mut rows = Vec::new();
            for _ in 0..40 {
                let column = random.uniform(-1.0, 1.0);
                let error = 0.05 * random.uniform(-1.0, 1.0);
                rows.extend([column, column, (3.0 + gain) * column + error]);
            }
            folds.push(Products::of_factor(&Factor::of_rows(3, &rows).unwrap()));
        }
        // One parameter for all, and the candidate's own.
        problem.torques[torque] = Torque::new(vec![0, 1 + torque], folds, 1e-3);
        problem.hypotheses[torque].variants[0].parameters = vec![1 + torque];
        problem.hypotheses[torque].made_of_model = true;
    }
    problem.parameters = 4;
    problem.model = vec![0];
    problem.absent = vec![0.0; 4];
    for start in [vec![], vec![0, 2], vec![0], vec![1]] {
        let start = start.into_iter().map(|hypothesis| Member { hypothesis, variant: 0 }).collect();
        assert_eq!(chosen(&problem, start), [(1, 0)]);
    }
}

/// Torques of 400 rows in 10 folds, of the same three parameters but for one of each by itself; a torque is
/// logged as its factor times what it is, with noise of its own size: `torques` has (factor, noise).
fn of_the_same_bodies(seed: u64, torques: &[(f64, f64)]) -> Problem {
    let mut random = RandomNumbers::new(seed);
    let mut noise = || (0..4).map(|_| random.uniform(-1.0, 1.0)).sum::<f64>() * 0.866;
    let mut of_torque = |(torque, &(factor, size)): (usize, &(f64, f64))| {
        let fold = |_| {
            let mut rows = Vec::new();
            for _ in 0..40 {
                let columns = [noise(), noise(), noise(), noise()];
                let known = 2.0 * columns[0] - 1.5 * columns[1] + columns[2] + 0.7 * columns[3];
                rows.extend(columns);
                rows.push(factor * known + size * noise());
            }
            Products::of_factor(&Factor::of_rows(5, &rows).unwrap())
        };
        Torque::new(vec![0, 1, 2, 3 + torque], (0..10).map(fold).collect(), 1e-6)
    };
    let parameters = 3 + torques.len();
    Problem {
        parameters,
        model: (0..parameters).collect(),
        absent: vec![0.0; parameters],
        torques: torques.iter().enumerate().map(&mut of_torque).collect(),
        hypotheses: Vec::new(),
        prior: None,
        rows_per_independent: 1.0,
    }
}

#[test]
fn torques_that_are_multiples_of_what_they_are_are_found_and_no_others() {
    type Case = ([f64; 4], &'static [(usize, f64)]);
    let table: [Case; 6] = [
        ([1.0, 1.0, 1.0, 1.0], &[]),
        // Within one step of nothing: told to first order, like any effect.
        ([1.0, 1.2, 1.0, 1.0], &[]),
        ([1.0, 2.0, 1.0, 1.0], &[(1, 2.0)]),
        ([1.0, 1.0, 1.0, 0.35], &[(3, 0.35)]),
        ([1.0, 1.5, 0.5, 1.0], &[(1, 1.5), (2, 0.5)]),
        // Beyond what is looked at: another unit.
        ([40.0, 1.0, 1.0, 1.0], &[]),
    ];
    for (seed, (factors, expected)) in table.into_iter().enumerate() {
        let problem = of_the_same_bodies(seed as u64 + 1, &factors.map(|factor| (factor, 0.1)));
        let mut found = multiples(problem, &[], &[400.0; 4], 0.1, vec![0, 1, 2, 3]);
        found.sort_by_key(|multiple| multiple.torque);
        assert_eq!(found.len(), expected.len(), "{factors:?}: {found:?}");
        for (Multiple { torque, factor }, &(of, true_factor)) in found.iter().zip(expected) {
            assert_eq!(*torque, of, "{factors:?}");
            assert!((factor / true_factor - 1.0).abs() < 0.03, "{factors:?}: {factor}");
        }
    }
}

#[test]
fn a_torque_that_is_not_open_is_given_no_factor() {
    let problem = of_the_same_bodies(3, &[(1.0, 0.1), (2.0, 0.1), (1.0, 0.1), (1.0, 0.1)]);
    let found = multiples(problem, &[], &[400.0; 4], 0.1, vec![0]);
    assert!(found.iter().all(|multiple| multiple.torque == 0), "{found:?}");
}

/// Of two torques a factor on the one is one over it on the other. On a torque that is told a hundred times
/// better than the other the factor is not told, since nearly all of its column is in the model's: the search
/// left it out again, and a loss by the direction of power stood for it.
#[test]
fn of_two_torques_the_one_that_is_told_worse_has_the_factor() {
    for (seed, torques, expected) in [
        (1, [(1.0, 1.0), (2.8, 0.01)], (0, 1.0 / 2.8)),
        (2, [(1.0, 0.01), (2.8, 1.0)], (1, 2.8)),
        (3, [(0.4, 1.0), (1.0, 0.01)], (0, 0.4)),
    ] {
        let found = multiples(of_the_same_bodies(seed, &torques), &[], &[400.0; 2], 0.1, vec![0, 1]);
        let [Multiple { torque, factor }] = found[..] else { panic!("{torques:?}: {found:?}") };
        assert_eq!(torque, expected.0, "{torques:?}");
        // Three standard deviations of what the noise makes of it.
        assert!((factor / expected.1 - 1.0).abs() < 0.15, "{torques:?}: {factor}");
    }
}
