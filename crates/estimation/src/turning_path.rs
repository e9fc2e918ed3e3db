//! The way of a velocity through a period in which friction slows it.
//!
//! Of a joint that is driven by what does not change within the period, dv/ds = α − φ(v) from s = 0 to 1, φ
//! the change of velocity that its friction makes in a period. A way that is known at both ends tells α: the
//! time that it takes is ∫dv/(α − φ(v)) = 1. The velocity only ever goes one way, also where the joint comes
//! to rest, so that means over the period are integrals over velocities; φ and columns are straight lines
//! between the places of a table, and each integral is known in closed form.

/// Places of the table for each power of ten of the velocity.
const PER_DECADE: i32 = 12;
/// Powers of ten \[rad/s, m/s\] of the smallest and the largest velocity of the table.
const DECADES: (i32, i32) = (-4, 3);
/// Steps at most in which α is found, and how exactly.
const MOST_STEPS: usize = 60;
const EXACT: f64 = 1e-10;
/// Logarithm of the largest friction over what a drive is beyond it, where a joint is as good as at rest.
const LONGEST: f64 = 27.0;
/// Relative change of α − φ on a straight line below which logarithms lose more digits than a series.
const NEARLY_EQUAL: f64 = 1e-3;

/// The velocities of the table, ascending; zero is in the middle.
pub(super) fn velocities() -> Vec<f64> {
    let steps = PER_DECADE * (DECADES.1 - DECADES.0);
    let up =
        (0..=steps).map(|step| 10.0_f64.powf(f64::from(DECADES.0) + f64::from(step) / f64::from(PER_DECADE)));
    let up: Vec<f64> = up.collect();
    up.iter().rev().map(|velocity| -velocity).chain([0.0]).chain(up.iter().copied()).collect()
}

/// The value of a table at a velocity.
pub(super) fn interpolated(velocities: &[f64], values: &[f64], velocity: f64) -> f64 {
    let next = velocities.partition_point(|own| *own <= velocity).clamp(1, velocities.len() - 1);
    let (from, to) = (velocities[next - 1], velocities[next]);
    let share = ((velocity - from) / (to - from)).clamp(0.0, 1.0);
    values[next - 1] + share * (values[next] - values[next - 1])
}

/// A way through a period: places in the order in which they are passed, and what each counts for in a mean
/// over the period and in how that mean changes with α. Buffers are used again from way to way.
#[derive(Default)]
pub(super) struct Way {
    /// Places of the table that are passed in between, and whether downwards.
    between: std::ops::Range<usize>,
    downwards: bool,
    speeds: Vec<f64>,
    friction: Vec<f64>,
    /// ∫ of each place's share over α − φ, and over its square.
    means: Vec<f64>,
    slopes: Vec<f64>,
    /// dv₁/dα.
    end_by_drive: f64,
    /// Share of the period in which the joint is at rest.
    rest: f64,
}

impl Way {
    /// Lays the way from one velocity to another, which differ, through a friction that is `scale` times the
    /// `table`'s.
    pub fn lay(&mut self, [begin, end]: [f64; 2], velocities: &[f64], table: Option<&[f64]>, scale: f64) {
        self.downwards = end < begin;
        let (low, high) = (begin.min(end), begin.max(end));
        let first = velocities.partition_point(|own| *own <= low);
        self.between = first..velocities.partition_point(|own| *own < high).max(first);
        let between = velocities[self.between.clone()].iter().copied();
        self.speeds.clear();
        self.speeds.push(low);
        self.speeds.extend(between);
        self.speeds.push(high);
        self.friction.clear();
        match table {
            Some(table) if scale != 0.0 => {
                let inner = table[self.between.clone()].iter().map(|friction| scale * friction);
                self.friction.push(scale * interpolated(velocities, table, low));
                self.friction.extend(inner);
                self.friction.push(scale * interpolated(velocities, table, high));
            }
            _ => self.friction.resize(self.speeds.len(), 0.0),
        }
        // Downwards is upwards with all signs turned.
        let sign = if self.downwards { -1.0 } else { 1.0 };
        let most = self.friction.iter().map(|friction| sign * friction).fold(f64::NEG_INFINITY, f64::max);
        let beyond = self.drive_beyond(sign, most, high - low);
        self.weigh(sign, most + beyond);
    }

