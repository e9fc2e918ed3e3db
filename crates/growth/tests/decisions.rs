//! The decisions of a score test as tables of cases.

use phiw_effects::Catalogue;
use phiw_growth::{Contender, ScoreTestSettings, Winner};

#[test]
fn as_many_effects_are_fitted_as_are_near_the_best() {
    let settings = ScoreTestSettings { least_merit: 5.0, near: 0.6, most_near: 3, ..Default::default() };
    let cases: &[(&[f64], usize)] = &[
        (&[], 0),
        (&[4.9], 0),
        (&[5.0], 1),
        (&[10.0, 6.0, 5.9], 2),
        (&[10.0, 9.0, 8.0, 7.0], 3),
        // One that is not worth its price alone is fitted all the same: its score is rough.
        (&[6.0, 4.0], 2),
        (&[f64::NAN], 0),
    ];
    for (merits, expected) in cases {
        assert_eq!(settings.shortlist(merits), *expected, "{merits:?}");
    }
}

#[test]
fn the_simplest_of_those_that_explain_alike_is_believed() {
    let settings = ScoreTestSettings { least_merit: 5.0, alike: 3.0, least_rival: 0.1, ..Default::default() };
    // Merits, sizes and places in the catalogue, who is believed, and who is nearly as likely.
    type Case<'a> = (&'a [(f64, usize, usize)], Option<(usize, &'a [usize])>);
    let cases: &[Case<'_>] = &[
        (&[], None),
        (&[(4.9, 1, 0)], None),
        (&[(f64::NAN, 1, 0)], None),
        (&[(f64::NEG_INFINITY, 1, 0), (9.0, 4, 1)], Some((1, &[]))),
        (&[(9.0, 1, 0)], Some((0, &[]))),
        (&[(9.0, 1, 0), (20.0, 3, 1)], Some((1, &[]))),
        // Three less, and simpler.
        (&[(17.0, 1, 1), (20.0, 3, 0)], Some((0, &[1]))),
        (&[(16.9, 1, 1), (20.0, 3, 0)], Some((1, &[]))),
        // As simple: the one that the catalogue has first; ln 10 = 2.3 less is a chance of one in ten.
        (&[(18.0, 2, 9), (20.0, 2, 10)], Some((0, &[1]))),
        (&[(18.0, 2, 10), (20.0, 2, 9)], Some((1, &[0]))),
        (&[(16.9, 2, 9), (20.0, 2, 10)], Some((1, &[]))),
        (&[(19.0, 2, 4), (20.0, 3, 3), (19.5, 2, 2)], Some((2, &[1, 0]))),
        // What is not worth its price is neither believed nor a rival.
        (&[(4.0, 1, 0), (6.0, 2, 1)], Some((1, &[]))),
    ];
    for (contenders, expected) in cases {
        let list: Vec<Contender> =
            contenders.iter().map(|&(merit, size, rank)| Contender { merit, size, rank }).collect();
        let expected = expected.map(|(winner, rivals)| Winner { winner, rivals: rivals.to_vec() });
        assert_eq!(settings.contest(&list), expected, "{contenders:?}");
    }
}

/// On the arc of a wrist both save 992 of −log L; the balancer was believed for a third of a unit.
#[test]
fn of_a_spring_and_a_balancer_that_explain_alike_the_spring_is_believed() {
    let catalogue = Catalogue::default();
    let of_kind = |kind, merit| Contender { merit, size: 2, rank: catalogue.rank(kind).unwrap() };
    let contenders = [of_kind("gravity_balancer", 984.3), of_kind("joint_spring", 984.0)];
    let expected = Winner { winner: 1, rivals: vec![0] };
    assert_eq!(ScoreTestSettings::default().contest(&contenders), Some(expected));
}

/// Frictions of all joints saved 10 000 of −log L, within a tenth of their torque; two more frictions of the
/// waist that saved 23 of what was left were believed.
#[test]
fn what_large_effects_leave_is_no_effect() {
    let settings = ScoreTestSettings { least_merit: 5.0, form_error: 0.1, ..Default::default() };
    let cases = [(0.0, 5.0), (400.0, 5.0), (10_000.0, 100.0), (f64::NAN, 5.0)];
    for (saved, expected) in cases {
        let beside = settings.beside(saved).least_merit;
        assert!((beside - expected).abs() < 1e-9, "{saved}: {beside}, not {expected}");
    }
}
