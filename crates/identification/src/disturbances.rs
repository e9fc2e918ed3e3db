//! Moments in which something else acted on the robot: a push, a collision, a cable that caught.
//!
//! A model cannot know of them, and a second of them is enough to spoil it: two pushes in 75 s took the names
//! from the frictions of five joints. They are told by two things: what is left of a torque is
//! large there and small at nearly all other times, and in the same state of the joint at other times it is
//! small as well, so that no function of the motion is missing.

use crate::accumulate::Fold;
use crate::predict::{Prediction, predict};
use crate::{BlockSource, Design, IdentificationError};

/// What makes a disturbance. `cargo xtask undeclared --suite wide_right,wide_effects --situation pushes`
/// shows what is found, and `--suite wide_right` what is not there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisturbanceSettings {
    /// Time over which a residual's mean square is taken \[s\].
    pub window_s: f64,
    /// Residual (RMS) over the usual one, the median of all windows, from which on a window is disturbed.
    pub least_ratio: f64,
    /// The same as a share of the largest such ratio: a large disturbance bends the model, which then errs a
    /// little at other times.
    pub least_of_largest: f64,
    /// Share of a torque's squared residual that lies in disturbed windows, at least.
    pub least_share: f64,
    /// Share of the time that they may take.
    pub most_time: f64,
    /// Time for each disturbance that there may be \[s\]: what comes more often belongs to the robot.
    pub least_interval_s: f64,
    /// How near a state is the same one: a share of the ranges of position, velocity and torque.
    pub near: f64,
    /// In how many windows the same state must have been met undisturbed.
    pub least_met: usize,
}

impl Default for DisturbanceSettings {
    fn default() -> Self {
        DisturbanceSettings {
            window_s: 0.1,
            least_ratio: 5.0,
            least_of_largest: 0.2,
            least_share: 0.5,
            most_time: 0.05,
            least_interval_s: 8.0,
            near: 0.1,
            least_met: 3,
        }
    }
}

/// A stretch of a log in which something else acted on the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Disturbance {
    /// Which log of the session.
    pub log: usize,
    /// Its first and its last moment \[s\], in the log's own time.
    pub stretch_s: [f64; 2],
    /// The torques that show it.
    pub torques: Vec<usize>,
    /// Residual (RMS) of the torque that shows it most, over the usual one.
    pub ratio: f64,
}

/// A stretch of [`DisturbanceSettings::window_s`].
#[derive(Clone, Debug, Default)]
struct Window {
    log: usize,
    segment: usize,
    stretch_s: [f64; 2],
    samples: f64,
    /// For each torque the mean square of the residual, and whether its joint moves.
    squares: Vec<f64>,
    moves: Vec<bool>,
    /// Mean position, velocity and predicted torque.
    states: Vec<[f64; 3]>,
}

/// The disturbances in some folds, in the order of their logs. None are told of a robot whose torques are not
/// one for each joint, nor of motion that is too short to have a usual residual (5 s).
///
/// A window takes some 200 bytes, and of long logs they are made longer, so that memory stays flat.
///
/// # Errors
/// A log cannot be read, or `parameters` are not of the design.
pub fn disturbances(
    design: &Design,
    parameters: &[f64],
    folds: &[Fold],
    sources: &[&dyn BlockSource],
    settings: &DisturbanceSettings,
) -> Result<Vec<Disturbance>, IdentificationError> {
    let time_s: f64 = folds.iter().map(|fold| fold.end - fold.start).filter(|time| time.is_finite()).sum();
    let window_s = settings.window_s.max(time_s / MOST_WINDOWS);
    let mut windows: Vec<Window> = Vec::new();
    predict(design, parameters, sources, &mut |prediction| {
        let is_inside = folds.iter().any(|fold| fold.contains(prediction.log, prediction.t));
        if is_inside && prediction.q.len() == prediction.measured.len() {
            take(&mut windows, prediction, window_s);
        }
    })?;
    windows.iter_mut().for_each(Window::finish);
    Ok(found(&windows, &DisturbanceSettings { window_s, ..*settings }))
}

fn take(windows: &mut Vec<Window>, prediction: &Prediction<'_>, window_s: f64) {
    let is_next = windows.last().is_none_or(|window| {
        (window.log, window.segment) != (prediction.log, prediction.segment)
            || prediction.t - window.stretch_s[0] >= window_s
    });
    let torques = prediction.measured.len();
    if is_next {
        windows.push(Window {
            log: prediction.log,
            segment: prediction.segment,
            stretch_s: [prediction.t; 2],
            samples: 0.0,
            squares: vec![0.0; torques],
            moves: vec![true; torques],
            states: vec![[0.0; 3]; torques],
        });
    }
    let Some(window) = windows.last_mut() else { return };
    window.stretch_s[1] = prediction.t;
    window.samples += 1.0;
    for torque in 0..torques {
        window.squares[torque] += prediction.residual(torque).powi(2);
        window.moves[torque] &= prediction.counts(torque);
        let now = [prediction.q[torque], prediction.qd[torque], prediction.predicted[torque]];
        window.states[torque].iter_mut().zip(now).for_each(|(sum, value)| *sum += value);
    }
}

