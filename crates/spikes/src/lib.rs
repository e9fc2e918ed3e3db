#![doc = include_str!("../README.md")]

/// The most samples in a row that are taken for one spike.
pub const LONGEST: usize = 5;
/// Samples that a spike is judged by. Where a signal begins with one there are more behind it than another
/// can have.
pub const WINDOW: usize = 2 * LONGEST + 1;
/// Fewer differences than this say nothing of what is usual in a signal.
const FEWEST: usize = 16;
/// Differences from the mean of the neighbours that one spike makes in a signal that is constant but for it.
const OF_ONE_SPIKE: usize = 4;

/// When a sample is a spike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpikeSettings {
    /// How far a signal must leave the line between the samples before and behind, and come back to it, to be
    /// a spike: a multiple of what is usual, see [`SpikeSettings::usual_share`].
    ///
    /// On six sets of real logs the largest multiple is 8.4 for a position, 13.0 for a velocity, 7.3 for a
    /// torque (`cargo test -p phiw-telemetry real_logs -- --nocapture` prints them); normal noise reaches 2.5
    /// in 10⁷ samples.
    pub multiple: f64,
    /// What is usual: of the samples that differ from the mean of their neighbours, this share differs by
    /// less. What is left to 1 is the share that spikes may have.
    pub usual_share: f64,
    /// An excursion that is no larger than this, in the signal's unit, is no spike, however smooth the signal
    /// is.
    pub smallest: f64,
}

impl Default for SpikeSettings {
    fn default() -> Self {
        SpikeSettings { multiple: 25.0, usual_share: 0.98, smallest: 0.0 }
    }
}

/// Differences from the mean of the neighbours that four spikes make.
const OF_FOUR_SPIKES: usize = 12;

impl SpikeSettings {
    /// What an excursion must exceed to be a spike. `count` samples of the signal differ from the mean of
    /// their neighbours, and `quantile` gives what a share of them differ by at most.
    pub fn bound(&self, count: usize, quantile: impl FnOnce(f64) -> f64) -> f64 {
        match count {
            // Constant but for a spike.
            0..=OF_ONE_SPIKE => self.smallest,
            _ if count < FEWEST => f64::INFINITY,
            _ => self.smallest.max(self.multiple * quantile(self.share_of(count))),
        }
    }

    /// The share of `count` differences that are taken for usual: [`SpikeSettings::usual_share`], and in a
    /// short signal less, so that four spikes are left out of it.
    pub fn share_of(&self, count: usize) -> f64 {
        let spared = 1.0 - OF_FOUR_SPIKES as f64 / count.max(1) as f64;
        self.usual_share.min(spared).max(0.5)
    }
}

/// By how much the middle of three samples differs from the mean of the others.
pub fn bend(samples: [f64; 3]) -> f64 {
    samples[1] - 0.5 * (samples[0] + samples[2])
}

/// By how much the samples behind the first of a window (of three or more) leave the line from it to the
/// sample behind them, less what that line rises: the most of one to [`LONGEST`] samples, and of how many. A
/// step gives less than nothing, since it does not come back.
pub fn excursion(window: &[f64]) -> (f64, usize) {
    let mut most = (f64::NEG_INFINITY, 1);
    let Some(&before) = window.first() else { return most };
    for length in 1..=LONGEST.min(window.len().saturating_sub(2)) {
        let behind = window[length + 1];
        let mut least = f64::INFINITY;
        for (place, &sample) in window[1..=length].iter().enumerate() {
            let share = (place + 1) as f64 / (length + 1) as f64;
            least = least.min((sample - before - share * (behind - before)).abs());
        }
        let excess = least - (behind - before).abs();
        if excess > most.0 {
            most = (excess, length);
        }
    }
    most
}

/// The same for the first samples of a window where a signal begins (or, backwards, ends): by how much they
/// are off all samples behind them, less what the signal can have moved meanwhile at its fastest step there.
pub fn excursion_at_edge(window: &[f64]) -> (f64, usize) {
    let mut most = (f64::NEG_INFINITY, 1);
    for length in 1..=LONGEST.min(window.len().saturating_sub(2)) {
        let (off, behind) = window.split_at(length);
        let distance =
            |sample: &f64| behind.iter().fold(f64::INFINITY, |least, x| least.min((sample - x).abs()));
        let least = off.iter().map(distance).fold(f64::INFINITY, f64::min);
        let fastest = behind.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let excess = least - WINDOW as f64 * fastest;
        if excess > most.0 {
            most = (excess, length);
        }
    }
    most
}