    /// By how much the drive is beyond the largest friction on the way, so that the way takes one period.
    fn drive_beyond(&self, sign: f64, most: f64, change: f64) -> f64 {
        let least = self.friction.iter().map(|friction| sign * friction).fold(f64::INFINITY, f64::min);
        if most - least < EXACT * change {
            return change;
        }
        // With this much the way takes no longer than a period, and the time falls as it grows.
        let (mut low, mut high) = (f64::NEG_INFINITY, change.ln());
        let at_rest = most.abs().max(least.abs()).max(change).ln() - LONGEST;
        let mut log = high;
        for _ in 0..MOST_STEPS {
            let (time, slope) = self.time(sign, most + log.exp());
            if (time - 1.0).abs() < EXACT {
                break;
            }
            if time > 1.0 {
                low = log
            } else {
                high = log
            }
            // Newton's step of log time by log drive, which bends little.
            let newton = log - time.ln() * time / (slope * log.exp());
            let middle = if low.is_finite() { 0.5 * (low + high) } else { high - 4.0 };
            log = if newton > low && newton < high { newton } else { middle };
            // It comes to rest before the period ends.
            if log < at_rest {
                return at_rest.exp();
            }
        }
        log.exp()
    }

    /// How long the way takes under a drive, and the derivative by it.
    fn time(&self, sign: f64, drive: f64) -> (f64, f64) {
        let (mut time, mut slope) = (0.0, 0.0);
        for (speeds, frictions) in self.speeds.windows(2).zip(self.friction.windows(2)) {
            let change = speeds[1] - speeds[0];
            let [from, to] = [drive - sign * frictions[0], drive - sign * frictions[1]];
            time += change * Straight::of(from, to).inverse.iter().sum::<f64>();
            slope -= change / (from * to);
        }
        (time, slope)
    }

    fn weigh(&mut self, sign: f64, drive: f64) {
        self.means.clear();
        self.means.resize(self.speeds.len(), 0.0);
        self.slopes.clear();
        self.slopes.resize(self.speeds.len(), 0.0);
        for place in 1..self.speeds.len() {
            let change = self.speeds[place] - self.speeds[place - 1];
            let [from, to] = [place - 1, place].map(|place| drive - sign * self.friction[place]);
            let straight = Straight::of(from, to);
            for (own, which) in [(place - 1, 0), (place, 1)] {
                self.means[own] += change * straight.inverse[which];
                self.slopes[own] += change * straight.square[which];
            }
        }
        let end = if self.downwards { 0 } else { self.speeds.len() - 1 };
        // What is left of the period the joint is at rest.
        self.rest = 1.0 - self.means.iter().sum::<f64>();
        self.means[end] += self.rest;
        self.end_by_drive = (drive - sign * self.friction[end]) * self.slopes.iter().sum::<f64>();
    }

    /// The mean of a column that a table has, and its slope by the velocity at the end, along what changes
    /// the drive.
    pub fn mean_of(&self, velocities: &[f64], table: &[f64]) -> [f64; 2] {
        let [low, high] =
            [self.speeds[0], self.speeds[self.speeds.len() - 1]].map(|v| interpolated(velocities, table, v));
        let last = self.means.len() - 1;
        let at_end = if self.downwards { low } else { high };
        let (mut mean, mut slope) = (0.0, 0.0);
        let between = &table[self.between.clone()];
        let value = |place: usize| match place {
            0 => low,
            place if place == last => high,
            place => between[place - 1],
        };
        for (place, (weight, by_drive)) in self.means.iter().zip(&self.slopes).enumerate() {
            let value = value(place);
            mean += weight * value;
            slope += by_drive * (at_end - value);
        }
        let [from, to] = if self.downwards { [1, 0] } else { [last - 1, last] };
        let at_rest = (value(to) - value(from)) / (self.speeds[to] - self.speeds[from]);
        let sign = if self.downwards { -1.0 } else { 1.0 };
        [mean, sign * slope / self.end_by_drive + self.rest * at_rest]
    }
}

/// Integrals over a straight line d from `from` to `to`, u from 0 to 1.
struct Straight {
    /// ∫(1 − u)·du/d and ∫u·du/d.
    inverse: [f64; 2],
    /// ∫(1 − u)·du/d² and ∫u·du/d².
    square: [f64; 2],
}

