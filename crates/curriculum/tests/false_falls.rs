//! What the constraint takes off for what nobody knows, against draws; and the advice where nothing is left.

use phiw_curriculum::CurriculumError;
use phiw_curriculum::constraint::{Believed, Constraint, FalseFalls, ZmpConstraint};
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::planner::{Belief, MeasuredSoFar, NoneAllowed, Plan, Policy, plan};
use phiw_curriculum::relaxation::ConstantReduction;
use phiw_curriculum::selection::{MotionCandidates, SmallestCondition};
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_effects::Catalogue;
use phiw_estimation::{Robot, RobotModel};
use phiw_plant::{MultiSine, Reference};
use phiw_regressor::parameter_scales;
use phiw_zmp::{Stance, SupportPolygon, ZmpModel, ZmpWorkspace, standing_parameters};
use rand::SeedableRng;

/// A link of 40 kg on the floor.
const LINK: [f64; 10] = [40.0, 0.4, 0.0, 8.0, 2.5, 0.0, 2.5, 0.0, 0.0, 1.0];
const JOINTS: usize = 7;

fn arm() -> (Tree, Robot, RobotModel) {
    let tree = read_urdf(include_str!("../../../models/arm7.urdf"), &UrdfOptions::default()).unwrap().tree;
    let robot = Robot::with_viscous_friction(tree.clone(), LINK, Catalogue::default()).unwrap();
    let model = robot.truth(&[0.1; JOINTS]).unwrap();
    (tree, robot, model)
}

/// A floor that ends at x = `edge` \[m\] and nowhere else near.
fn ledge(edge: f64) -> Stance {
    let corners = [[edge, 9.0], [-9.0, 9.0], [-9.0, -9.0], [edge, -9.0]];
    Stance::new(SupportPolygon::from_points(&corners).unwrap(), [0.0; 2], 0.0).unwrap()
}

fn posture() -> Vec<f64> {
    (0..JOINTS).map(|joint| 0.3 + 0.1 * joint as f64).collect()
}

/// What is taken off a posture's margin, over k \[m\].
fn deviation(false_falls: FalseFalls) -> f64 {
    let (_, robot, model) = arm();
    let still = [posture(), vec![0.0; JOINTS], vec![0.0; JOINTS]].map(|signal| signal.repeat(3));
    let motion = Motion::new("still", "", JOINTS, 0.01, still).unwrap();
    let constraint = ZmpConstraint::new(ledge(0.3)).counting(false_falls);
    let safety = constraint.safety(&robot, &Believed::unmeasured(&model), &motion).unwrap();
    (safety.margin_m - safety.sure_margin_m) / false_falls.deviations()
}

fn zmp(tree: &Tree, standing: &[f64], acceleration: &[f64]) -> [f64; 2] {
    let balance = ZmpWorkspace::new(tree).evaluate(tree, standing, &posture(), &[0.0; JOINTS], acceleration);
    balance.unwrap().zmp(ZmpModel::MultiBody, 0.0).unwrap()
}

fn normal(random: &mut RandomNumbers) -> f64 {
    // Twelve uniform numbers make a normal one.
    (0..12).map(|_| random.uniform(-0.5, 0.5)).sum()
}

