//! What is asked for: an effect, or one kind on all joints that may have it.

use phiw_curriculum::growth::saved_by_family;
use phiw_estimation::Gain;

/// A member of a family that saves less of −log L makes the torques worse, since its own uncertainty is
/// larger than its value: one standard deviation (AIC, Akaike 1974).
const LEAST_OF_MEMBER: f64 = 0.5;

/// An effect, or a family: one kind on several joints, with one parameter each.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// The effect, or the members of the family, with what each would save alone.
    pub effects: Vec<Gain>,
    /// Joints that were asked of, also those that are no members.
    pub asked: usize,
    /// −log L that it saves less its price, as the score foretells it.
    pub merit: f64,
    /// Price of its parameters; of a family's there is one, their common spread.
    price: f64,
}

impl Hypothesis {
    /// One effect.
    #[must_use]
    pub fn of_one(effect: Gain) -> Self {
        let (merit, price) = (effect.merit, effect.gain - effect.merit);
        Hypothesis { effects: vec![effect], asked: 1, merit, price }
    }

    /// A kind of one parameter on the joints of `members`; `asked` joints may have it, and those that are not
    /// among the members save nothing. `price` is that of a parameter. None if fewer than two are worth it.
    #[must_use]
    pub fn of_family(members: Vec<Gain>, asked: usize, price: f64) -> Option<Self> {
        // What was chosen of several constants counts as the mean over them.
        let saves = |member: &Gain| member.merit + price;
        let members: Vec<Gain> =
            members.into_iter().filter(|member| saves(member) >= LEAST_OF_MEMBER).collect();
        let gain = members.iter().map(saves).sum();
        let merit = saved_by_family(gain, asked) - price;
        (members.len() > 1).then_some(Hypothesis { effects: members, asked, merit, price })
    }

    /// Its merit where a fit with all of it has saved `saved`.
    #[must_use]
    pub fn merit_of(&self, saved: f64) -> f64 {
        saved_by_family(saved, self.asked) - self.price
    }
}

#[cfg(test)]
mod tests {
    use super::Hypothesis;
    use phiw_estimation::Gain;
    use phiw_identification::EffectSpec;

    const PRICE: f64 = 4.0;

    /// Effects of so many standard deviations.
    fn members(deviations: &[f64]) -> Vec<Gain> {
        let gain = |deviations: &f64| Gain {
            effect: EffectSpec::new("coulomb_friction", &["joint"]),
            gain: 0.5 * deviations * deviations,
            parameters: vec![1.0],
            merit: 0.5 * deviations * deviations - PRICE,
        };
        deviations.iter().map(gain).collect()
    }

    /// Deviations of the members, joints that are asked of; whether the family is worth more than 5 beyond
    /// its price, and more than its best member by itself.
    #[test]
    fn small_frictions_on_all_joints_are_plain_together() {
        let cases: &[(&[f64], usize, bool, bool)] = &[
            // Two and a half on each of eighteen.
            (&[2.5; 18], 18, true, true),
            // Noise: some two of one and a half, half of them of the other sign.
            (&[1.5, 0.7, 1.9, 0.4, 1.0, 0.2, 1.2, 0.9, 0.1], 18, false, false),
            // One joint alone is an effect, and no family.
            (&[9.0, 1.1, 0.3], 18, true, false),
            (&[6.3, 1.2], 18, false, false),
            // Three of eighteen, plain: a family is worth more than the best of them alone.
            (&[9.0, 10.0, 8.0], 18, true, true),
            (&[3.0, 3.0], 2, false, true),
        ];
        for (deviations, asked, worth, more) in cases {
            let best = members(deviations).into_iter().map(|member| member.merit).fold(f64::MIN, f64::max);
            let family = Hypothesis::of_family(members(deviations), *asked, PRICE).unwrap();
            assert_eq!(family.merit > 5.0, *worth, "{deviations:?}: {}", family.merit);
            assert_eq!(family.merit > best, *more, "{deviations:?}: {} and {best}", family.merit);
        }
    }

    #[test]
    fn what_is_nearer_to_nothing_than_its_uncertainty_is_no_member() {
        let family = Hypothesis::of_family(members(&[3.0, 0.9, 4.0, 1.1]), 6, PRICE).unwrap();
        assert_eq!(family.effects.len(), 3);
        assert_eq!(family.asked, 6);
        assert!(Hypothesis::of_family(members(&[3.0, 0.9]), 6, PRICE).is_none());
    }

    #[test]
    fn a_family_that_saves_what_was_foretold_is_worth_what_was_foretold() {
        let family = Hypothesis::of_family(members(&[2.0, 3.0, 4.0]), 4, PRICE).unwrap();
        assert!((family.merit_of(0.5 * (4.0 + 9.0 + 16.0)) - family.merit).abs() < 1e-12);
        let one = Hypothesis::of_one(members(&[3.0]).remove(0));
        assert!((one.merit_of(4.5) - one.merit).abs() < 1e-12);
    }
}
