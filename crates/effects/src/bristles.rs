//! Dry friction that turns over a way, as that of bristles that bend before they slip.

use crate::columns::Formula;
use crate::kind::{Constants, around, product, values};
use crate::sign::{LEAD, POWER, WIDTH};
use phiw_identification::effect::Sample;

/// The constant of a friction that turns over a way instead of over a speed: the way \[rad, m\].
pub(crate) const DEFLECTION: &str = "bristle_deflection";
/// The longest way over which a dry friction turns \[rad, m\]. A longer one is a hysteresis, which has a name
/// of its own.
pub const LONGEST_BRISTLES: f64 = 1e-3;
/// Ways over which a dry friction is first tried to turn \[rad, m\].
pub const BRISTLE_WAYS: [f64; 5] = [1e-5, 3e-5, 1e-4, 3e-4, LONGEST_BRISTLES];
/// For how long a joint has moved before its log, at the speed at which it is met there \[s\]: one that
/// rests where its log begins has bristles that are relaxed, one that moves has bent them.
const MOVED_BEFORE: f64 = 0.1;

/// A friction whose steady state is `steady`, and which lags behind it over the way of its joint: the force
/// of LuGre's bristles without micro-damping (Canudas de Wit et al. 1995), of one whose steady state does not
/// change on the way.
pub(crate) struct Bristles<F> {
    pub joint: usize,
    /// The way over which the force turns \[rad, m\]; zero where it turns at once.
    pub deflection: f64,
    pub steady: F,
}

impl<F: Fn(&Sample<'_>) -> f64 + Send + Sync> Formula for Bristles<F> {
    type Memory = Option<Turning>;

    fn columns(&self, memory: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]) {
        columns[0] = (self.steady)(sample);
        if self.deflection > 0.0 {
            let now = Turning {
                force: columns[0],
                steady: columns[0],
                position: sample.q()[self.joint],
                velocity: sample.qd()[self.joint],
            };
            columns[0] = match *memory {
                Some(before) => before.followed_by(&now, sample.period(), self.deflection),
                None => now.at_the_beginning(self.deflection),
            };
            *memory = Some(Turning { force: columns[0], ..now });
        }
    }
}

/// A friction on its way to its steady state, and where the joint is.
#[derive(Clone, Copy)]
pub(crate) struct Turning {
    force: f64,
    steady: f64,
    position: f64,
    velocity: f64,
}

impl Turning {
    /// The force where the log begins.
    fn at_the_beginning(&self, deflection: f64) -> f64 {
        self.steady * (1.0 - (-self.velocity.abs() * MOVED_BEFORE / deflection).exp())
    }

    /// The force after the way to where the joint is `now`, `period` \[s\] later: the exact solution of
    /// `deflection`·dF/d|q| = steady − F, where the velocity changes its sign at the time that it is zero
    /// between the two.
    fn followed_by(&self, now: &Self, period: f64, deflection: f64) -> f64 {
        let toward =
            |force: f64, steady: f64, way: f64| steady + (force - steady) * (-way / deflection).exp();
        if self.velocity * now.velocity >= 0.0 {
            return toward(self.force, now.steady, (now.position - self.position).abs());
        }
        let (before, after) = (self.velocity.abs(), now.velocity.abs());
        let [forth, back] = [before, after].map(|speed| 0.5 * period * speed * speed / (before + after));
        toward(toward(self.force, self.steady, forth), now.steady, back)
    }
}

/// The constants of a friction with bristles instead of a sign that turns over a speed; they turn over `way`
/// \[rad, m\], if that is not too long, or over one in the middle of what is tried.
pub(crate) fn with_bristles(found: &Constants, way: Option<f64>) -> Constants {
    let middle = BRISTLE_WAYS[BRISTLE_WAYS.len() / 2];
    let mut with = found.clone();
    with.insert(WIDTH.to_owned(), 0.0);
    with.remove(POWER);
    with.remove(LEAD);
    with.insert(DEFLECTION.to_owned(), way.map_or(middle, |way| way.min(LONGEST_BRISTLES)));
    with
}

