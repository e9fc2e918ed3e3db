//! Which cases there are: a case follows from its seed alone.

use super::kind::{Kind, Name, Stranger};
use super::rng::{CaseRng, Stream};
use super::situation::Situation;
use clap::ValueEnum;
use serde::Serialize;

/// A family of cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum Suite {
    /// One undeclared effect.
    One,
    /// Two.
    Two,
    /// Three.
    Three,
    /// None: the declared model is right.
    Control,
    /// One effect that is not in the catalogue.
    Outside,
    /// Right models in every situation: nothing is to be named.
    WideRight,
    /// Frictions on all joints, mostly undeclared, and up to thirteen effects more, in every situation.
    WideEffects,
    /// One effect that is not in the catalogue, and up to three that are, in every situation.
    WideOutside,
    /// One of [`Kind::NEW`], which came to the catalogue last, in one case of three beside another effect.
    NewKinds,
    /// A torque that is logged at a third to 0.6 or 1.6 to 3 times what it is, in one case of three beside
    /// another effect.
    LargeGains,
    /// One of [`Stranger::NEW`], effects that are not in the catalogue and were found last.
    NewStrangers,
    /// One of [`Stranger::LATER`].
    LaterStrangers,
    /// One of [`NewForm::ALL`], forms of older kinds that came last, in one case of three beside another
    /// effect.
    NewForms,
}

/// A form of an older kind that the other suites do not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewForm {
    /// A drift of a robot that is cold again before each log; all stamps begin at nought.
    ColdAgain,
    /// A drift of a session whose stamps count from long before it.
    LongSince,
    /// A friction of a shaft that turns with one joint and a multiple of the other.
    GearedSum,
    /// A friction that grows with the load and with the speed.
    LoadAndSpeed,
    /// A spring that is stretched by two joints.
    OverTwoJoints,
}

impl NewForm {
    /// All of them.
    pub const ALL: [NewForm; 5] = [
        NewForm::ColdAgain,
        NewForm::LongSince,
        NewForm::GearedSum,
        NewForm::LoadAndSpeed,
        NewForm::OverTwoJoints,
    ];

    fn kind(self) -> Kind {
        match self {
            NewForm::ColdAgain | NewForm::LongSince => Kind::ThermalDrift,
            NewForm::GearedSum | NewForm::OverTwoJoints => Kind::TransmissionCoupling,
            NewForm::LoadAndSpeed => Kind::LoadDependentFriction,
        }
    }
}

/// Development seeds are for looking at; reporting seeds only for reporting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Seeds {
    /// For developing the tracer.
    Dev,
    /// For the score that is reported.
    Report,
}

impl Suite {
    /// All suites.
    pub const ALL: [Suite; 13] = [
        Suite::One,
        Suite::Two,
        Suite::Three,
        Suite::Control,
        Suite::Outside,
        Suite::WideRight,
        Suite::WideEffects,
        Suite::WideOutside,
        Suite::NewKinds,
        Suite::LargeGains,
        Suite::NewStrangers,
        Suite::LaterStrangers,
        Suite::NewForms,
    ];
    /// One to three effects on an otherwise right model, well excited.
    pub const OLD: [Suite; 5] = [Suite::One, Suite::Two, Suite::Three, Suite::Control, Suite::Outside];
    /// Robots as they come.
    pub const WIDE: [Suite; 3] = [Suite::WideRight, Suite::WideEffects, Suite::WideOutside];

    /// Whether its cases have a situation.
    pub fn is_wide(self) -> bool {
        Suite::WIDE.contains(&self)
    }

    /// How many cases a full run has.
    pub fn full_count(self) -> usize {
        match self {
            Suite::One => 400,
            Suite::Two => 150,
            Suite::Three => 50,
            Suite::Control => 300,
            Suite::Outside => 100,
            Suite::WideRight => 750,
            Suite::WideEffects => 300,
            Suite::WideOutside => 120,
            Suite::NewKinds => 120,
            Suite::LargeGains => 120,
            Suite::NewStrangers => 120,
            Suite::LaterStrangers => 40,
            Suite::NewForms => 90,
        }
    }

    /// How many more it has in each of the situations that came later.
    pub fn later_each(self) -> usize {
        match self {
            Suite::WideRight => 30,
            Suite::WideEffects => 12,
            Suite::WideOutside => 4,
            _ => 0,
        }
    }

    /// The seed of a case.
    pub fn seed(self, seeds: Seeds, index: usize) -> u64 {
        let phase = match seeds {
            Seeds::Dev => 1,
            Seeds::Report => 2,
        };
        // Ten suites to a million: the first ten keep their seeds.
        let suite = self as u64;
        (phase + suite / 10 * 10) * 1_000_000 + suite % 10 * 100_000 + index as u64
    }
}

/// What a case is about, before its numbers are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    /// The seed that it follows from.
    pub seed: u64,
    /// Its family.
    pub suite: Suite,
    /// Index of the robot that is tried first.
    pub robot: usize,
    /// Names of the secrets.
    pub secrets: Vec<Name>,
    /// Whether the secrets set in after an identification of the clean robot, whose model is held.
    pub held: bool,
    /// Whether several secrets may share a joint.
    pub together: bool,
    /// What is particular about its noise, drive or motion; in the wide suites only.
    pub situation: Option<Situation>,
    /// Whether the frictions of all joints are declared; always, but in the wide suites.
    pub friction_declared: bool,
}

