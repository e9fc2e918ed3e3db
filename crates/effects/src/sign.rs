//! The sign of a velocity, and how it turns.

use crate::bristles::DEFLECTION;
use crate::kind::{Constants, SignalRanges, around, constant, product, values};
use phiw_codegen::{Expression, Function};
use phiw_identification::effect::Sample;

/// The constant of every smoothed sign: the speed over which it turns \[rad/s, m/s\].
pub(crate) const WIDTH: &str = "sign_width";
/// The constant that says how it turns: see [`Sign`].
pub(crate) const POWER: &str = "sign_power";
/// The powers that are tried where a sign is refined; 0 stands for the hyperbolic tangent.
const POWERS: [f64; 4] = [0.0, 1.0, 2.0, STRAIGHT];
/// The power of a sign that is as good as a straight line between its ends.
const STRAIGHT: f64 = 8.0;
/// The constant that says at which moment the velocity is the one whose sign it is: see [`Sign::lead`].
pub(crate) const LEAD: &str = "sign_lead";
/// Leads that are tried first where a sign is refined \[s\]; the friction loss of MuJoCo leads by 9.5 ms if
/// nobody sets another time constant. No lag is tried: bristles are late, too, and over a way.
const LEADS: [f64; 2] = [0.003, 0.01];
/// Widths that are tried with a lead where there was none \[rad/s, m/s\].
const WIDTHS_OF_LEADING: [f64; 3] = [1e-3, 4e-3, 0.016];
/// The longest lead \[s\]: to first order the velocity is not foretold for longer.
const LONGEST_LEAD: f64 = 0.05;

/// Speeds over which a sign may turn: the plain sign, then up to 0.064 rad/s (m/s), but no more than half of
/// the joint's RMS speed.
pub(crate) fn sign_widths(joint: usize, ranges: &SignalRanges) -> Vec<Constants> {
    let largest = 0.5 * ranges.joints[joint].velocity_rms;
    let widths =
        (0..15).map(|step| 0.0005 * 2.0_f64.powf(0.5 * f64::from(step))).filter(|&width| width <= largest);
    values(WIDTH, [0.0].into_iter().chain(widths))
}

/// A few of them, for effects that are not themselves about the sign.
pub(crate) fn few_sign_widths(joint: usize, ranges: &SignalRanges) -> Vec<Constants> {
    sign_widths(joint, ranges).into_iter().step_by(5).collect()
}

/// Signs near one that was found: of other widths, and turning in other ways within the same speed.
///
/// How exactly a sign turns is nobody's effect, but where it is wrong, others seem to be there: a Stribeck
/// friction that makes it turn sooner.
pub(crate) fn signs_near(found: &Constants, step: usize) -> Vec<Constants> {
    let mut near = around(found, WIDTH, step);
    let own = Sign::of(found);
    if own.width > 0.0 {
        near.extend(POWERS.into_iter().filter(|power| *power != own.power).map(|power| {
            let width = own.tanh_width() / Sign { width: 1.0, power, lead: 0.0 }.tanh_width();
            let mut other = found.clone();
            other.insert(WIDTH.to_owned(), width);
            match power {
                0.0 => other.remove(POWER),
                power => other.insert(POWER.to_owned(), power),
            };
            other
        }));
    } else if own.lead != 0.0 {
        // A sign that turned too late was best where it turned at once.
        near.extend(product(std::slice::from_ref(found), &values(WIDTH, WIDTHS_OF_LEADING)));
    }
    near.extend(around(found, LEAD, step));
    // A friction that turns over a way has no lead.
    if step == 0 && !found.contains_key(DEFLECTION) {
        near.extend(product(std::slice::from_ref(found), &values(LEAD, LEADS)));
    }
    near.retain(|near| constant(near, LEAD, 0.0) <= LONGEST_LEAD);
    near
}

/// sign(v), smoothed over the speed `width`; the plain sign where `width` is zero.
#[inline]
pub fn smooth_sign(velocity: f64, width: f64) -> f64 {
    // tanh is one to the last digit beyond 20.
    if velocity.abs() < 20.0 * width {
        (velocity / width).tanh()
    } else if velocity == 0.0 {
        0.0
    } else {
        velocity.signum()
    }
}

/// A smoothed sign of a velocity v: tanh(v/w), or v/(|v|ᵖ + wᵖ)^(1/p) of a power p, which turns the slower
/// the smaller p is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sign {
    /// w \[rad/s, m/s\]; the plain sign where it is zero.
    pub width: f64,
    /// p: 1, 2 or 8; 0 stands for the hyperbolic tangent.
    pub power: f64,
    /// The velocity is that of so much later, to first order: v = q̇ + lead·q̈ \[s\]. Friction that is held
    /// by a soft constraint, as MuJoCo's friction loss (its documentation, "Solver parameters"), leads so.
    pub lead: f64,
}

impl Sign {
    /// The sign of an effect's constants.
    pub fn of(constants: &Constants) -> Self {
        Sign {
            width: constant(constants, WIDTH, 0.0),
            power: constant(constants, POWER, 0.0),
            lead: constant(constants, LEAD, 0.0),
        }
    }

    /// The sign of a joint's velocity in a sample.
    #[inline]
    pub fn of_joint(self, sample: &Sample<'_>, joint: usize) -> f64 {
        let velocity = sample.qd()[joint];
        // Accelerations may not be there where nothing leads.
        self.at(if self.lead == 0.0 { velocity } else { velocity + self.lead * sample.qdd()[joint] })
    }