impl Straight {
    fn of(from: f64, to: f64) -> Self {
        let bend = to / from - 1.0;
        if bend.abs() < NEARLY_EQUAL {
            let (linear, square) = (bend, bend * bend);
            let inverse = [0.5 - linear / 6.0 + square / 12.0, 0.5 - linear / 3.0 + square / 4.0];
            let squares = [0.5 - linear / 3.0 + square / 4.0, 0.5 - 2.0 * linear / 3.0 + 0.75 * square];
            return Straight {
                inverse: inverse.map(|share| share / from),
                square: squares.map(|share| share / (from * from)),
            };
        }
        let whole = bend.ln_1p() / (to - from);
        Straight {
            inverse: [(1.0 - to * whole) / (from - to), (1.0 - from * whole) / (to - from)],
            square: [(whole - 1.0 / from) / (from - to), (whole - 1.0 / to) / (to - from)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const WIDTH: f64 = 0.01;

    /// A joint that is driven by `drive` and rubs with `friction` \[change of velocity in a period\],
    /// integrated finely: its velocity at the end, and the mean of the friction's column.
    fn driven(begin: f64, drive: f64, friction: f64) -> [f64; 2] {
        const STEPS: usize = 20_000;
        let (mut velocity, mut column) = (begin, 0.0);
        for _ in 0..STEPS {
            let middle = velocity + 0.5 * (drive - friction * (velocity / WIDTH).tanh()) / STEPS as f64;
            let turned = (middle / WIDTH).tanh();
            velocity += (drive - friction * turned) / STEPS as f64;
            column += turned / STEPS as f64;
        }
        [velocity, column]
    }

    /// The joint reverses, sticks and moves on; the velocities at both ends tell the rest.
    #[test]
    fn the_way_of_a_joint_that_is_driven_comes_back_from_its_ends() {
        let velocities = velocities();
        let table: Vec<f64> = velocities.iter().map(|velocity| (velocity / WIDTH).tanh()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut way = Way::default();
        for _ in 0..300 {
            let friction = 10.0_f64.powf(rng.random_range(-2.0..0.3));
            let begin = rng.random_range(-1.5..1.5) * friction;
            let drive = rng.random_range(-3.0..3.0) * friction;
            let [end, column] = driven(begin, drive, friction);
            let step = 1e-3 * friction;
            let by_drive = (driven(begin, drive + step, friction)[0]
                - driven(begin, drive - step, friction)[0])
                / (2.0 * step);
            way.lay([begin, end], &velocities, Some(&table), friction);
            let [value, slope] = way.mean_of(&velocities, &table);
            let factor = (1.0 + friction * slope) * by_drive;
            let case = format!("{friction} {begin} {drive} {end}: {value} {column}, {factor}");
            assert!((value - column).abs() < 0.02, "{case}");
            assert!(factor.ln().abs() < 0.2 || by_drive < 0.02, "{case}");
        }
    }

    #[test]
    fn without_friction_the_acceleration_is_constant() {
        let velocities = velocities();
        let table: Vec<f64> = velocities.iter().map(|velocity| (velocity / WIDTH).tanh()).collect();
        let mut way = Way::default();
        for (begin, end) in [(0.1, 0.3), (0.1, -0.1), (-0.02, 0.08), (0.0, 0.01), (-0.3, -0.2), (0.06, -0.01)]
        {
            way.lay([begin, end], &velocities, None, 0.0);
            let [value, slope] = way.mean_of(&velocities, &table);
            let integral = |v: f64| WIDTH * (v / WIDTH).cosh().ln();
            let exact = (integral(end) - integral(begin)) / (end - begin);
            let exact_slope = ((end / WIDTH).tanh() - exact) / (end - begin);
            assert!((value - exact).abs() < 5e-3, "{begin} {end}: {value}, {exact}");
            assert!(
                (slope - exact_slope).abs() < 0.01 * exact_slope + 0.1,
                "{begin} {end}: {slope}, {exact_slope}"
            );
        }
    }

    /// What an estimate passes may push in one direction: two numbers of infinite size cancelled.
    #[test]
    fn a_friction_that_pushes_in_one_direction_leaves_a_way() {
        let velocities = velocities();
        let pushes = |velocity: &f64| if *velocity == 0.0 { 0.0 } else { -120.0 - velocity.signum() };
        let table: Vec<f64> = velocities.iter().map(pushes).collect();
        let mut way = Way::default();
        for (begin, end) in [(-0.02, 0.01), (0.02, -0.01), (0.0, 0.03)] {
            way.lay([begin, end], &velocities, Some(&table), 520.0);
            let [value, slope] = way.mean_of(&velocities, &table);
            assert!(value.is_finite() && slope.is_finite(), "{begin} {end}: {value}, {slope}");
        }
    }
}
