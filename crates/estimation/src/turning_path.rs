//! The way of a velocity through a period in which friction slows it.
//!
//! Of a joint that is driven by what does not change within the period, dv/ds = α − φ(v) from s = 0 to 1, φ
//! the change of velocity that friction and damping make in a period. A way that is known at both ends tells
//! α: the time that it takes is ∫dv/(α − φ(v)) = 1. The velocity only ever goes one way, also where the joint
//! comes to rest, so that means over the period are integrals over velocities; φ and columns are straight
//! lines between the places of a table, and each integral is known in closed form.
//!
//! What follows the noise is dα/dv₁ = 1/((α − φ(v₁))·∫1/(α − φ)²). More friction makes another way between
//! the same ends: the mean and its slope are those under the friction that laid it.

/// Places of the table for each power of ten of the velocity.
const PER_DECADE: i32 = 12;
/// Powers of ten \[rad/s, m/s\] of the smallest and the largest velocity of the table.
const DECADES: (i32, i32) = (-4, 3);
/// Steps at most in which α is found, and how exactly.
const MOST_STEPS: usize = 60;
const EXACT: f64 = 1e-10;
/// Logarithm of the largest friction over what a drive is beyond the one in its way, where a joint is as good
/// as at rest.
const LONGEST: f64 = 27.0;
/// Share of a period at rest from which on a joint rests: it stays where it is, however much more friction it
/// has.
const AT_REST: f64 = 1e-6;
/// Relative change of α − φ on a straight line below which logarithms lose more digits than a series.
const NEARLY_EQUAL: f64 = 1e-3;
/// Newton steps from what damping leaves to the damping.
const DAMPING_STEPS: usize = 8;

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
    squares: Vec<f64>,
    /// The sum of the latter.
    square: f64,
    /// α − φ at the end.
    end: f64,
    /// What damping takes of a velocity in a period, over the velocity.
    damping: f64,
    /// Share of the period in which the joint is at rest.
    rest: f64,
}

impl Way {
    /// Lays the way from one velocity to another, which differ, through a friction that is `scale` times the
    /// `table`'s, and damping.
    pub fn lay(
        &mut self,
        [begin, end]: [f64; 2],
        (velocities, table): (&[f64], Option<&[f64]>),
        Slowed { scale, damping }: Slowed,
    ) {
        self.damping = damping;
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
        let speeds = self.speeds.iter();
        self.friction.iter_mut().zip(speeds).for_each(|(friction, speed)| *friction += damping * speed);
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
        for weights in [&mut self.means, &mut self.squares] {
            weights.clear();
            weights.resize(self.speeds.len(), 0.0);
        }
        for place in 1..self.speeds.len() {
            let change = self.speeds[place] - self.speeds[place - 1];
            let [from, to] = [place - 1, place].map(|place| drive - sign * self.friction[place]);
            let straight = Straight::of(from, to);
            for (own, which) in [(place - 1, 0), (place, 1)] {
                self.means[own] += change * straight.inverse[which];
                self.squares[own] += change * straight.square[which];
            }
        }
        let end = if self.downwards { 0 } else { self.speeds.len() - 1 };
        // What is left of the period the joint is at rest.
        self.rest = 1.0 - self.means.iter().sum::<f64>();
        self.means[end] += self.rest;
        self.square = self.squares.iter().sum();
        self.end = drive - sign * self.friction[end];
    }

    /// What the log-determinant of the period has beside the slopes of frictions, since more friction also
    /// changes what damping takes: to add to Σ `scale`·θ·slope.
    pub fn beside(&self) -> f64 {
        if self.rest > AT_REST || self.damping == 0.0 {
            return 0.0;
        }
        let sign = if self.downwards { -1.0 } else { 1.0 };
        let end = if self.downwards { self.speeds[0] } else { self.speeds[self.speeds.len() - 1] };
        let square: f64 = self.squares.iter().zip(&self.speeds).map(|(square, speed)| square * speed).sum();
        let undamped = 1.0 / Slowed { scale: 1.0, damping: self.damping }.share();
        1.0 + self.damping * sign * (end - square / self.square) / self.end - undamped
    }

    /// The mean of a column that a table has.
    pub fn mean_of(&self, velocities: &[f64], table: &[f64]) -> Mean {
        let [low, high] =
            [self.speeds[0], self.speeds[self.speeds.len() - 1]].map(|v| interpolated(velocities, table, v));
        let last = self.means.len() - 1;
        let at_end = if self.downwards { low } else { high };
        let between = &table[self.between.clone()];
        let column = |place: usize| match place {
            0 => low,
            place if place == last => high,
            place => between[place - 1],
        };
        let (mut value, mut square) = (0.0, 0.0);
        for (place, (mean, by_square)) in self.means.iter().zip(&self.squares).enumerate() {
            let column = column(place);
            value += mean * column;
            square += by_square * column;
        }
        let sign = if self.downwards { -1.0 } else { 1.0 };
        let mut slope = sign * (at_end - square / self.square) / self.end;
        if self.rest > AT_REST {
            let [from, to] = if self.downwards { [1, 0] } else { [last - 1, last] };
            slope += self.rest * (column(to) - column(from)) / (self.speeds[to] - self.speeds[from]);
        }
        Mean { value, slope, beside: 0.0 }
    }
}

