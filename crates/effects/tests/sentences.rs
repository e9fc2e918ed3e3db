//! What the catalogue says of each kind, in words.

use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::{Catalogue, Constants, EffectKind, JointRange, SignalRanges};
use phiw_identification::EffectSpec;
use phiw_identification::effect::EffectParameter;

const ARM: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/><axis xyz="1 0 0"/></joint>
</robot>"#;

/// Kinds with what they say.
const SENTENCES: &[(&str, &str)] = &[
    ("viscous_friction", "shoulder has viscous friction of 0.500 N·m·s/rad."),
    ("coulomb_friction", "shoulder has Coulomb friction of 0.500 N·m."),
    ("torque_offset", "The torque of shoulder is off by a constant 0.500 N·m."),
    ("rotor_inertia", "shoulder carries a rotor inertia of 0.500 kg·m² that the links do not account for."),
    ("torque_gain", "The torque of shoulder is measured 50.0 % too large."),
    (
        "asymmetric_friction",
        "shoulder rubs differently in its two directions: half the difference is 0.500 N·m·s/rad and 0.250 N·m.",
    ),
    ("quadratic_friction", "The friction of shoulder bends with the square of the speed: 0.500 N·m·s²/rad²."),
    (
        "stribeck_friction",
        "shoulder sticks at low speed: 0.500 N·m on top of Coulomb friction, gone above 0.050 rad/s (Stribeck).",
    ),
    (
        "load_dependent_friction",
        "The friction of shoulder grows with its load: 0.500 for each rad/s and 0.250 of the torque that it carries.",
    ),
    ("joint_spring", "A spring pulls shoulder back: 0.500 N·m/rad."),
    (
        "gravity_balancer",
        "shoulder is counterbalanced: up to 0.559 N·m as a sine of its angle, and 0.140 N·m as a sine \
         of twice it, as by a spring that has a length at rest.",
    ),
    ("torque_ripple", "The torque of shoulder ripples by 0.559 N·m, 12.0 times a turn."),
    ("end_stop", "shoulder runs into something stiff at -0.400: 0.500 N·m/rad."),
    (
        "transmission_coupling",
        "shoulder and elbow share a transmission: 0.500 N·m·s/rad of viscous friction of the first on \
         the second, 0.250 N·m of Coulomb friction of the first on the second.",
    ),
    ("time_delay", "The torque of shoulder is stamped 500.00 ms late."),
    ("encoder_offset", "The zero of shoulder's encoder is off by 0.500 rad."),
    (
        "actuator_saturation",
        "The drive of shoulder delivers no more than 8.730 N·m or N, whatever is commanded.",
    ),
    (
        "hysteresis",
        "The torque of shoulder depends on the way since the last reversal: 0.500 N·m over 0.0047 rad.",
    ),
    ("thermal_drift", "The friction of shoulder falls as it warms up, over 8 s from the start of each log."),
    ("joint_elasticity", "The transmission of shoulder gives: 5.000e-1 rad/(N·m)."),
    ("gravity_tilt", "The base is not level: gravity leans by 3.27 degrees."),
    ("payload", "The link behind shoulder carries 0.500 kg more than the model knows."),
    (
        "external_force",
        "Something pulls at the link behind shoulder (a hose, a cable): 0.500 N along x, 0.250 N along y, 0.125 N along z of the world.",
    ),
    (
        "drive_efficiency",
        "The transmission of shoulder has an efficiency of 0.67 where it drives its load and 0.75 where its load drives it.",
    ),
    (
        "position_map",
        "The torque of shoulder depends on its position in no simple form (a cable, a hose, cogging): \
         it varies by 0.159 N·m RMS from -1.000 to 1.000 rad.",
    ),
    (
        "position_dependent_friction",
        "The dry friction of shoulder depends on its position: 0.500 N·m more at 0.942 rad than where it is lowest, 5.00 times a turn.",
    ),
    ("torque_smoothing", "The torque of shoulder is low-passed before it is logged, at about 0.2 Hz."),
    ("torque_zero_by_log", "The zero of the torque of shoulder differs from log to log, by up to 1.00 N·m."),
    (
        "clock_drift",
        "The clock of the torques runs 500000 ppm fast: ten seconds into a log they are stamped 5000.00 ms late.",
    ),
];

/// The kind on its first site, with the last of its constants and parameters 0.5, 0.25, 0.125, …
fn said(tree: &Tree, kind: &dyn EffectKind) -> String {
    let joint = JointRange {
        position: (-1.0, 1.0),
        velocity_rms: 0.8,
        torque_rms: 2.0,
        torque_peak: 9.0,
        ..JointRange::default()
    };
    let ranges = SignalRanges {
        joints: vec![joint; 2],
        session: (0.0, 60.0),
        period: 0.01,
        ripple_frequencies: vec![vec![12.0]; 2],
        friction_frequencies: vec![vec![5.0]; 2],
        temperature: false,
        logs: 2,
        longest_log: 30.0,
    };
    let site = kind.sites(tree).remove(0);
    let constants = kind.scan(&site, &ranges).pop().unwrap();
    let effect = kind.build(tree, &site, &constants);
    let parameters = effect.parameters();
    let fitted: Vec<f64> = (1..=parameters.len()).map(|place| 0.5_f64.powi(place as i32)).collect();
    Catalogue::default().sentence(&effect.spec(), &parameters, &fitted)
}

