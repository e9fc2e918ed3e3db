//! Long logs are searched in evenly spread pieces: which effects are missing is told by minutes, what they
//! measure by all.

use phiw_identification::{BlockSource, Data, Fold, IdentificationError, KeptBlocks};
use phiw_telemetry::{Block, WARM_UP_S};

/// Samples that the search looks at, at most, unless they are less than [`SEARCHED_S`] of motion.
const SEARCHED_SAMPLES: f64 = 30_000.0;
/// Time that the search looks at where there is as much, however fast it is logged \[s\]: what is missing is
/// told by motion, and many samples of a little of it leave out the rest of the joints' ranges.
const SEARCHED_S: f64 = 100.0;
/// Length of a piece \[s\]: long against a residual's correlation and against the filters' reach.
const PIECE_S: f64 = 5.0;
/// The shortest piece \[s\]: before each, the filters' warm-up is evaluated for nothing. Where less is due of
/// each of many short logs, one piece stands for several of them.
const LEAST_PIECE_S: f64 = 2.0;
/// Blocks that short logs are cut into, at least, so that every processor has one; none is shorter than what
/// comes before it.
const LEAST_BLOCKS: usize = 4;
/// Conditioned samples that are kept between passes; what does not fit is read again \[bytes\].
const KEPT_BYTES: usize = 64 << 20;
/// The same for pieces of long logs, which are as many as they are.
const KEPT_BYTES_OF_PIECES: usize = 512 << 20;

/// The stretches that are searched, and the blocks that hold them.
pub(super) struct Sample<'a> {
    train: Vec<Fold>,
    held_out: Vec<Fold>,
    kept: Vec<KeptBlocks<'a>>,
}

impl<'a> Sample<'a> {
    /// All of `data` where that is little, pieces of it otherwise. `period_s` is the time between samples.
    ///
    /// # Errors
    /// A log cannot be read.
    pub fn of(data: &Data<'a>, period_s: f64) -> Result<Self, IdentificationError> {
        let length = |folds: &[Fold]| folds.iter().map(|fold| fold.end - fold.start).sum::<f64>();
        let samples = (length(&data.train) + length(&data.held_out)) / period_s;
        let searched = SEARCHED_SAMPLES.max(SEARCHED_S / period_s);
        if samples.is_nan() || samples <= searched {
            let warm_up = (WARM_UP_S / period_s).round() as usize;
            let wanted = LEAST_BLOCKS.div_ceil(data.sources.len().max(1));
            let kept = KeptBlocks::keep_parts(&data.sources, KEPT_BYTES, |block| {
                let parts = wanted.min(block.len() / warm_up.max(1));
                block.in_parts(parts, warm_up)
            })?;
            return Ok(Sample { train: data.train.clone(), held_out: data.held_out.clone(), kept });
        }
        let share = searched / samples;
        let (train, held_out) = (pieces(&data.train, share), pieces(&data.held_out, share));
        let warm_up = (WARM_UP_S / period_s).round() as usize;
        let within = |block: Block| {
            let log = block.log;
            block.narrowed(warm_up, |t| train.iter().chain(&held_out).any(|fold| fold.contains(log, t)))
        };
        let kept = KeptBlocks::keep_parts(&data.sources, KEPT_BYTES_OF_PIECES, within)?;
        Ok(Sample { train, held_out, kept })
    }

    /// The same as data of a session.
    pub fn data(&self, rest_speeds: &[f64]) -> Data<'_> {
        Data {
            train: self.train.clone(),
            held_out: self.held_out.clone(),
            sources: self.kept.iter().map(|kept| kept as &dyn BlockSource).collect(),
            rest_speeds: rest_speeds.to_vec(),
        }
    }
}

/// Pieces of about `share` of the folds' length, spread evenly, one at least; none is shorter than
/// [`LEAST_PIECE_S`] but where a fold is.
fn pieces(folds: &[Fold], share: f64) -> Vec<Fold> {
    let length = |fold: &Fold| fold.end - fold.start;
    let mut all = Vec::new();
    let mut due = 0.0;
    for fold in folds {
        due += share * length(fold);
        if due >= LEAST_PIECE_S.min(length(fold)) {
            let wanted = due.min(length(fold));
            all.extend(spread(fold, wanted));
            due -= wanted;
        }
    }
    if let (true, Some(longest)) =
        (all.is_empty(), folds.iter().max_by(|a, b| length(a).total_cmp(&length(b))))
    {
        all.extend(spread(longest, LEAST_PIECE_S.min(length(longest))));
    }
    all
}

/// Pieces of a fold that are `wanted` seconds together, spread evenly.
fn spread(fold: &Fold, wanted: f64) -> impl Iterator<Item = Fold> {
    let count = (wanted / PIECE_S).round().max(1.0);
    let (half, step) = (0.5 * (wanted / count), (fold.end - fold.start) / count);
    let (log, start) = (fold.log, fold.start);
    (0..count as usize).map(move |index| {
        let middle = start + (index as f64 + 0.5) * step;
        Fold { log, start: middle - half, end: middle + half }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The time of a trace grew with the length of the logs: 553 s for a million rows.
    #[test]
    fn pieces_of_long_folds_are_as_long_as_asked_and_lie_within() {
        let folds = [Fold { log: 0, start: 3.0, end: 1003.0 }, Fold { log: 1, start: 0.0, end: 20.0 }];
        let all = pieces(&folds, 0.15);
        let length: f64 = all.iter().map(|piece| piece.end - piece.start).sum();
        assert!((length - 0.15 * 1020.0).abs() < 1e-9);
        assert_eq!(all.iter().filter(|piece| piece.log == 0).count(), 30);
        for piece in &all {
            let fold = &folds[piece.log];
            assert!(fold.start <= piece.start && piece.start < piece.end && piece.end <= fold.end);
        }
        assert!(all.windows(2).all(|pair| pair[0].log < pair[1].log || pair[0].end <= pair[1].start));
    }

    /// A million rows in 171 logs of six seconds were searched in pieces of 0.2 s, each with a warm-up of its
    /// own before it.
    #[test]
    fn of_many_short_folds_some_are_searched_and_not_a_little_of_each() {
        let folds: Vec<Fold> = (0..171).map(|log| Fold { log, start: 1.0, end: 7.0 }).collect();
        let all = pieces(&folds, 0.03);
        let length = |piece: &Fold| piece.end - piece.start;
        assert!(all.iter().all(|piece| length(piece) >= LEAST_PIECE_S - 1e-9));
        let total: f64 = all.iter().map(length).sum();
        assert!((total - 0.03 * 171.0 * 6.0).abs() < LEAST_PIECE_S, "{total}");
        let most_apart = all.windows(2).map(|pair| pair[1].log - pair[0].log).max();
        assert!(most_apart <= Some(12), "{most_apart:?}");
        // Little of one short log is one piece, and of a shorter one all of it.
        assert_eq!(pieces(&folds[..1], 0.01).iter().map(length).collect::<Vec<_>>(), [LEAST_PIECE_S]);
        let short = [Fold { log: 0, start: 0.0, end: 1.0 }];
        assert_eq!(pieces(&short, 0.01), short);
        assert!(pieces(&[], 0.5).is_empty());
    }
}