    /// The sign of a velocity \[rad/s, m/s\].
    #[inline]
    pub fn at(self, velocity: f64) -> f64 {
        if self.power == 0.0 || self.width == 0.0 {
            smooth_sign(velocity, self.width)
        } else if self.power == 1.0 {
            velocity / (velocity.abs() + self.width)
        } else if self.power == 2.0 {
            velocity / velocity.hypot(self.width)
        } else {
            // Of the larger of the two, so that no power overflows.
            let (larger, smaller) = (velocity.abs().max(self.width), velocity.abs().min(self.width));
            velocity / larger * (1.0 + (smaller / larger).powf(self.power)).powf(-self.power.recip())
        }
    }

    /// The sign of a joint's velocity as a formula.
    pub fn of_joint_as_formula(self, joint: &str) -> Expression {
        let velocity = Expression::velocity(joint);
        match self.lead {
            0.0 => self.formula(velocity),
            lead => self.formula(velocity + lead * Expression::acceleration(joint)),
        }
    }

    /// The sign of a velocity as a formula.
    fn formula(self, velocity: Expression) -> Expression {
        if self.power == 0.0 || self.width == 0.0 {
            return velocity.sign(self.width);
        }
        let inverse = |of: Expression, exponent: f64| of.of(Function::Power(exponent));
        let scale = if self.power == 1.0 {
            inverse(velocity.clone().magnitude() + Expression::Constant(self.width), -1.0)
        } else if self.power == 2.0 {
            let square = velocity.clone() * velocity.clone();
            inverse(square + Expression::Constant(self.width * self.width), -0.5)
        } else {
            let power = velocity.clone().magnitude().of(Function::Power(self.power));
            inverse(power + Expression::Constant(self.width.powf(self.power)), -self.power.recip())
        };
        velocity * scale
    }

    /// The width of the hyperbolic tangent that is as large as this one where that is tanh 1 \[rad/s, m/s\].
    pub fn tanh_width(self) -> f64 {
        let there = 1.0_f64.tanh();
        match self.power {
            0.0 => self.width,
            1.0 => self.width * there / (1.0 - there),
            2.0 => self.width * there / (1.0 - there * there).sqrt(),
            power => self.width * there / (1.0 - there.powf(power)).powf(power.recip()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{DEFLECTION, LEAD, LONGEST_LEAD, POWERS, STRAIGHT, Sign, WIDTH, signs_near};
    use crate::kind::{Constants, values};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_sign_is_odd_rises_and_is_tanh_1_at_the_width_of_its_tangent(
            width in 1e-4..0.1f64,
            power in prop::sample::select(POWERS.to_vec()),
            a in -5.0..5.0f64,
            b in -5.0..5.0f64,
        ) {
            let sign = Sign { width, power, lead: 0.0 };
            prop_assert_eq!(sign.at(-a), -sign.at(a));
            prop_assert!(sign.at(a).abs() <= 1.0 && sign.at(a) * a >= 0.0);
            prop_assert!((sign.at(a) - sign.at(b)) * (a - b) >= -1e-12);
            prop_assert!((sign.at(sign.tanh_width()) - 1.0_f64.tanh()).abs() < 1e-12);
            prop_assert!(sign.at(1e6) > 1.0 - 1e-6);
        }
    }

    #[test]
    fn other_ways_to_turn_are_tried_within_the_same_speed() {
        let found = values(WIDTH, [0.02]).remove(0);
        let near = signs_near(&found, 3);
        let ways: Vec<Sign> = near.iter().map(Sign::of).filter(|sign| sign.power > 0.0).collect();
        assert_eq!(ways.len(), 3);
        assert!(ways.iter().all(|sign| (sign.tanh_width() - 0.02).abs() < 1e-12));
        assert!(
            signs_near(&values(WIDTH, [0.0]).remove(0), 0).iter().all(|near| Sign::of(near).width == 0.0)
        );
        let back = signs_near(&near[near.len() - 1], 0);
        assert!(back.iter().map(Sign::of).any(|sign| sign.power == 0.0 && (sign.width - 0.02).abs() < 1e-12));
    }

    /// MuJoCo's friction loss is a straight line up to its end, and the full friction beyond it.
    #[test]
    fn the_largest_power_is_a_straight_line_to_a_part_in_twelve() {
        let sign = Sign { width: 0.05, power: STRAIGHT, lead: 0.0 };
        for step in -400..=400 {
            let velocity = f64::from(step) * 5e-4;
            let line = (velocity / 0.05).clamp(-1.0, 1.0);
            assert!((sign.at(velocity) - line).abs() < 1.0 / 12.0, "{velocity}");
        }
    }

    #[test]
    fn leads_are_tried_also_of_a_plain_sign_and_stay_short() {
        let plain = values(WIDTH, [0.0]).remove(0);
        let leads: Vec<f64> = signs_near(&plain, 0).iter().map(|near| Sign::of(near).lead).collect();
        assert!(leads.iter().any(|lead| *lead > 0.0) && leads.iter().all(|lead| *lead >= 0.0));
        let over_a_way: Constants =
            plain.clone().into_iter().chain([(DEFLECTION.to_owned(), 1e-4)]).collect();
        assert!(signs_near(&over_a_way, 0).iter().all(|near| Sign::of(near).lead == 0.0));
        let mut found: Constants = plain.into_iter().chain([(LEAD.to_owned(), 0.01)]).collect();
        // One that leads may turn over a speed, which it could not before.
        assert!(signs_near(&found, 1).iter().any(|near| Sign::of(near).width > 0.0));
        for _ in 0..20 {
            let near = signs_near(&found, 0);
            assert!(near.iter().all(|near| Sign::of(near).lead <= LONGEST_LEAD));
            found = near.into_iter().max_by(|a, b| a[LEAD].total_cmp(&b[LEAD])).unwrap();
        }
    }
}
