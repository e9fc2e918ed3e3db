//! The description of a kind of effect in the catalogue.

use crate::FittedEffect;
use crate::mechanism::{Mechanism, Mechanisms, ServoFriction};
use crate::sign::Sign;
use phiw_codegen::{Expression, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::JointProperty;
use phiw_telemetry::Survey;
use std::collections::BTreeMap;

/// Non-linear constants of an effect by name, SI units.
pub type Constants = BTreeMap<String, f64>;

/// A signal that an effect's torque can be plotted against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// The joint's position \[rad, m\].
    Position,
    /// The joint's velocity \[rad/s, m/s\].
    Velocity,
    /// The joint's acceleration \[rad/s², m/s²\].
    Acceleration,
    /// The joint's measured torque \[N·m, N\].
    Torque,
    /// Time \[s\].
    Time,
}

/// A kind of effect: where it can act, which constants to try, how to build it, and what the rest of the
/// program needs to know of it.
///
/// What it says of its parameters (units, physical bounds) and columns (linear in the motion, causal) the
/// [`Effect`] says that it builds. Implement it for an effect of your own and add it with
/// [`crate::Catalogue::with`]: see the recipe on the crate's front page.
pub trait EffectKind: Send + Sync {
    /// Its name, as in `report.json`.
    fn name(&self) -> &str;