/// Other ways near the one of a friction with bristles; at first also those of other sizes.
pub(crate) fn bristles_near(found: &Constants, step: usize) -> Vec<Constants> {
    let mut near = around(found, DEFLECTION, step);
    if step == 0 && found.contains_key(DEFLECTION) {
        near.extend(product(std::slice::from_ref(found), &values(DEFLECTION, BRISTLE_WAYS)));
    }
    near.retain(|near| near[DEFLECTION] <= LONGEST_BRISTLES);
    near
}

#[cfg(test)]
mod tests {
    use super::{BRISTLE_WAYS, DEFLECTION, LONGEST_BRISTLES, Turning, bristles_near, with_bristles};
    use crate::kind::Constants;
    use crate::sign::{POWER, WIDTH};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_column_of_bristles_is_lugre_integrated(
            deflection in 3e-5..1e-2f64,
            omega in 3.0..12.0f64,
            amplitude in 0.2..0.8f64,
            period in 1e-3..5e-3f64,
        ) {
            const STEPS: usize = 2000;
            // Away from a reversal at t = 0, with one between rows.
            let position = |t: f64| -amplitude * (omega * t + 0.4).cos();
            let velocity = |t: f64| amplitude * omega * (omega * t + 0.4).sin();
            let turning = |t: f64, force: f64| {
                let velocity = velocity(t);
                Turning { force, steady: velocity.signum(), position: position(t), velocity }
            };
            // LuGre's ż = v − |v|·z over `deflection`, by the implicit midpoint rule.
            let (mut z, mut before) = (1.0, position(0.0));
            let mut state = turning(0.0, 1.0);
            for row in 1..1000_usize {
                for step in 1..=STEPS {
                    let now = position(((row - 1) as f64 + step as f64 / STEPS as f64) * period);
                    let way = (now - before) / deflection;
                    z = (z * (1.0 - 0.5 * way.abs()) + way) / (1.0 + 0.5 * way.abs());
                    before = now;
                }
                let t = row as f64 * period;
                let now = turning(t, 0.0);
                state = Turning { force: state.followed_by(&now, period, deflection), ..now };
                prop_assert!((state.force - z).abs() < 0.01, "row {row}: {} and {z}", state.force);
            }
        }
    }

    #[test]
    fn bristles_take_the_place_of_a_speed_and_stay_below_a_hysteresis() {
        let smooth = Constants::from([(WIDTH.to_owned(), 0.02), (POWER.to_owned(), 2.0)]);
        assert!(bristles_near(&smooth, 0).is_empty());
        let mut found = with_bristles(&smooth, None);
        assert!(found[WIDTH] == 0.0 && !found.contains_key(POWER));
        for _ in 0..20 {
            let near = bristles_near(&found, 0);
            assert!(near.iter().all(|near| near[DEFLECTION] <= LONGEST_BRISTLES && near[WIDTH] == 0.0));
            found = near.into_iter().max_by(|a, b| a[DEFLECTION].total_cmp(&b[DEFLECTION])).unwrap();
        }
        assert_eq!(found[DEFLECTION], LONGEST_BRISTLES);
    }

    #[test]
    fn bristles_begin_with_the_way_that_is_known_if_it_is_not_too_long() {
        let over = |way| with_bristles(&Constants::new(), way)[DEFLECTION];
        assert_eq!(
            [over(Some(7e-4)), over(Some(0.02)), over(None)],
            [7e-4, LONGEST_BRISTLES, BRISTLE_WAYS[2]]
        );
    }

    /// Point-to-point motion begins at rest, where the force is not that of sliding.
    #[test]
    fn bristles_are_relaxed_where_a_log_begins_at_rest_and_bent_where_it_begins_in_motion() {
        let force = |velocity: f64| {
            let now = Turning { force: 0.0, steady: velocity.signum(), position: 0.3, velocity };
            now.at_the_beginning(5e-4)
        };
        assert_eq!(force(0.0), 0.0);
        assert!((force(-0.5) + 1.0).abs() < 1e-9 && force(1e-3) < 0.2);
    }
}
