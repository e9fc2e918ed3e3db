//! `model.json`: what is written is what is read.

use crate::synthetic;

use faer::Mat;
use faer::linalg::solvers::DenseSolveCore;
use phiw_dynamics::Tree;
use phiw_identification::{IdentificationError, Identified, Model, identify};
use phiw_regressor::factor::Factor;

fn identified(tree: &Tree) -> Identified {
    let blocks = synthetic::blocks(&synthetic::recording(tree, 3, 30.0, 2.0, 0.3, 3), 1000);
    let effects = (0..tree.joint_count()).map(|joint| vec![synthetic::Viscous::on(tree, joint)]).collect();
    identify(tree, effects, &synthetic::data(&blocks, synthetic::folds(30.0, 8), Vec::new())).unwrap()
}

fn model(identified: &Identified) -> Model {
    let declared = ["viscous".to_owned()];
    Model::of_fit(&identified.design, &identified.fit, &declared, &[("finger".to_owned(), 0.1)], (20.0, 10.0))
        .unwrap()
}

#[test]
fn a_model_survives_its_file_to_the_last_bit() {
    let tree = synthetic::robot(4, 5);
    let identified = identified(&tree);
    let model = model(&identified);
    let read: Model = serde_json::from_str(&serde_json::to_string_pretty(&model).unwrap()).unwrap();
    assert_eq!(read, model);
    let (design, parameters) = read.design(&tree, &synthetic::OneKind).unwrap();
    assert_eq!(parameters, identified.fit.parameters);
    let kinds = |design: &phiw_identification::Design| {
        design.effects().iter().map(|effect| effect.spec()).collect::<Vec<_>>()
    };
    assert_eq!(kinds(&design), kinds(&identified.design));
    let (factor, fitted) = (read.factor.factor().unwrap(), &identified.fit.factor);
    assert_eq!(factor.rows(), fitted.rows());
    let again = factor.solve().unwrap().parameters;
    for (again, parameter) in again.iter().zip(&parameters) {
        assert!((again - parameter).abs() < 1e-9 * (1.0 + parameter.abs()));
    }
}

/// The variances of the factor and of the folds that were left out add, and the parameters stay what they
/// were.
#[test]
fn a_model_knows_no_more_than_its_covariance_says() {
    let tree = synthetic::robot(4, 5);
    let model = model(&identified(&tree));
    let factor = model.factor.factor().unwrap();
    let size = factor.parameters();
    let information = |factor: &Factor| -> Mat<f64> {
        let triangle = factor.triangle();
        let mut entries = triangle.iter();
        let mut r = Mat::<f64>::zeros(size + 1, size + 1);
        for row in 0..=size {
            (row..=size).for_each(|column| r[(row, column)] = *entries.next().unwrap());
        }
        let r = r.submatrix(0, 0, size, size).to_owned();
        r.transpose() * &r
    };
    let covariance = model.covariance.as_ref().unwrap();
    let deviations = covariance.deviations(model.factor.parameters.len()).unwrap();
    let spread = Mat::from_fn(size, size, |row, column| {
        let of = |deviation: &Vec<f64>| {
            deviation[model.factor.parameters[row]] * deviation[model.factor.parameters[column]]
        };
        deviations.iter().map(of).sum::<f64>()
    });
    let alone = information(&factor).partial_piv_lu().inverse();
    let knowledge = model.knowledge().unwrap();
    let product = information(&knowledge) * (&alone + &spread);
    for (row, column) in (0..size).flat_map(|row| (0..size).map(move |column| (row, column))) {
        let expected = f64::from(u8::from(row == column));
        let scale = ((alone[(column, column)] + spread[(column, column)])
            / (alone[(row, row)] + spread[(row, row)]))
            .sqrt();
        assert!((product[(row, column)] - expected).abs() < 1e-6 * scale.max(1.0), "{row} {column}");
    }
    let [before, after] = [&factor, &knowledge].map(|factor| factor.solve().unwrap().parameters);
    for (before, after) in before.iter().zip(&after) {
        assert!((before - after).abs() < 1e-8 * (1.0 + before.abs()), "{before} {after}");
    }
}

/// Also where the URDF has no inertials to be near to.
#[test]
fn standard_parameters_have_the_base_parameters_that_were_found() {
    let tree = synthetic::robot(4, 5);
    let identified = identified(&tree);
    let mut empty = tree.clone();
    empty.set_inertial_parameters(&vec![0.0; tree.inertial_parameters().len()]).unwrap();
    for tree in [tree, empty] {
        let model =
            Model::of_fit(&synthetic::design(&tree), &identified.fit, &[], &[], (20.0, 10.0)).unwrap();
        let lifted = model.identified_tree(&tree).unwrap();
        assert!(
            lifted.bodies().iter().all(|body| body.inertial[0] != 0.0),
            "URDF cannot express a body without mass"
        );
        let found = identified.design.base().from_standard(&lifted.inertial_parameters()).unwrap();
        for (found, fitted) in found.iter().zip(&identified.fit.parameters) {
            assert!((found - fitted).abs() < 1e-8 * (1.0 + fitted.abs()), "{found} {fitted}");
        }
    }
}

#[test]
fn a_model_of_another_robot_is_refused() {
    let tree = synthetic::robot(4, 5);
    let model = model(&identified(&tree));
    let refused = |model: &Model, tree: &Tree| match model.design(tree, &synthetic::OneKind) {
        Err(IdentificationError::Model(message)) => message,
        other => panic!("{:?}", other.map(|_| ())),
    };
    assert!(refused(&model, &synthetic::robot(4, 6)).contains("--hold"));
    let mut other = model.clone();
    other.base_parameters.pop();
    assert!(refused(&other, &tree).contains("the kinematics differ"));
    // As many, but not the same: each number went to another parameter.
    let mut swapped = model.clone();
    swapped.base_parameters.swap(0, 1);
    assert!(refused(&swapped, &tree).contains("base parameter 1 is"));
    assert!(refused(&Model { schema: 99, ..model.clone() }, &tree).contains("schema 99"));
    let mut cut = model.clone();
    cut.effects[0].parameters.clear();
    assert!(refused(&cut, &tree).contains("has not the parameters"));
    cut = model;
    cut.factor.entries.pop();
    assert!(cut.factor.factor().is_err());
}

/// Each of these ended in a panic, in inner words, or in a model.
#[test]
fn numbers_that_no_model_has_are_refused() {
    let tree = synthetic::robot(4, 5);
    let good = model(&identified(&tree));
    assert!(good.check().is_ok());
    type Spoil = fn(&mut Model);
    let cases: [(Spoil, &str); 9] = [
        (|model| model.schema = 7, "schema 7"),
        (|model| model.base_parameters[1].value = 1e160, "which is no parameter"),
        (|model| model.bodies[0].inertial[3] = f64::NAN, "no inertial parameter"),
        (|model| model.residual_std[0] = 0.0, "no standard deviation"),
        (|model| model.residual_std[0] = -1.0, "no standard deviation"),
        (|model| model.residual_std.truncate(3), "residual_std has 3 numbers for 5 joints"),
        (|model| model.factor.parameters[0] = 10_000, "not among its"),
        (|model| model.factor.entries.truncate(5), "no triangle"),
        (|model| model.factor.entries[0] = f64::INFINITY, "no triangle"),
    ];
    for (spoil, expected) in cases {
        let mut model = good.clone();
        spoil(&mut model);
        let message = model.check().unwrap_err().to_string();
        assert!(message.contains(expected), "no `{expected}` in: {message}");
        assert!(model.design(&tree, &synthetic::OneKind).is_err());
    }
}