fn std(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn k_is_the_quantile_of_the_normal_distribution() {
    for (rate, k) in
        [(0.9, 0.0), (0.5, 0.0), (0.158_655, 1.0), (0.05, 1.644_854), (1e-3, 3.090_232), (1e-6, 4.753_424)]
    {
        let found = FalseFalls::at_rate(rate).deviations();
        assert!((found - k).abs() < 1e-5, "{rate}: {found}, {k}");
    }
}

#[test]
fn a_posture_is_as_uncertain_as_draws_of_its_bodies() {
    let (tree, _, model) = arm();
    let (belief_share, base_link_share) = (0.1, 0.03);
    let settings =
        FalseFalls { belief_share, base_link_share, unmeasured_noise: 0.0, ..FalseFalls::default() };
    let believed = standing_parameters(&LINK, &model.standard);
    let scales = [
        parameter_scales(&LINK).iter().map(|scale| base_link_share * scale).collect::<Vec<_>>(),
        parameter_scales(&model.standard).iter().map(|scale| belief_share * scale).collect(),
    ]
    .concat();
    let mut random = RandomNumbers::new(5);
    let draw = |_| {
        let drawn: Vec<f64> =
            believed.iter().zip(&scales).map(|(value, scale)| value + scale * normal(&mut random)).collect();
        zmp(&tree, &drawn, &[0.0; JOINTS])[0]
    };
    let drawn = std(&(0..4000).map(draw).collect::<Vec<_>>());
    let found = deviation(settings);
    println!("{found} m, {drawn} m drawn");
    assert!((found / drawn - 1.0).abs() < 0.06, "{found} {drawn}");
}

/// The ZMP under torques that are drawn anew each period, through the mean that a falling pendulum takes.
#[test]
fn noise_counts_as_its_mean_over_the_time_of_a_fall() {
    let (tree, _, model) = arm();
    let settings = FalseFalls { belief_share: 0.0, unmeasured_noise: 0.04, ..FalseFalls::default() };
    let standing = standing_parameters(&LINK, &model.standard);
    let (q, rest) = (posture(), [0.0; JOINTS]);
    let mut workspace = Workspace::new(&tree);
    let mut holding = [0.0; JOINTS];
    tree.inverse_dynamics(&q, &rest, &rest, &mut workspace, &mut holding).unwrap();
    let height = {
        let balance = ZmpWorkspace::new(&tree).evaluate(&tree, &standing, &q, &rest, &rest).unwrap();
        balance.center_of_mass.position[2]
    };
    let stays = (-(9.81 / height).sqrt() * settings.control_period_s).exp();
    let mut random = RandomNumbers::new(6);
    let mut mean = zmp(&tree, &standing, &rest)[0];
    let step = |_| {
        let mut torque = holding;
        for (joint, torque) in torque.iter_mut().enumerate() {
            *torque += settings.unmeasured_noise * tree.joint(joint).limits.effort * normal(&mut random);
        }
        let mut acceleration = [0.0; JOINTS];
        tree.forward_dynamics(&q, &rest, &torque, &mut workspace, &mut acceleration).unwrap();
        mean = stays * mean + (1.0 - stays) * zmp(&tree, &standing, &acceleration)[0];
        mean
    };
    let drawn = std(&(0..40_000).map(step).collect::<Vec<_>>());
    let found = deviation(settings);
    println!("{found} m, {drawn} m drawn");
    assert!((found / drawn - 1.0).abs() < 0.1, "{found} {drawn}");
}

fn planned(dataset: &MotionDataset, stance: Stance) -> Result<Plan, CurriculumError> {
    let (_, robot, model) = arm();
    let candidates = MotionCandidates::new(&robot, robot.declared(), dataset, &[1.0; JOINTS])?;
    let settings = FalseFalls { belief_share: 0.02, unmeasured_noise: 0.0, ..FalseFalls::default() };
    let constraint = ZmpConstraint::new(stance).counting(settings);
    let belief = Belief {
        robot: &robot,
        dataset,
        candidates: &candidates,
        model: &model,
        certainty: None,
        initial: &model,
        rivalry: None,
    };
    let policy = Policy {
        selection: &SmallestCondition,
        constraint: &constraint,
        relaxation: &ConstantReduction(0.0),
        none_allowed: NoneAllowed::Refuse,
        rivalry_period_s: 0.02,
        seed: 0,
    };
    plan(&belief, &MeasuredSoFar::default(), &policy)
}

fn dataset() -> MotionDataset {
    let (tree, ..) = arm();
    let motion = |index: u64| {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(index);
        let sine = MultiSine::random(&tree, 3.0, 1.0, [0.4, 0.4], &mut rng);
        let reference = |t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| sine.at(t_s, q, v, a);
        Motion::of_reference(&format!("sine_{index}"), "", JOINTS, (301, 0.01), reference).unwrap()
    };
    MotionDataset::new(JOINTS, (0..4).map(motion).collect()).unwrap()
}

#[test]
fn where_nothing_is_allowed_the_slower_motion_that_is_advised_is() {
    let dataset = dataset();
    let (_, robot, model) = arm();
    // A ledge that postures stay behind, and motions at their own speed do not.
    let middle = |times: f64| {
        let slower = dataset.motions().iter().map(|motion| motion.slower(times).unwrap());
        let slower = MotionDataset::new(JOINTS, slower.collect()).unwrap();
        let settings = FalseFalls { belief_share: 0.02, unmeasured_noise: 0.0, ..FalseFalls::default() };
        let constraint = ZmpConstraint::new(ledge(1.0)).counting(settings);
        let safety = constraint.all(&robot, &Believed::unmeasured(&model), &slower).unwrap();
        1.0 - safety.iter().map(|safety| safety.sure_margin_m).fold(f64::NEG_INFINITY, f64::max)
    };
    let edge = 0.5 * (middle(1.0) + middle(10.0));
    assert!(middle(1.0) > middle(10.0) + 1e-3, "slower motions must be safer for this to test anything");
    let refusal = planned(&dataset, ledge(edge)).unwrap_err();
    let text = refusal.to_string();
    println!("{text}");
    let CurriculumError::NothingSafe { motions: 4, safer, .. } = refusal else { panic!("{text}") };
    let times: f64 = safer.rsplit("--slower ").next().unwrap().trim_end_matches(')').parse().unwrap();
    let plan = planned(&dataset.clone().with_slower(&[times]).unwrap(), ledge(edge)).unwrap();
    assert!(!plan.forced && plan.choice.motion >= dataset.len(), "{plan:?}");
    assert!(plan.safety.sure_margin_m >= 0.0 && plan.safety.sure_margin_m < plan.safety.margin_m);
    // Beyond what even postures keep there is no such advice.
    let refusal = planned(&dataset, ledge(0.5 * middle(10.0).max(1e-3))).unwrap_err().to_string();
    assert!(refusal.contains("even 10 times slower"), "{refusal}");
}

#[test]
fn a_slower_motion_is_the_same_way_in_more_time() {
    let (rate, period_s) = (3.0_f64, 0.01);
    let at = |t_s: f64| [(rate * t_s).sin(), rate * (rate * t_s).cos(), -rate * rate * (rate * t_s).sin()];
    let reference = |t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        [q[0], v[0], a[0]] = at(t_s);
    };
    let motion = Motion::of_reference("sine", "wave", 1, (201, period_s), reference).unwrap();
    for times in [1.0, 1.5, 2.0, 3.7] {
        let slower = motion.slower(times).unwrap();
        assert_eq!((slower.times_slower, slower.task.as_str(), slower.period_s()), (times, "wave", period_s));
        let longer = times * motion.duration_s() - slower.duration_s();
        assert!((-1e-9..period_s).contains(&longer), "{longer}");
        for sample in 0..slower.samples() {
            let [q, v, a] = at(sample as f64 * period_s / times);
            let [own_q, own_v, own_a] = slower.sample(sample).map(|signal| signal[0]);
            assert!((own_q - q).abs() < 1e-8, "{times} {sample}: {own_q} {q}");
            assert!((own_v - v / times).abs() < 1e-7);
            assert!((own_a - a / times / times).abs() < 2e-3 / times / times);
        }
    }
    assert_eq!(motion.slower(1.0).unwrap().sample(77), motion.sample(77));
    for times in [0.5, f64::NAN, f64::INFINITY] {
        assert!(motion.slower(times).unwrap_err().to_string().starts_with("the slowness of a motion is"));
    }
}
