//! What the likelihood's estimator decides, in one place.

/// How the minimum of −log L is found. The problem is convex: these numbers decide how long it takes and how
/// near it comes, not which minimum is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Steps at most. Default: 40.
    pub most_steps: usize,
    /// The last step's length in standard deviations of the parameters (all together) at which the minimum
    /// counts as found. Default: 0.05.
    pub settled: f64,
    /// The decrement at which no step is worth its price, whatever the curvature's age \[−log L\]. Default:
    /// 10⁻⁸, what rounding leaves of it.
    pub least_decrement: f64,
    /// Steps at first that compute the curvature of log det J anew; it is the dearest part. Default: 2.
    pub fresh_steps: usize,
    /// Of later steps one in so many computes it anew, since it changes slowly. Default: 4.
    pub curvature_every: usize,
    /// Of so many instants one counts in that curvature; all count in the gradient. Default: 4.
    pub instants_every: usize,
    /// Share of the predicted decrease that a step must achieve (Armijo). Default: 0.1.
    pub sufficient_decrease: f64,
    /// Share of a whole step below which the search along it is given up. Default: 10⁻⁶.
    pub shortest_step: f64,
    /// What is added to the diagonal of the curvature, as a share of it and in all, so that directions that
    /// nothing determines stay where they are. Default: 10⁻¹⁰ and 10⁻¹².
    pub damping: [f64; 2],
    /// Times at most that an estimate is made anew with frictions that turn within a period as the last one
    /// says. Default: 6.
    pub friction_rounds: usize,
    /// Share of such a step below which it is not halved any more. Default: 1/8.
    pub least_friction_step: f64,
    /// The largest step of a parameter, in its standard deviations, at which both agree. Default: 0.1; no
    /// command calibrates it.
    pub friction_settled: f64,
    /// Radius of gyration of the spheres that bodies start as where the first belief is of bodies that cannot
    /// exist \[m\]. Default: 0.1, a forearm's.
    pub sphere_radius: f64,
    /// Least mass of such a sphere \[kg\]. Default: 0.05.
    pub least_mass: f64,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        NewtonSettings {
            most_steps: 40,
            settled: 0.05,
            least_decrement: 1e-8,
            fresh_steps: 2,
            curvature_every: 4,
            instants_every: 4,
            sufficient_decrease: 0.1,
            shortest_step: 1e-6,
            friction_rounds: 6,
            least_friction_step: 0.125,
            friction_settled: 0.1,
            damping: [1e-10, 1e-12],
            sphere_radius: 0.1,
            least_mass: 0.05,
        }
    }
}

/// What a score test makes of an effect ([`crate::MotionLikelihood::gains`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScoreSettings {
    /// Price of a parameter \[−log L\]. Default: 4, half the logarithm of the rows of one torque in a minute
    /// (BIC, Schwarz 1978).
    pub parameter_price: f64,
    /// Share of a column's square that the model must leave of it; of less, nothing can be said. Default:
    /// 10⁻³, not calibrated.
    pub least_left: f64,
    /// Of so many instants one counts in a curvature. Default: 4.
    pub instants_every: usize,
}

impl Default for ScoreSettings {
    fn default() -> Self {
        ScoreSettings { parameter_price: 4.0, least_left: 1e-3, instants_every: 4 }
    }
}
