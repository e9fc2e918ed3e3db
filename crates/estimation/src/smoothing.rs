//! The motion between encoders' readings, as it most likely was under what is believed.
//!
//! A spline of the readings alone ([`MotionLog::of_encoders`]) knows neither the commands nor the robot.
//! Where encoders are coarse beside what noise does within a period, or read once a period, its accelerations
//! are wrong by as much as the noise moved them, and an estimate takes that for inertia. Given a belief, a
//! motion has a likelihood: of the readings, of the noise that the motion asks for beside the commands
//! (stationary, with the correlation ρ from one period to the next, all joints coupled by the mass matrix A),
//! and of how an acceleration decays within a period, A·ȧ = −F·a. What is most likely is least squares over
//! the angles and speeds at all commands, whose normal equations are a band.
//!
//! With the belief after it, it is the two halves of the EM algorithm (Dempster, Laird & Rubin 1977): the
//! squares that the estimate wants are means over all motions that the readings leave possible, which are
//! those of the most likely one and what their spread adds. The spread is seen in one motion that is drawn.

use super::banded::Banded;
use super::evidence::instants;
use super::foresight;
use super::in_order::Colour;
use super::readings::{CUBIC, Readings};
use super::sensitivity::{Sensitivity, element};
use super::turning::{Believed, Turned};
use crate::{EstimationError, MotionLog};
use faer::Mat;
use phiw_dynamics::dense::Cholesky;
use phiw_identification::Design;
use phiw_regressor::factor::{Factor, FactorBuilder};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What is believed of a robot and its noise.
pub(super) struct Belief<'a> {
    pub design: &'a Design,
    pub foreseen: &'a [bool],
    /// Parameters of the design.
    pub w: &'a [f64],
    pub colours: &'a [Colour],
    /// Standard deviation of what is new in the noise of each period \[N·m, N\].
    pub std: &'a [f64],
    /// Time between instants at which inertias are looked at \[s\].
    pub instant_every_s: f64,
    /// Standard deviation of A·ȧ + F·a over a period, over that of the noise.
    pub decay_error: f64,
    /// Standard deviation of a reading, over that of rounding.
    pub reading_error: f64,
}

/// A motion as it most likely was, and how it may have been beside.
pub(super) struct Smoothed {
    /// The most likely one.
    pub most_likely: MotionLog,
    /// One of those that the readings leave possible, drawn: under a right belief it is to all tests like the
    /// true one.
    pub drawn: MotionLog,
    /// What the spread of all possible motions adds to the squares of each torque: rows of its columns.
    pub spread: Vec<Factor>,
    /// What it adds to the squares of the noise before, of the products with the noise after, and of the
    /// noise after, for each torque.
    pub noise: Vec<[f64; 3]>,
}

/// A motion whose angles and speeds (times the period) at all commands are others by so much.
fn moved_by(motion: &MotionLog, away: &[f64]) -> MotionLog {
    let mut log = motion.clone();
    for (index, pair) in away.chunks_exact(2).enumerate() {
        log.q[index] += pair[0];
        log.qd[index] += pair[1] / log.period_s;
    }
    log
}

/// Shares of the unknowns of three knots, each an angle and a speed times the period of every joint, in what
/// is new in the noise of a torque: the period's own two come last. `row` is that of the torque in the mass
/// and damping matrices, and the period \[s\]; inertias change little from one period to the next.
pub(super) fn noise_shares(row: (&[f64], &[f64], f64), correlation: f64, shares: &mut [f64]) {
    let (inertia, damping, t) = row;
    let n = inertia.len();
    shares.fill(0.0);
    for joint in 0..n {
        let (by_speed, by_way) = (inertia[joint] / (t * t), damping[joint] / (t * t));
        let at = 2 * joint;
        for (first, share) in [(2 * n, 1.0), (0, -correlation)] {
            shares[first + at] -= share * by_way;
            shares[first + 2 * n + at] += share * by_way;
            shares[first + at + 1] -= share * by_speed;
            shares[first + 2 * n + at + 1] += share * by_speed;
        }
    }
}

/// Mass and damping matrices that stand for a stretch of periods.
pub(super) struct Stretch {
    pub periods: std::ops::Range<usize>,
    sensitivity: Sensitivity,
    pub inertia: Vec<f64>,
    pub damping: Vec<f64>,
}