#[test]
fn each_kind_says_its_sentence() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    for &(kind, words) in SENTENCES {
        assert_eq!(said(&tree, catalogue.kind(kind).unwrap()), words);
    }
}

/// It was "0.04 periods a radian" of a slide, which does not turn.
#[test]
fn the_ripple_of_a_slide_is_said_in_millimetres() {
    let slide = ARM.replace(r#""elbow" type="continuous""#, r#""elbow" type="prismatic""#);
    let slide = slide.replace(
        "</joint>\n</robot>",
        r#"<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"#,
    );
    let tree = read_urdf(&slide, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let constants = Constants::from([("periods".to_owned(), std::f64::consts::TAU / 0.005)]);
    let effect = catalogue.kind("torque_ripple").unwrap().build(&tree, &[1], &constants);
    let words = catalogue.sentence(&effect.spec(), &effect.parameters(), &[3.0, 4.0]);
    assert_eq!(words, "The force of elbow ripples by 5.00 N, once in 5.00 mm.");
}

#[test]
fn a_balancer_whose_spring_has_no_length_at_rest_is_a_sine() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let effect = catalogue.kind("gravity_balancer").unwrap().build(&tree, &[0], &Constants::new());
    let words = catalogue.sentence(&effect.spec(), &effect.parameters(), &[3.0, 4.0]);
    assert_eq!(words, "shoulder is counterbalanced: up to 5.00 N·m as a sine of its angle.");
}

/// What is in force was left out: a transmission of 3.66·10⁻⁷ rad/(N·m) was said to give −7.27·10⁻⁸.
#[test]
fn a_compliance_is_said_with_what_of_it_is_in_force() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let constants = Constants::from([("compliance".to_owned(), 4.5e-4)]);
    let effect = catalogue.kind("joint_elasticity").unwrap().build(&tree, &[0], &constants);
    let words = catalogue.sentence(&effect.spec(), &effect.parameters(), &[-5e-5]);
    assert_eq!(words, "The transmission of shoulder gives: 4.000e-4 rad/(N·m).");
}

#[test]
fn a_stop_that_stiffens_says_so() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let constants = [("stop", 1.2), ("side", 1.0), ("exponent", 1.5)];
    let constants: Constants = constants.map(|(name, value)| (name.to_owned(), value)).into();
    let effect = catalogue.kind("end_stop").unwrap().build(&tree, &[0], &constants);
    let words = catalogue.sentence(&effect.spec(), &effect.parameters(), &[7.0]);
    assert_eq!(
        words,
        "shoulder runs into something stiff at 1.200: 7.00 N·m/rad at a depth of one, growing with the power 1.50 of the depth."
    );
}

/// It was "stamped -9.24 ms late".
#[test]
fn a_torque_that_is_logged_before_it_acts_is_said_to_be() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let effect = catalogue.kind("time_delay").unwrap().build(&tree, &[0], &Constants::new());
    let words = catalogue.sentence(&effect.spec(), &effect.parameters(), &[-0.00924]);
    assert_eq!(words, "The torque of shoulder acts 9.24 ms after it is logged.");
}

/// A force was said by its x only, and "0 N along x" where the logs told none of it, or only its moments; a
/// payload of which they told no mass "carried 0 kg more".
#[test]
fn what_the_logs_do_not_tell_of_a_force_or_a_payload_is_not_said_to_be_nothing() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let said = |kind: &str, told: &[(usize, f64)]| {
        let effect = catalogue.kind(kind).unwrap().build(&tree, &[0], &Constants::new());
        let mut values = vec![0.0; effect.parameters().len()];
        told.iter().for_each(|&(place, value)| values[place] = value);
        catalogue.sentence(&effect.spec(), &effect.parameters(), &values)
    };
    let pulls = "Something pulls at the link behind shoulder (a hose, a cable)";
    assert_eq!(
        said("external_force", &[(0, 0.03), (1, -2.0), (4, 0.5)]),
        format!("{pulls}: 0.0300 N along x, -2.00 N along y of the world; along z the logs do not tell it.")
    );
    assert_eq!(
        said("external_force", &[(3, -0.322), (4, -0.887)]),
        format!("{pulls}: its moment is up to 0.887 N·m; the force itself the logs do not tell.")
    );
    assert_eq!(
        said("payload", &[(2, -0.3), (9, 0.7)]),
        "The link behind shoulder carries something that the model does not know: mcy of 0.300 kg·m; its mass \
         the logs do not tell."
    );
}

#[test]
fn each_sentence_is_one() {
    let tree = read_urdf(ARM, &UrdfOptions::default()).unwrap().tree;
    for kind in Catalogue::default().kinds() {
        let words = said(&tree, kind);
        assert!(
            words.ends_with('.') && words.chars().count() > 20 && !words.contains('\n'),
            "{}: {words}",
            kind.name()
        );
    }
}

#[test]
fn a_kind_without_a_sentence_says_its_name_and_numbers() {
    let spec = EffectSpec::new("cubic_spring", &["elbow"]);
    let parameter = EffectParameter {
        joint: "elbow".to_owned(),
        name: "k3".to_owned(),
        unit: "N·m/rad³".to_owned(),
        bounds: (0.0, f64::INFINITY),
    };
    let words = Catalogue::default().sentence(&spec, &[parameter], &[12.5]);
    assert_eq!(words, "cubic spring on elbow: k3 = 12.5 N·m/rad³.");
}