impl Spec {
    /// The case of a seed; `None` if no suite has it.
    pub fn of_seed(seed: u64, robots: usize) -> Option<Spec> {
        let suite = seed / 10_000_000 * 10 + seed % 1_000_000 / 100_000;
        let suite = *Suite::ALL.get(suite as usize)?;
        let index = (seed % 100_000) as usize;
        let rng = &mut CaseRng::new(seed, u64::MAX >> 8, Stream::Secret);
        let kinds = Kind::of_other_suites();
        let mut spec = Spec {
            seed,
            suite,
            robot: index % robots,
            secrets: Vec::new(),
            held: false,
            together: rng.chance(0.3),
            situation: None,
            friction_declared: true,
        };
        match suite {
            Suite::One => {
                let kind = kinds[index % kinds.len()];
                spec.held = kind.needs_held_model() || (kind.may_grow() && index / kinds.len() % 3 == 2);
                spec.secrets = vec![Name::Catalogue(kind)];
            }
            Suite::Two => spec.draw_several(2, rng),
            Suite::Three => spec.draw_several(3, rng),
            Suite::Control => spec.held = rng.chance(0.2),
            Suite::Outside => {
                let strangers = Stranger::of_other_suites();
                spec.secrets = vec![Name::Outside(strangers[index % strangers.len()])];
            }
            Suite::NewStrangers => spec.draw_stranger(&Stranger::NEW, index, robots),
            Suite::LaterStrangers => spec.draw_stranger(&Stranger::LATER, index, robots),
            Suite::WideRight | Suite::WideEffects | Suite::WideOutside => spec.draw_wide(index, robots, rng),
            Suite::NewKinds => {
                let turns = Kind::NEW.len();
                spec.robot = index / turns % robots;
                spec.draw_first(Kind::NEW[index % turns], index / turns, rng);
            }
            Suite::NewForms => {
                let turns = NewForm::ALL.len();
                spec.robot = index / turns % robots;
                spec.draw_first(NewForm::ALL[index % turns].kind(), index / turns, rng);
            }
            Suite::LargeGains => {
                // The second effect comes with every third case of each robot.
                spec.draw_first(Kind::TorqueGain, index / robots, rng);
            }
        }
        Some(spec)
    }

    /// Situations in turn; the largest robot in one case of ten, since it takes as long as all others.
    fn draw_wide(&mut self, index: usize, robots: usize, rng: &mut CaseRng) {
        self.situation = Some(Situation::of_index(index));
        self.robot = if rng.chance(0.1) { robots - 1 } else { rng.index((robots - 1).max(1)) };
        self.friction_declared = match self.suite {
            Suite::WideEffects => rng.chance(0.3),
            _ => true,
        };
        let strangers = Stranger::of_other_suites();
        let count = match self.suite {
            Suite::WideRight => 0,
            Suite::WideOutside => {
                self.secrets =
                    vec![Name::Outside(strangers[(index + index / Situation::FIRST) % strangers.len()])];
                rng.index(4)
            }
            // One with friction alone, then more and more.
            _ if !self.friction_declared => rng.pick(&[0, 1, 3, 6, 9, 13]),
            _ => rng.pick(&[1, 3, 6, 9, 13]),
        };
        let may_join = |kind: &Kind| {
            !kind.needs_held_model()
                && !matches!(
                    kind,
                    // Simulated motion and deflected encoders would change what the others are; frictions,
                    // rotors and offsets come as families.
                    Kind::ActuatorSaturation
                        | Kind::JointElasticity
                        | Kind::ViscousFriction
                        | Kind::CoulombFriction
                        | Kind::RotorInertia
                        | Kind::TorqueOffset
                )
        };
        let mut choices: Vec<Kind> = Kind::of_other_suites().into_iter().filter(may_join).collect();
        for _ in 0..count {
            let kind = choices.swap_remove(rng.index(choices.len()));
            self.secrets.push(Name::Catalogue(kind));
        }
    }

    /// One after the other, on one robot after the other.
    fn draw_stranger(&mut self, strangers: &[Stranger], index: usize, robots: usize) {
        self.robot = index / strangers.len() % robots;
        self.secrets = vec![Name::Outside(strangers[index % strangers.len()])];
    }

    /// One effect, with another beside it in every third turn.
    fn draw_first(&mut self, first: Kind, turn: usize, rng: &mut CaseRng) {
        let mut kinds = vec![first];
        if turn % 3 == 2 {
            self.join(&mut kinds, 2, rng);
        }
        self.secrets = kinds.into_iter().map(Name::Catalogue).collect();
    }

    fn draw_several(&mut self, count: usize, rng: &mut CaseRng) {
        self.held = rng.chance(0.2);
        let mut kinds = Vec::new();
        self.join(&mut kinds, count, rng);
        self.secrets = kinds.into_iter().map(Name::Catalogue).collect();
    }

    /// Adds kinds of the other suites until there are `count`.
    fn join(&self, kinds: &mut Vec<Kind>, count: usize, rng: &mut CaseRng) {
        let may_join = |kind: &Kind| match kind {
            // Simulated motion and deflected encoders would change what a second effect is: they are judged
            // alone.
            Kind::ActuatorSaturation | Kind::JointElasticity => false,
            kind => self.held || !kind.needs_held_model(),
        };
        let choices: Vec<Kind> = Kind::of_other_suites().into_iter().filter(may_join).collect();
        while kinds.len() < count {
            let kind = rng.pick(&choices);
            if !kinds.iter().any(|other| kind.is_nested_with(*other)) {
                kinds.push(kind);
            }
        }
    }

    /// The new form that its first secret has.
    pub fn new_form(&self) -> Option<NewForm> {
        let index = self.seed as usize % 100_000;
        (self.suite == Suite::NewForms).then(|| NewForm::ALL[index % NewForm::ALL.len()])
    }

    /// Whether one of the secrets is this effect.
    pub fn has(&self, kind: Kind) -> bool {
        self.secrets.contains(&Name::Catalogue(kind))
    }
}