    /// The joints, or groups of joints, that it can act on: each joint by default.
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        (0..tree.joint_count()).map(|joint| vec![joint]).collect()
    }

    /// In words, what it acts on, for error messages.
    fn acts_on(&self) -> &'static str {
        "one joint"
    }

    /// Whether it can act on these joints.
    fn accepts(&self, tree: &Tree, site: &[usize]) -> bool {
        self.sites(tree).iter().any(|known| known == site)
    }

    /// Constants to try on a site, given the ranges of the signals; one empty set where it has none.
    fn scan(&self, _site: &[usize], _ranges: &SignalRanges) -> Vec<Constants> {
        vec![Constants::new()]
    }

    /// Constants near those that were found, closer together than the scan's of the same site and ranges.
    fn refine(&self, _from: &Refinement<'_>) -> Vec<Constants> {
        Vec::new()
    }

    /// Constants that are fixed where the kind is declared; `None` if the data choose all of them.
    fn declared_constants(&self) -> Option<Constants> {
        None
    }

    /// Whether its parameters may have changed against a held model that has it already: the change is then
    /// found as the same kind again.
    fn may_change(&self) -> bool {
        false
    }

    /// Whether a free rigid body takes the effect up entirely, so that it can only be seen against a held
    /// model.
    fn needs_held_model(&self) -> bool {
        false
    }

    /// The motion, or the signal, that would distinguish it from its rivals.
    fn telling_motion(&self) -> &'static str;

    /// What it means when it was found, with its fitted values, in one sentence to a user: its name and
    /// numbers by default.
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        found.plainly()
    }

    /// The signal that its torque is best seen against.
    fn seen_against(&self) -> Signal {
        Signal::Velocity
    }

    /// Names of kinds that are tried together with it on one site as well: either alone mimics the other in
    /// part.
    fn goes_with(&self) -> &'static [&'static str] {
        &[]
    }

    /// Names of the kinds that a joint has if it has this one: it is what is beyond them, and they have a
    /// name with it, however uncertain their own share is.
    fn is_beyond(&self) -> &'static [&'static str] {
        &[]
    }

    /// Whether it does what it has its name for beside `simpler` ones of its joint, all with their fitted
    /// values: one that does not only bends what they make, and has no name.
    fn is_itself_beside(&self, _own: &FittedEffect<'_>, _simpler: &[FittedEffect<'_>]) -> bool {
        true
    }

    /// Names of the simpler kinds whose form it polishes: it enters a model with these on the same joint, as
    /// far as anything is left of them, and has a name of its own only where it does what they cannot.
    fn form_of(&self) -> &'static [&'static str] {
        &[]
    }

    /// Constants with which it has more or fewer of its parameters than with the `found` ones; none by
    /// default. A search that chose among all of them roughly tries these once more.
    fn with_other_parameters(&self, _found: &Constants) -> Vec<Constants> {
        Vec::new()
    }

    /// The simpler kind whose size it makes depend on something: a search tries it last, on joints where that
    /// one is in the model, since alone it does the same work less simply, and beside it the work of others.
    fn varies(&self) -> Option<&'static str> {
        None
    }

    /// Names of its constants that belong to the joint rather than to the effect: where it is in a model,
    /// other kinds on the same site take the values that it has.
    fn constants_of_the_site(&self) -> &'static [&'static str] {
        &[]
    }

    /// The constants of a dry friction that turns over a way at a reversal and not over a speed, as bristles
    /// do; `way` \[rad, m\] is about how long it is, where that is known. `None` for what does not turn.
    fn turned_over_a_way(&self, _found: &Constants, _way: Option<f64>) -> Option<Constants> {
        None
    }

    /// Whether it mends what a friction of its joint does at a reversal where that turns in another way than
    /// the model has it.
    fn mends_turning(&self) -> bool {
        false
    }

    /// The way \[rad, m\] that it takes to turn after a reversal; `None` where it takes none.
    fn way_of_turning(&self, _found: &Constants) -> Option<f64> {
        None
    }

    /// The constants with which a drive delivers no more than `limit` \[N·m, N\]; `None` for what is no
    /// limit.
    fn with_torque_limit(&self, _limit: f64) -> Option<Constants> {
        None
    }

    /// The property of a joint that holds its only parameter, in a URDF or a simulator; none if neither can
    /// express it.
    fn joint_property(&self) -> Option<JointProperty> {
        None
    }

    /// What in a simulator's model does what it does, with its fitted values; by default its
    /// [`joint_property`](Self::joint_property).
    fn mechanisms(&self, found: &FittedEffect<'_>) -> Mechanisms {
        let of_joint = |(property, joint): (JointProperty, &String)| Mechanism::Joint {
            joint: joint.clone(),
            property,
            value: found.value(0),
            width: Sign::of(found.constants()).tanh_width(),
        };
        let parts = self.joint_property().into_iter().zip(found.joint_names()).map(of_joint);
        Mechanisms { parts: parts.collect(), left_out: Vec::new() }
    }

    /// What it is among the frictions of a servo's model, with its fitted values; none by default.
    fn servo_friction(&self, _found: &FittedEffect<'_>) -> Option<ServoFriction> {
        None
    }

    /// The torques that it adds as formulas of the present motion, with its fitted values, for code that is
    /// generated of a model; by default those of its [`joint_property`](Self::joint_property), and none where
    /// it has no such property: it is then named as left out.
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let (Some(property), [joint]) = (self.joint_property(), found.joint_names()) else {
            return Vec::new();
        };
        let signal = match property {
            JointProperty::Armature => Expression::acceleration(joint),
            JointProperty::Damping => Expression::velocity(joint),
            JointProperty::Friction => found.sign_of_velocity(joint),
        };
        vec![JointTorque::new(joint, found.value(0) * signal)]
    }

    /// Whether it always takes energy from the motion: its power is that of a brake at every moment, whatever
    /// its parameters are within their bounds.
    fn dissipates(&self) -> bool {
        false
    }

    /// Whether it has so many parameters that it can imitate other kinds: it gives way to simpler ones that
    /// do its work.
    fn is_general_form(&self) -> bool {
        false
    }

    /// The kind on the same joint, with fewer numbers, of which every torque is one that this kind makes,
    /// too: a spring whose rest is far away is an offset. This one gives way to it where it is not worth a
    /// name beside it.
    fn special_case(&self) -> Option<SpecialCase> {
        None
    }

    /// Whether it is what the drive or the logger does to a torque before it is written down, and nothing
    /// that the robot does: it refines a model, but never has a name.
    fn is_of_the_log(&self) -> bool {
        false
    }

    /// Constants with which it is the same within any one log and other from log to log, if there are such:
    /// of a single training log only other motion can tell them.
    fn alike_within_one_log(&self, _found: &Constants, _ranges: &SignalRanges) -> Option<Constants> {
        None
    }

    /// Whether its parameters belong to the training logs and say nothing of any other motion: it cannot be
    /// declared, and motion held out is no judge of it.
    fn is_of_training_logs(&self) -> bool {
        false
    }

    /// Whether it changes, with these constants, with the time since the session began, so that logs whose
    /// clocks each begin anew cannot tell it.
    fn needs_session_time(&self, _constants: &Constants) -> bool {
        false
    }

    /// Builds it. `site` is one that it accepts; constants that are missing take their defaults.
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect>;
}

/// A simpler kind that another one includes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpecialCase {
    /// Its name.
    pub kind: &'static str,
    /// The parameter of the other one that makes the same torque by itself, if one does.
    pub parameter: Option<&'static str>,
}

