//! Which of the effects that save −log L is believed: the decisions of [`crate::ScoreTest`], from numbers
//! alone.

/// When a score test believes an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct ScoreTestSettings {
    /// −log L that an effect must save beyond the price of its parameters. Higher misses small effects, lower
    /// names effects that are not there. Default: 5, so that an effect of one parameter is four standard
    /// deviations from nothing. Seventy such effects are asked for after each log of an 18-joint robot: with
    /// all of them together, one right model in two hundred gets a false name if their gains are χ²
    /// (arithmetic, not a count).
    pub least_merit: f64,
    /// How exactly the form of an effect is known, as a share of its torque. An effect that saves less beside
    /// others than this error of theirs may cost is not believed. Higher misses small effects beside large
    /// ones, lower names effects for what the large ones leave. Default: 0.1, reasoned and not calibrated:
    /// frictions that turn are found within 16 % (docs/results/curriculum.md).
    pub form_error: f64,
    /// Effects of at least this share of the best one's merit are fitted in full beside it. Lower costs fits;
    /// higher misses an effect whose gain the score predicts too small. Default: 0.6, not calibrated.
    pub near: f64,
    /// Effects at most that are fitted in full at a time. Default: 5, a limit on the time.
    pub most_near: usize,
    /// Effects whose merits differ by no more explain the logs alike \[−log L\]; then the simplest is
    /// believed. Default: 3, odds of 20 to 1.
    pub alike: f64,
    /// A rival counts if it has at least this probability beside the effect that is believed. Default: 0.1.
    pub least_rival: f64,
    /// How often the constants of an effect are refined. Default: 2; not calibrated.
    pub refinements: usize,
    /// How often constants of frictions that turn are exchanged and all is fitted again. Default: 3, a limit
    /// on the time.
    pub most_exchanges: usize,
    /// What other constants must save to be worth another fit \[−log L\]. Default: 1, which changes no
    /// parameter by much more than its standard deviation.
    pub least_exchange: f64,
    /// Effects at most. Default: 3, a limit on the time.
    pub most_effects: usize,
}

impl Default for ScoreTestSettings {
    fn default() -> Self {
        ScoreTestSettings {
            least_merit: 5.0,
            form_error: 0.1,
            near: 0.6,
            most_near: 5,
            alike: 3.0,
            least_rival: 0.1,
            refinements: 2,
            most_exchanges: 3,
            least_exchange: 1.0,
            most_effects: 3,
        }
    }
}

/// An effect that has been fitted in full.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// −log L that it saves, less the price of its parameters.
    pub merit: f64,
    /// Number of its parameters and constants: what makes it simple.
    pub size: usize,
    /// Place of its kind in the catalogue's order of simplicity: of two with as many numbers that explain
    /// alike, as a spring and a balancer on a short arc, the earlier is believed.
    pub rank: usize,
}

/// The outcome of a contest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Winner {
    /// The contender that is believed.
    pub winner: usize,
    /// Those that are nearly as likely, the likeliest first.
    pub rivals: Vec<usize>,
}

impl ScoreTestSettings {
    /// The same beside effects that save this much of −log L. That is half the square of their torque over
    /// the noise; a share of the torque leaves the square of the share.
    pub fn beside(&self, saved: f64) -> Self {
        let least_merit = self.least_merit.max(self.form_error.powi(2) * saved);
        ScoreTestSettings { least_merit, ..self.clone() }
    }

    /// How many effects are fitted in full, of those with these predicted `merits`, the largest first. None
    /// of them if the best is not worth its price.
    pub fn shortlist(&self, merits: &[f64]) -> usize {
        let Some(best) = merits.first().filter(|best| **best >= self.least_merit) else { return 0 };
        merits.iter().take_while(|merit| **merit >= self.near * best).count().min(self.most_near)
    }

    /// Which contender is believed: of those that explain the logs as well as the best the one with the
    /// fewest numbers, then the earliest of the catalogue. None if no contender is worth its price.
    pub fn contest(&self, contenders: &[Contender]) -> Option<Winner> {
        let merit = |index: usize| contenders[index].merit;
        let mut worth: Vec<usize> =
            (0..contenders.len()).filter(|&index| merit(index) >= self.least_merit).collect();
        worth.sort_by(|&a, &b| merit(b).total_cmp(&merit(a)));
        let most = merit(*worth.first()?);
        let alike = worth.iter().copied().filter(|&index| merit(index) >= most - self.alike);
        let winner = alike.min_by_key(|&index| (contenders[index].size, contenders[index].rank))?;
        let least = most + self.least_rival.ln();
        worth.retain(|&index| merit(index) >= least && index != winner);
        Some(Winner { winner, rivals: worth })
    }
}