impl Window {
    fn finish(&mut self) {
        let count = self.samples.max(1.0);
        self.squares.iter_mut().for_each(|square| *square /= count);
        self.states.iter_mut().flatten().for_each(|value| *value /= count);
    }
}

/// Fewer windows than this have nothing usual.
const FEWEST_WINDOWS: usize = 50;
/// So many windows, some six hours of them, are kept at most.
const MOST_WINDOWS: f64 = 200_000.0;

fn found(windows: &[Window], settings: &DisturbanceSettings) -> Vec<Disturbance> {
    let torques = windows.first().map_or(0, |window| window.squares.len());
    if windows.len() < FEWEST_WINDOWS {
        return Vec::new();
    }
    // Of each torque how far each window is above the usual one; nothing where no few moments stand out.
    let standing_out: Vec<Option<StandingOut>> =
        (0..torques).map(|torque| standing_out(windows, torque, settings)).collect();
    let is_disturbed = |torque: usize, window: usize| {
        standing_out[torque].as_ref().is_some_and(|own| own.ratios[window] > own.least)
    };
    let any = |window: usize| (0..torques).any(|torque| is_disturbed(torque, window));
    let stretches = stretches(windows, any);
    let inside = |window: usize| stretches.iter().any(|(from, to)| (*from..=*to).contains(&window));
    let time_s = windows.len() as f64 * settings.window_s;
    if stretches.len() as f64 > 1.0 + time_s / settings.least_interval_s {
        return Vec::new();
    }
    let ratio_of = |torque: usize, (from, to): (usize, usize)| {
        let own = standing_out[torque].as_ref().map_or(&[][..], |own| &own.ratios[from..=to]);
        own.iter().copied().fold(0.0, f64::max)
    };
    let disturbance = |&(from, to): &(usize, usize)| {
        if begins_or_ends_a_segment(windows, from, to) {
            return None;
        }
        let shown: Vec<usize> =
            (0..torques).filter(|&torque| (from..=to).any(|window| is_disturbed(torque, window))).collect();
        let most = shown
            .iter()
            .copied()
            .max_by(|a, b| ratio_of(*a, (from, to)).total_cmp(&ratio_of(*b, (from, to))))?;
        let own: Vec<usize> = (from..=to).filter(|&window| is_disturbed(most, window)).collect();
        let reach = ranges(windows, most).map(|range| settings.near * range);
        let is_same = |window: usize, other: usize| {
            let states = [window, other].map(|window| windows[window].states[most]);
            (0..3).all(|signal| (states[0][signal] - states[1][signal]).abs() <= reach[signal])
        };
        let met = own.iter().filter(|&&window| {
            let same = (0..windows.len())
                .filter(|&other| !inside(other) && windows[other].moves[most] && is_same(window, other));
            same.count() >= settings.least_met
        });
        (2 * met.count() >= own.len()).then(|| Disturbance {
            log: windows[from].log,
            stretch_s: [windows[from].stretch_s[0], windows[to].stretch_s[1]],
            torques: shown,
            ratio: ratio_of(most, (from, to)),
        })
    };
    stretches.iter().filter_map(disturbance).collect()
}

/// The residual of each window over the usual one, and from where on a window is disturbed, if few such hold
/// most of the squares.
fn standing_out(windows: &[Window], torque: usize, settings: &DisturbanceSettings) -> Option<StandingOut> {
    let mut moving: Vec<f64> =
        windows.iter().filter(|window| window.moves[torque]).map(|window| window.squares[torque]).collect();
    if moving.len() < FEWEST_WINDOWS {
        return None;
    }
    let middle = moving.len() / 2;
    let usual = moving.select_nth_unstable_by(middle, f64::total_cmp).1.max(f64::MIN_POSITIVE);
    let ratios: Vec<f64> = windows.iter().map(|window| (window.squares[torque] / usual).sqrt()).collect();
    let largest = ratios.iter().copied().fold(0.0, f64::max);
    let least = settings.least_ratio.max(settings.least_of_largest * largest);
    let above = ratios.iter().filter(|ratio| **ratio > least);
    let squares = above.clone().map(|ratio| ratio * ratio).sum::<f64>();
    let count = above.count();
    let few = count as f64 <= settings.most_time * ratios.len() as f64;
    let most = squares >= settings.least_share * ratios.iter().map(|ratio| ratio * ratio).sum::<f64>();
    (few && most && count > 0).then_some(StandingOut { ratios, least })
}