/// What slows a joint within a period: by how much a torque of one changes its velocity were it not damped
/// \[rad/s for a N·m, m/s for a N\], and what damping takes of a velocity, over the velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slowed {
    pub scale: f64,
    pub damping: f64,
}

impl Slowed {
    /// From what a torque of one changes a velocity by, without damping and with it.
    pub fn of(scale: f64, damped: f64) -> Self {
        // damped/scale = (1 − e⁻ˣ)/x.
        let share = damped / scale;
        if !(share > 0.0 && share < 1.0) {
            return Slowed { scale, damping: 0.0 };
        }
        let mut damping = 2.0 * (1.0 - share);
        for _ in 0..DAMPING_STEPS {
            let decay = (-damping).exp();
            let value = -(-damping).exp_m1() / damping;
            let slope = (decay - value) / damping;
            damping = (damping - (value - share) / slope).max(0.5 * damping);
        }
        Slowed { scale, damping: if damping.is_finite() { damping } else { 0.0 } }
    }

    /// What a torque of one changes a velocity by with damping, over what it does without.
    fn share(self) -> f64 {
        if self.damping < 1e-6 { 1.0 } else { -(-self.damping).exp_m1() / self.damping }
    }
}

/// The mean of a column over a period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mean {
    /// The mean itself.
    pub value: f64,
    /// Its slope by the velocity at the end.
    pub slope: f64,
    /// What the slope of its joint has beside those of columns, with the first of them.
    pub beside: f64,
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

    /// A joint that is driven by `drive`, rubs with `friction` and is damped \[changes of velocity in a
    /// period\], integrated finely: its velocity at the end, and the mean of the friction's column.
    fn driven(begin: f64, drive: f64, friction: f64, damping: f64) -> [f64; 2] {
        const STEPS: usize = 20_000;
        let (mut velocity, mut column) = (begin, 0.0);
        let slowed = |velocity: f64| friction * (velocity / WIDTH).tanh() + damping * velocity;
        for _ in 0..STEPS {
            let middle = velocity + 0.5 * (drive - slowed(velocity)) / STEPS as f64;
            velocity += (drive - slowed(middle)) / STEPS as f64;
            column += (middle / WIDTH).tanh() / STEPS as f64;
        }
        [velocity, column]
    }

    fn table() -> Vec<f64> {
        velocities().iter().map(|velocity| (velocity / WIDTH).tanh()).collect()
    }

    /// The joint reverses, sticks and moves on; the velocities at both ends tell the rest.
    #[test]
    fn the_way_of_a_joint_that_is_driven_comes_back_from_its_ends() {
        let (velocities, table) = (velocities(), table());
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut way = Way::default();
        for case in 0..300 {
            let friction = 10.0_f64.powf(rng.random_range(-2.0..0.3));
            let damping = if case % 2 == 0 { 0.0 } else { rng.random_range(0.0..2.0) };
            let begin = rng.random_range(-1.5..1.5) * friction;
            let drive = rng.random_range(-3.0..3.0) * friction;
            let [end, column] = driven(begin, drive, friction, damping);
            let step = 1e-3 * friction;
            let by_drive = (driven(begin, drive + step, friction, damping)[0]
                - driven(begin, drive - step, friction, damping)[0])
                / (2.0 * step);
            let slowed = Slowed { scale: friction, damping };
            way.lay([begin, end], (&velocities, Some(&table)), slowed);
            let Mean { value, slope, .. } = way.mean_of(&velocities, &table);
            let case = format!("{friction} {damping} {begin} {drive} {end}: {value} {column}, {by_drive}");
            assert!((value - column).abs() < 0.02, "{case}");
            let factor = (friction * slope + way.beside() + 1.0 / slowed.share()) * by_drive;
            assert!(factor.ln().abs() < 0.2 || by_drive < 0.03, "{case}: {factor}");
        }
    }

    #[test]
    fn damping_comes_back_from_what_it_leaves() {
        for damping in [1e-4, 0.01, 0.3, 1.0, 5.0, 40.0] {
            let share = Slowed { scale: 1.0, damping }.share();
            let found = Slowed::of(2.0, 2.0 * share).damping;
            assert!((found / damping - 1.0).abs() < 1e-6, "{found}, not {damping}");
        }
        assert_eq!(Slowed::of(2.0, 2.0).damping, 0.0);
    }

    #[test]
    fn without_friction_the_acceleration_is_constant() {
        let (velocities, table) = (velocities(), table());
        let mut way = Way::default();
        for (begin, end) in [(0.1, 0.3), (0.1, -0.1), (-0.02, 0.08), (0.0, 0.01), (-0.3, -0.2), (0.06, -0.01)]
        {
            way.lay([begin, end], (&velocities, None), Slowed::default());
            let Mean { value, slope, .. } = way.mean_of(&velocities, &table);
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
        let table: Vec<f64> =
            velocities.iter().map(|v| if *v == 0.0 { 0.0 } else { -120.0 - v.signum() }).collect();
        let mut way = Way::default();
        for (begin, end) in [(-0.02, 0.01), (0.02, -0.01), (0.0, 0.03)] {
            way.lay([begin, end], (&velocities, Some(&table)), Slowed { scale: 520.0, damping: 640.0 });
            let Mean { value, slope, .. } = way.mean_of(&velocities, &table);
            let all = [value, slope, way.beside()];
            assert!(all.iter().all(|number| number.is_finite()), "{begin} {end}: {all:?}");
        }
    }
}
