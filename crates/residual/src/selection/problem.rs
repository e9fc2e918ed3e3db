//! What is to be chosen from, as plain data.

use super::products::Products;

/// The rows of one torque.
pub(crate) struct Torque {
    /// For each column the parameter that it belongs to, ascending; the right-hand side behind them has none.
    pub parameters: Vec<usize>,
    /// The products of each fold: stretches of time, whose residuals have nothing to do with each other.
    pub folds: Vec<Products>,
    /// The products of all folds together.
    pub whole: Products,
    /// Mean square of a residual that is as good as none \[N²·m², N²\].
    pub least: f64,
}

impl Torque {
    /// From the products of its folds; a residual of less than this share of the torque (RMS) is as good as
    /// none.
    pub fn new(parameters: Vec<usize>, folds: Vec<Products>, least_share: f64) -> Self {
        let mut whole = Products::zero(parameters.len() + 1);
        folds.iter().for_each(|fold| whole.add(fold));
        let least = least_share * least_share * whole.right_hand_side() / whole.rows().max(1.0);
        Torque { parameters, folds, whole, least }
    }

    /// The same with all columns of the model multiplied by a factor.
    pub fn times(&self, factor: f64) -> Self {
        Torque {
            parameters: self.parameters.clone(),
            folds: self.folds.iter().map(|fold| fold.times(factor)).collect(),
            whole: self.whole.times(factor),
            least: self.least,
        }
    }

    /// The same as one fold.
    pub fn without_folds(&self) -> Self {
        Torque {
            parameters: self.parameters.clone(),
            folds: Vec::new(),
            whole: self.whole.clone(),
            least: self.least,
        }
    }

    /// Mean square of a residual as it enters the criterion: what is as good as none is added, so that the
    /// smaller a residual is the less it counts, but is never given away.
    pub fn variance(&self, rss: f64) -> f64 {
        (self.mean_square(rss) + self.least).max(f64::MIN_POSITIVE)
    }

    pub fn mean_square(&self, rss: f64) -> f64 {
        rss / self.whole.rows().max(1.0)
    }

    /// The column of a parameter.
    pub fn column(&self, parameter: usize) -> Option<usize> {
        self.parameters.binary_search(&parameter).ok()
    }
}

/// One way of writing a hypothesis: columns with fixed constants.
#[derive(Clone, Debug)]
pub(crate) struct Variant {
    /// Parameters of its columns.
    pub parameters: Vec<usize>,
    /// Physical bounds of each.
    pub bounds: Vec<(f64, f64)>,
    /// Constants that were scanned: each counts as a parameter.
    pub constants: usize,
}

/// Something that may be missing: a kind of effect on a joint or a group of joints.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    /// Its kind, which makes it one of a family with those of the same number. Of two that explain alike, the
    /// smaller number is the simpler.
    pub kind: usize,
    /// Whether it is one of the forms that others are forms of: these enter first.
    pub textbook: bool,
    /// Whether its kind acts on each of several joints by itself, so that "on all joints" is one choice.
    pub familiar: bool,
    /// Torques that it acts on.
    pub torques: Vec<usize>,
    /// The ways of writing it, of which at most one is in a model.
    pub variants: Vec<Variant>,
    /// Hypotheses that come with it: what it is a form of, or stands on top of.
    pub requires: Vec<usize>,
    /// Whether its columns are what it does to first order only: what it can explain is seen once it is in
    /// force.
    pub linearised: bool,
    /// Whether its columns are made of the model's own effects: it says nothing in a contest with one of
    /// them.
    pub made_of_model: bool,
    /// Whether it was declared: it stays in the model, only its variant is open.
    pub declared: bool,
}

/// A hypothesis in a model, and the variant that it has there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Member {
    pub hypothesis: usize,
    pub variant: usize,
}

/// What was known before the rows: products over some parameters and a right-hand side, in units of the
/// noise.
pub(crate) struct Prior {
    pub parameters: Vec<usize>,
    pub products: Products,
}

/// Torques, hypotheses, and a model that is there in any case.
pub(crate) struct Problem {
    pub torques: Vec<Torque>,
    /// Number of parameters.
    pub parameters: usize,
    /// Parameters that are in every model.
    pub model: Vec<usize>,
    pub hypotheses: Vec<Hypothesis>,
    pub prior: Option<Prior>,
    /// For each parameter the value that stands for "not there": zero, but for an effect that is in force in
    /// the signals themselves, whose absence is less of it.
    pub absent: Vec<f64>,
    /// Rows of each torque that the conditioning alone makes one independent row.
    pub rows_per_independent: f64,
}

impl Problem {
    pub fn variant(&self, member: Member) -> &Variant {
        &self.hypotheses[member.hypothesis].variants[member.variant]
    }

    /// The rows of each torque over those that the conditioning alone makes one.
    pub fn independent_rows(&self) -> Vec<f64> {
        let of_torque = |torque: &Torque| (torque.whole.rows() / self.rows_per_independent).max(2.0);
        self.torques.iter().map(of_torque).collect()
    }

    /// For each parameter whether it is in every model, or a declared hypothesis's.
    pub fn given(&self) -> Vec<bool> {
        let mut given = vec![false; self.parameters];
        self.model.iter().for_each(|&parameter| given[parameter] = true);
        for hypothesis in self.hypotheses.iter().filter(|hypothesis| hypothesis.declared) {
            let parameters = hypothesis.variants.iter().flat_map(|variant| &variant.parameters);
            parameters.for_each(|&parameter| given[parameter] = true);
        }
        given
    }

    /// The parameters of a model: those that are always in it, then its members'.
    pub fn active(&self, members: &[Member]) -> Vec<usize> {
        let of_members = members.iter().flat_map(|&member| self.variant(member).parameters.iter().copied());
        self.model.iter().copied().chain(of_members).collect()
    }
}