/// A torque of which few windows stand out.
struct StandingOut {
    ratios: Vec<f64>,
    least: f64,
}

/// First and last window of each run of disturbed ones, with one window to each side; what one or two windows
/// part is one.
fn stretches(windows: &[Window], is_disturbed: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
    let together =
        |a: usize, b: usize| (windows[a].log, windows[a].segment) == (windows[b].log, windows[b].segment);
    let mut all: Vec<(usize, usize)> = Vec::new();
    for window in (0..windows.len()).filter(|&window| is_disturbed(window)) {
        let from = window.checked_sub(1).filter(|&before| together(before, window)).unwrap_or(window);
        let to = Some(window + 1).filter(|&next| next < windows.len() && together(next, window));
        let to = to.unwrap_or(window);
        match all.last_mut() {
            Some((_, last)) if from <= *last + 2 && together(*last, from) => *last = to,
            _ => all.push((from, to)),
        }
    }
    all
}

/// Whether a run of windows is the first or the last of its segment. There a model errs by itself: nobody
/// knows what the motion before has left in a friction, and derivatives and filters know one side only.
fn begins_or_ends_a_segment(windows: &[Window], from: usize, to: usize) -> bool {
    let segment = |window: usize| windows.get(window).map(|window| (window.log, window.segment));
    let before = from.checked_sub(1).and_then(segment);
    before != segment(from) || segment(to + 1) != segment(to)
}

/// How far a joint's position, velocity and torque reach.
fn ranges(windows: &[Window], torque: usize) -> [f64; 3] {
    std::array::from_fn(|signal| {
        let all = windows.iter().map(|window| window.states[torque][signal]);
        let (low, high) = all
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        high - low
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Windows of a joint that swings once in four seconds and a little more, with a residual that is
    /// `residual(time, position)`.
    fn windows(residual: impl Fn(f64, f64) -> f64) -> Vec<Window> {
        let window = |index: usize| {
            let t = 0.1 * index as f64;
            let phase = TAU * 0.23 * t;
            let position = phase.sin();
            Window {
                log: index / 200,
                segment: 0,
                stretch_s: [t, t + 0.095],
                samples: 20.0,
                squares: vec![residual(t, position).powi(2), 1.0],
                moves: vec![true; 2],
                states: vec![[position, phase.cos(), 3.0 * position]; 2],
            }
        };
        (0..400).map(window).collect()
    }

    fn count(residual: impl Fn(f64, f64) -> f64) -> usize {
        found(&windows(residual), &DisturbanceSettings::default()).len()
    }

    #[test]
    fn what_few_moments_show_and_their_states_do_not_at_other_times_is_a_disturbance() {
        let push = |t: f64| if (12.3..12.9).contains(&t) || (33.0..33.2).contains(&t) { 20.0 } else { 1.0 };
        let all = found(&windows(|t, _| push(t)), &DisturbanceSettings::default());
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].log, all[1].log), (0, 1));
        let [from, to] = all[0].stretch_s;
        assert!((12.1..12.31).contains(&from) && (12.89..13.2).contains(&to), "{from} {to}");
        assert_eq!(all[0].torques, [0]);
        assert!((all[0].ratio - 20.0).abs() < 1e-9);
    }

    #[test]
    fn what_comes_again_with_the_motion_or_often_or_is_small_is_none() {
        // Nothing stands out.
        assert_eq!(count(|t, _| 1.0 + (7.0 * t).sin()), 0);
        // A stop near one end, met in every swing.
        assert_eq!(count(|_, position| if position > 0.99 { 20.0 } else { 1.0 }), 0);
        // A stop met once: the joint is at no other time there.
        let mut once = windows(|t, _| if (20.0..20.3).contains(&t) { 20.0 } else { 1.0 });
        once[200..=203].iter_mut().for_each(|window| window.states[0][0] = 1.5);
        assert_eq!(found(&once, &DisturbanceSettings::default()), []);
        // The beginning of each log: a hysteresis whose state nobody knows there.
        assert_eq!(count(|t, _| if t % 20.0 < 0.3 { 20.0 } else { 1.0 }), 0);
        // Seven in forty seconds.
        assert_eq!(count(|t, _| if t % 6.0 < 0.2 { 20.0 } else { 1.0 }), 0);
        // Most of what is left is elsewhere.
        assert_eq!(count(|t, _| if (12.3..12.5).contains(&t) { 6.0 } else { 1.0 }), 0);
    }
}