/// Ranges of the signals of one joint over the training logs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointRange {
    /// Lowest and highest position \[rad, m\].
    pub position: (f64, f64),
    /// RMS of the velocity \[rad/s, m/s\].
    pub velocity_rms: f64,
    /// RMS of the torque \[N·m, N\].
    pub torque_rms: f64,
    /// Largest torque \[N·m, N\].
    pub torque_peak: f64,
    /// RMS of what the model so far leaves of the torque, zero where nothing is fitted yet \[N·m, N\].
    pub residual_rms: f64,
}

/// What constants are refined from.
#[derive(Clone, Copy, Debug)]
pub struct Refinement<'a> {
    /// The constants that were found.
    pub found: &'a Constants,
    /// The joints that the effect acts on.
    pub site: &'a [usize],
    /// What the training logs cover.
    pub ranges: &'a SignalRanges,
    /// Number of refinements so far.
    pub step: usize,
}

/// What the training logs cover: bounds for the constants to try.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalRanges {
    /// One for each joint.
    pub joints: Vec<JointRange>,
    /// First and last moment of the session \[s\].
    pub session: (f64, f64),
    /// Time between samples \[s\].
    pub period: f64,
    /// For each joint, spatial frequencies N \[1/rad, 1/m\] at which its residual has peaks.
    pub ripple_frequencies: Vec<Vec<f64>>,
    /// The same of its residual with the sign of the velocity.
    pub friction_frequencies: Vec<Vec<f64>>,
    /// Whether any joint has a temperature.
    pub temperature: bool,
    /// Number of training logs.
    pub logs: usize,
    /// Duration of the longest of them \[s\].
    pub longest_log: f64,
}

impl SignalRanges {
    /// Ranges as the surveys of the training logs tell them.
    pub fn of_surveys(surveys: &[Survey]) -> Self {
        let count = surveys.first().map_or(0, |survey| survey.joints.len());
        let joint = |index: usize| {
            let mut range =
                JointRange { position: (f64::INFINITY, f64::NEG_INFINITY), ..JointRange::default() };
            for joint in surveys.iter().map(|survey| &survey.joints[index]) {
                range.position = (range.position.0.min(joint.q_min), range.position.1.max(joint.q_max));
                range.velocity_rms = range.velocity_rms.max(joint.velocity_rms);
                if let Some(torque) = joint.torque {
                    range.torque_rms = range.torque_rms.max(torque.rms);
                    range.torque_peak = range.torque_peak.max(torque.max).max(-torque.min);
                }
            }
            range
        };
        let moment = |pick: fn((f64, f64)) -> f64, fold: fn(f64, f64) -> f64| {
            surveys
                .iter()
                .map(|survey| pick(survey.time_range()) + survey.session.offset)
                .fold(f64::NAN, fold)
        };
        let duration = |survey: &Survey| {
            let (first, last) = survey.time_range();
            last - first
        };
        SignalRanges {
            joints: (0..count).map(joint).collect(),
            session: (moment(|range| range.0, f64::min), moment(|range| range.1, f64::max)),
            period: surveys.first().map_or(0.0, |survey| survey.period),
            ripple_frequencies: vec![Vec::new(); count],
            friction_frequencies: vec![Vec::new(); count],
            temperature: surveys.iter().any(|survey| survey.joints.iter().any(|joint| joint.temperature)),
            logs: surveys.len(),
            longest_log: surveys.iter().map(duration).fold(0.0, f64::max),
        }
    }
}

/// One set for each value of one constant.
pub(crate) fn values(name: &str, values: impl IntoIterator<Item = f64>) -> Vec<Constants> {
    values.into_iter().map(|value| Constants::from([(name.to_owned(), value)])).collect()
}

/// Every pair of a set of each.
pub(crate) fn product(left: &[Constants], right: &[Constants]) -> Vec<Constants> {
    let join = |a: &Constants, b: &Constants| a.clone().into_iter().chain(b.clone()).collect();
    left.iter().flat_map(|a| right.iter().map(move |b| join(a, b))).collect()
}

/// `found` with one constant times each factor, `spread` shrinking with every step.
pub(crate) fn around(found: &Constants, name: &str, step: usize) -> Vec<Constants> {
    let Some(&value) = found.get(name) else { return Vec::new() };
    let spread = 1.5_f64.powf(0.5_f64.powi(step as i32));
    [1.0 / spread, spread]
        .map(|factor| {
            let mut near = found.clone();
            near.insert(name.to_owned(), value * factor);
            near
        })
        .to_vec()
}

/// A constant, or its default.
pub(crate) fn constant(constants: &Constants, name: &str, default: f64) -> f64 {
    constants.get(name).copied().unwrap_or(default)
}