impl Belief<'_> {
    /// The motion of a log of encoders; none where it has no readings, or rows that do not count.
    pub fn smoothed(&self, measured: &MotionLog, seed: u64) -> Result<Option<Smoothed>, EstimationError> {
        let Some(readings) = &measured.readings else { return Ok(None) };
        let joints = measured.joints;
        let periods = measured.rows().saturating_sub(1);
        if !measured.still.is_empty() || periods < 3 {
            return Ok(None);
        }
        if !readings.fits(periods, joints) {
            return Err(EstimationError::Log(
                "its encoders' readings are not of its rows, or were written down by an earlier version: read the \
                 log again",
            ));
        }
        let stretches = self.stretches(measured)?;
        let asked = self.asked(measured)?;
        let (t, n) = (measured.period_s, joints);
        let unknown = |knot: usize, joint: usize| 2 * (knot * n + joint);
        let system = self.system(measured, readings, (&stretches, &asked));
        let (factor, moved) = system.solve();
        let most_likely = moved_by(measured, &moved);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut drawn: Vec<f64> = (0..moved.len()).map(|_| StandardNormal.sample(&mut rng)).collect();
        factor.solve_upper(&mut drawn);
        // How far the accelerations of the one that was drawn are from the most likely ones.
        let acceleration = |period: usize, joint: usize| {
            let speed = |knot: usize| drawn[unknown(knot, joint) + 1];
            (speed(period + 1) - speed(period)) / (t * t)
        };
        let away: Vec<f64> = (0..periods * n).map(|index| acceleration(index / n, index % n)).collect();
        let (spread, noise) = self.spread(&stretches, &away, n)?;
        let drawn = moved_by(&most_likely, &drawn);
        Ok(Some(Smoothed { most_likely, drawn, spread, noise }))
    }

    /// The normal equations of the angles and speeds (times the period) at all commands: what they are beside
    /// those of the log.
    pub(super) fn system(
        &self,
        measured: &MotionLog,
        readings: &Readings,
        (stretches, asked): (&[Stretch], &[f64]),
    ) -> Banded {
        let (joints, periods) = (measured.joints, measured.rows() - 1);
        let (t, n) = (measured.period_s, joints);
        let unknown = |knot: usize, joint: usize| 2 * (knot * n + joint);
        let value = |knot: usize, joint: usize| {
            let at = knot * n + joint;
            [measured.q[at], t * measured.qd[at]]
        };
        let mut system = Banded::new(2 * n * (periods + 1), 6 * n);
        for period in 0..periods {
            for joint in 0..n {
                let ([q0, v0], [q1, v1]) = (value(period, joint), value(period + 1, joint));
                let (products, left) = readings.of_period(period, joint, [q0, v0, q1, v1]);
                let precision = (self.reading_error * readings.noise[joint]).max(f64::MIN_POSITIVE).powi(-2);
                let first = unknown(period, joint);
                let place = |index: usize| first + index % 2 + if index < 2 { 0 } else { 2 * n };
                for row in 0..CUBIC {
                    system.add_right(place(row), precision * left[row]);
                    for column in 0..=row {
                        system.add_element(place(row), place(column), precision * products[row][column]);
                    }
                }
            }
        }
        let mut shares = vec![0.0; 6 * n];
        for stretch in stretches {
            for period in stretch.periods.clone() {
                let cubic = |joint: usize| {
                    let ([q0, v0], [q1, v1]) = (value(period, joint), value(period + 1, joint));
                    (12.0 * (q0 - q1) + 6.0 * (v0 + v1), v1 - v0)
                };
                for torque in 0..n {
                    let row = torque * n..(torque + 1) * n;
                    let (inertia, damping) = (&stretch.inertia[row.clone()], &stretch.damping[row]);
                    let Colour { correlation, .. } = self.colours[torque];
                    let left = -asked[period * n + torque]
                        + if period == 0 { 0.0 } else { correlation * asked[(period - 1) * n + torque] };
                    let weight = self.weight(torque, period);
                    noise_shares((inertia, damping, t), self.correlation(torque, period), &mut shares);
                    match period {
                        0 => system.add(0, &shares[2 * n..], left, weight),
                        _ => system.add(unknown(period - 1, 0), &shares, left, weight),
                    }
                    // How the acceleration decays within the period.
                    shares.fill(0.0);
                    let mut left = 0.0;
                    for joint in 0..n {
                        let (by_change, by_speed) = (inertia[joint] / (t * t), damping[joint] / (t * t));
                        let (change, speed) = cubic(joint);
                        left -= by_change * change + by_speed * speed;
                        let at = 2 * joint;
                        shares[at] += 12.0 * by_change;
                        shares[2 * n + at] -= 12.0 * by_change;
                        shares[at + 1] += 6.0 * by_change - by_speed;
                        shares[2 * n + at + 1] += 6.0 * by_change + by_speed;
                    }
                    let noise = self.std[torque] / (1.0 - correlation * correlation).sqrt();
                    let weight = (self.decay_error * noise).powi(-2);
                    system.add(unknown(period, 0), &shares[..4 * n], left, weight);
                }
            }
        }
        system
    }

    /// Correlation with the period before, of which the first has none.
    pub(super) fn correlation(&self, torque: usize, period: usize) -> f64 {
        if period == 0 { 0.0 } else { self.colours[torque].correlation }
    }

    /// Weight of what is new in the noise of a period; of the first all of it is.
    pub(super) fn weight(&self, torque: usize, period: usize) -> f64 {
        let correlation = self.colours[torque].correlation;
        let of_first = if period == 0 { 1.0 - correlation * correlation } else { 1.0 };
        of_first * self.std[torque].powi(-2)
    }

    pub(super) fn stretches(&self, measured: &MotionLog) -> Result<Vec<Stretch>, EstimationError> {
        let block = measured.over_periods();
        let foreseen = |parameter: usize| self.foreseen.get(parameter).copied().unwrap_or(false);
        let w = super::likelihood::column(self.w);
        let (mut first, n) = (0, measured.joints);
        let mut stretches = Vec::new();
        for instant in instants(&block, measured.period_s, self.instant_every_s) {
            let sensitivity = Sensitivity::of(self.design, (&instant, &Turned::default()), &[], foreseen)?;
            let matrix = |columns: &Mat<f64>| -> Vec<f64> {
                let packed = columns * &w;
                let packed = packed.col_as_slice(0);
                (0..n * n)
                    .map(|index| element(packed, (index / n).max(index % n), (index / n).min(index % n)))
                    .collect()
            };
            let end = first + instant.weight as usize;
            let (inertia, damping) = (matrix(&sensitivity.inertia), matrix(&sensitivity.damping));
            stretches.push(Stretch { periods: first..end, sensitivity, inertia, damping });
            first = end;
        }
        Ok(stretches)
    }

    pub(super) fn believed(&self) -> Believed {
        Believed { parameters: self.w.to_vec(), standing_on: Vec::new() }
    }

    /// The noise that the log's own motion asks for: the model's torque less what was commanded, and the
    /// share that was felt of what the log has beside, `[period × torque]`.
    pub(super) fn asked(&self, measured: &MotionLog) -> Result<Vec<f64>, EstimationError> {
        let tree = self.design.tree();
        let limits: Vec<f64> = (0..measured.joints).map(|joint| tree.joint(joint).limits.effort).collect();
        let commands = measured.commands(&limits);
        let nothing = vec![false; self.w.len()];
        let foreseen = if self.foreseen.is_empty() { &nothing } else { self.foreseen };
        let mut asked = Vec::with_capacity(commands.len());
        foresight::rows(self.design, foreseen, (measured, Some(&self.believed())), |row| {
            for (layout, colour) in self.design.rows().iter().zip(self.colours) {
                let logged = row[layout.range.end - 1];
                let command = commands[asked.len()];
                let felt = command + colour.felt * (logged - command);
                asked.push(layout.torque(row, self.w) - felt);
            }
            Ok(())
        })?;
        Ok(asked)
    }

    /// What the spread of the motions adds to the squares of each torque's columns and to those of its noise.
    fn spread(
        &self,
        stretches: &[Stretch],
        away: &[f64],
        n: usize,
    ) -> Result<(Vec<Factor>, Vec<[f64; 3]>), EstimationError> {
        let rows = self.design.rows();
        let mut builders: Vec<FactorBuilder> =
            rows.iter().map(|layout| FactorBuilder::new(layout.parameters.len() + 1)).collect();
        let mut noise = vec![[0.0; 3]; n];
        let mut columns = Vec::new();
        for stretch in stretches {
            // Sums of products of the accelerations: before with before, before with after, after with after.
            let mut products = [0; 3].map(|_| vec![0.0; n * n]);
            for period in stretch.periods.start.max(1)..stretch.periods.end {
                let (before, after) =
                    (&away[(period - 1) * n..period * n], &away[period * n..(period + 1) * n]);
                for (products, [left, right]) in
                    products.iter_mut().zip([[before, before], [before, after], [after, after]])
                {
                    for (row, left) in products.chunks_exact_mut(n).zip(left) {
                        row.iter_mut().zip(right).for_each(|(product, right)| *product += left * right);
                    }
                }
            }
            for torque in 0..n {
                let inertia = &stretch.inertia[torque * n..(torque + 1) * n];
                for (noise, products) in noise[torque].iter_mut().zip(&products) {
                    let rows = products.chunks_exact(n).zip(inertia);
                    *noise += rows
                        .map(|(row, left)| left * row.iter().zip(inertia).map(|(a, b)| a * b).sum::<f64>())
                        .sum::<f64>();
                }
                let rho = self.colours[torque].correlation;
                let news = |row: usize, column: usize| {
                    let at = |products: &[f64], row: usize, column: usize| products[row * n + column];
                    at(&products[2], row, column)
                        - rho * (at(&products[1], row, column) + at(&products[1], column, row))
                        + rho * rho * at(&products[0], row, column)
                };
                let trace: f64 = (0..n).map(|joint| news(joint, joint)).sum();
                let least = f64::EPSILON.sqrt() * trace / n as f64;
                let Some(root) = Cholesky::of(n, |row, column| {
                    news(row, column) + if row == column { least } else { 0.0 }
                }) else {
                    continue;
                };
                for direction in 0..n {
                    columns.clear();
                    for &parameter in &rows[torque].parameters {
                        let packed = stretch.sensitivity.inertia.col_as_slice(parameter);
                        let along = |joint: usize| {
                            root.entry(joint, direction)
                                * element(packed, torque.max(joint), torque.min(joint))
                        };
                        columns.push((direction..n).map(along).sum::<f64>());
                    }
                    columns.push(0.0);
                    builders[torque].push_row(&columns)?;
                }
            }
        }
        Ok((builders.iter_mut().map(FactorBuilder::factor).collect(), noise))
    }
}