/// How many samples from the first of `ahead` on are a spike: excursions above `bound`. `before` are the last
/// two good samples, the later first, where the signal has any; `ahead` is [`WINDOW`] samples, or as many as
/// are left of the signal.
pub fn spike_length(before: [Option<f64>; 2], ahead: &[f64], bound: f64) -> usize {
    let mut window = [0.0; WINDOW];
    let over = |(most, length): (f64, usize)| if most > bound { length } else { 0 };
    let [Some(last), earlier] = before else {
        return if ahead.len() >= WINDOW { over(excursion_at_edge(ahead)) } else { 0 };
    };
    window[0] = last;
    let size = WINDOW.min(ahead.len() + 1);
    window[1..size].copy_from_slice(&ahead[..size - 1]);
    let inside = over(excursion(&window[..size]));
    match earlier {
        // The signal ends within the window: all that is left of it may be off.
        Some(earlier) if inside == 0 && ahead.len() <= LONGEST => {
            let left = ahead.len();
            ahead.iter().rev().zip(&mut window).for_each(|(sample, place)| *place = *sample);
            window[left..left + 2].copy_from_slice(&[last, earlier]);
            let length = over(excursion_at_edge(&window[..left + 2]));
            if length == left { length } else { 0 }
        }
        _ => inside,
    }
}

/// The indices of all samples of spikes. A sample that is not finite interrupts the signal.
pub fn find_spikes(samples: &[f64], settings: SpikeSettings) -> Vec<usize> {
    let mut bends: Vec<f64> = samples
        .windows(3)
        .map(|three| bend([three[0], three[1], three[2]]).abs())
        .filter(|&b| b > 0.0)
        .collect();
    let bound = settings.bound(bends.len(), |share| {
        let place = ((share * bends.len() as f64) as usize).min(bends.len() - 1);
        *bends.select_nth_unstable_by(place, f64::total_cmp).1
    });
    let mut spikes = Vec::new();
    let mut start = 0;
    for piece in samples.split(|sample| !sample.is_finite()) {
        let mut before = [None, None];
        let mut at = 0;
        while at < piece.len() {
            let ahead = &piece[at..piece.len().min(at + WINDOW)];
            let length = spike_length(before, ahead, bound);
            if length == 0 {
                before = [Some(piece[at]), before[0]];
                at += 1;
            } else {
                spikes.extend(start + at..start + at + length);
                at += length;
            }
        }
        start += piece.len() + 1;
    }
    spikes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A swing with a little noise.
    fn swing() -> Vec<f64> {
        let noise = |sample: usize| ((sample * 7919) % 101) as f64 / 101.0 - 0.5;
        (0..1000).map(|sample| (0.01 * sample as f64).sin() + 1e-3 * noise(sample)).collect()
    }

    proptest! {
        #[test]
        fn spikes_are_found_wherever_they_are(
            at in 0_usize..1000,
            length in 1_usize..=LONGEST,
            size in prop_oneof![0.1..1e6, -1e6..-0.1],
        ) {
            let mut samples = swing();
            let end = (at + length).min(1000);
            samples[at..end].iter_mut().for_each(|x| *x += size);
            prop_assert_eq!(find_spikes(&samples, SpikeSettings::default()), (at..end).collect::<Vec<_>>());
        }

        #[test]
        fn steps_and_coarse_readings_are_no_spikes(
            step in 1e-3..1.0_f64,
            at in 8_usize..992,
            size in -1e3..1e3_f64,
        ) {
            let coarse: Vec<f64> = swing().iter().map(|x| (x / step).round() * step).collect();
            prop_assert!(find_spikes(&coarse, SpikeSettings::default()).is_empty());
            let mut stepped = swing();
            stepped[at..].iter_mut().for_each(|x| *x += size);
            prop_assert!(find_spikes(&stepped, SpikeSettings::default()).is_empty());
        }

        /// Whatever the numbers are.
        #[test]
        fn any_samples_will_do(samples in prop::collection::vec(prop_oneof![any::<f64>(), Just(f64::NAN), Just(0.0)], 0..40)) {
            let spikes = find_spikes(&samples, SpikeSettings::default());
            prop_assert!(spikes.iter().all(|&spike| samples[spike].is_finite()));
        }
    }

    #[test]
    fn a_spike_in_a_signal_at_rest_is_found() {
        let mut samples = vec![0.25; 500];
        samples[200] = 3.4e38;
        assert_eq!(find_spikes(&samples, SpikeSettings::default()), [200]);
    }

    /// Three differences of 118 are more than 2 %.
    #[test]
    fn a_spike_in_a_short_signal_is_found() {
        let mut samples = swing();
        samples.truncate(120);
        samples[70] += 500.0;
        assert_eq!(find_spikes(&samples, SpikeSettings::default()), [70]);
    }

    #[test]
    fn a_signal_goes_on_after_a_gap() {
        let mut samples = swing();
        samples[300..320].fill(f64::NAN);
        samples[320] += 5.0;
        samples[299] -= 5.0;
        assert_eq!(find_spikes(&samples, SpikeSettings::default()), [299, 320]);
    }
}
