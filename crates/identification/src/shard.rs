//! Factors of some logs as a file: what one machine has reduced, for another one that fits.
//!
//! The form, all numbers little-endian: `phiw-factors`, version (u32), SHA-256 of the plan, number of logs
//! (u32), the logs, and SHA-256 of all bytes before it. A log is its place in the session (u32); its folds
//! (u32 their number, the factors of each, those at rest behind them); its cut-offs (u32 their number, for
//! each u32 the number of folds and their factors); its poses (u64 their number, f64 each). A factor is, for
//! each torque, its rows (u64), its columns (u32) and its triangle (f64), row by row from the diagonal on.

use crate::Design;
use crate::accumulate::FoldFactors;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use sha2::{Digest, Sha256};

const MAGIC: &[u8] = b"phiw-factors";
const VERSION: u32 = 1;
/// Bytes of a SHA-256.
const HASH: usize = 32;

/// What the rows of one log bring.
#[derive(Clone, Debug)]
pub struct LogFactors {
    /// Which log of the session.
    pub log: usize,
    /// The factors of its folds: those to fit, then those held out.
    pub folds: FoldFactors,
    /// For each cut-off that is compared the factors of its stretches of time (see
    /// [`Contest`](crate::bandwidth::Contest)).
    pub rungs: Vec<Vec<GroupedFactor>>,
    /// Positions here and there in it \[rad, m\], one row after another.
    pub poses: Vec<f64>,
}

/// The factors of some logs of a plan.
#[derive(Clone, Debug)]
pub struct Shard {
    /// SHA-256 of the plan.
    pub plan: [u8; HASH],
    /// The logs.
    pub logs: Vec<LogFactors>,
}

/// The columns of a shard's factors.
#[derive(Clone, Copy)]
pub struct ShardColumns<'a> {
    /// Those of the folds.
    pub folds: &'a Design,
    /// Those of the cut-offs, where any are compared.
    pub rungs: Option<&'a Design>,
}

/// Why a file of factors cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// Another file.
    #[error("this is no file of factors; name one that phiw reduce has written")]
    NotAShard,
    /// A later form.
    #[error("its version is {version}, this phiw reads {VERSION}; reduce its logs again with this phiw")]
    Version {
        /// The version.
        version: u32,
    },
    /// Bytes are missing or changed.
    #[error("it is cut short or damaged, its checksum does not match; reduce its logs again")]
    Damaged,
    /// Factors of another session.
    #[error("it was reduced with another plan; reduce its logs again with this one")]
    OtherPlan,
    /// The bytes are whole, but not what the plan asks for.
    #[error(
        "its factors have not the columns of the plan; reduce its logs again with the phiw that merges them"
    )]
    OtherColumns,
}

impl Shard {
    /// The file's bytes.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.plan);
        put_count(&mut bytes, self.logs.len());
        for log in &self.logs {
            put_count(&mut bytes, log.log);
            put_factors(&mut bytes, &log.folds.moving);
            log.folds.at_rest.iter().for_each(|factor| put_factor(&mut bytes, factor));
            put_count(&mut bytes, log.rungs.len());
            log.rungs.iter().for_each(|rung| put_factors(&mut bytes, rung));
            bytes.extend((log.poses.len() as u64).to_le_bytes());
            log.poses.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        let hash = Sha256::digest(&bytes);
        bytes.extend(hash);
        bytes
    }

    /// The content of a file, if it was reduced with the plan of this hash.
    ///
    /// # Errors
    /// [`ShardError`].
    pub fn decode(bytes: &[u8], plan: &[u8; HASH], columns: ShardColumns<'_>) -> Result<Self, ShardError> {
        if bytes.len() < MAGIC.len() || !bytes.starts_with(MAGIC) {
            return Err(ShardError::NotAShard);
        }
        let version = bytes.get(MAGIC.len()..).and_then(<[u8]>::first_chunk).ok_or(ShardError::Damaged)?;
        let version = u32::from_le_bytes(*version);
        if version != VERSION {
            return Err(ShardError::Version { version });
        }
        let (content, hash) = bytes.split_last_chunk::<HASH>().ok_or(ShardError::Damaged)?;
        if Sha256::digest(content)[..] != hash[..] {
            return Err(ShardError::Damaged);
        }
        let mut reader = Reader { rest: &content[MAGIC.len() + size_of::<u32>()..] };
        if reader.take::<HASH>()? != *plan {
            return Err(ShardError::OtherPlan);
        }
        let count = reader.count()?;
        let logs = (0..count).map(|_| reader.log(columns)).collect::<Result<_, _>>()?;
        if !reader.rest.is_empty() {
            return Err(ShardError::OtherColumns);
        }
        Ok(Shard { plan: *plan, logs })
    }
}

fn put_count(bytes: &mut Vec<u8>, count: usize) {
    bytes.extend((count as u32).to_le_bytes());
}

fn put_factors(bytes: &mut Vec<u8>, factors: &[GroupedFactor]) {
    put_count(bytes, factors.len());
    factors.iter().for_each(|factor| put_factor(bytes, factor));
}

fn put_factor(bytes: &mut Vec<u8>, factor: &GroupedFactor) {
    for Group { factor, .. } in factor.groups() {
        bytes.extend(factor.rows().to_le_bytes());
        put_count(bytes, factor.columns());
        factor.triangle().iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
}

/// Whole bytes that are read from the front.
struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ShardError> {
        let (first, rest) = self.rest.split_first_chunk().ok_or(ShardError::OtherColumns)?;
        self.rest = rest;
        Ok(*first)
    }

    fn count(&mut self) -> Result<usize, ShardError> {
        Ok(u32::from_le_bytes(self.take()?) as usize)
    }

    /// So many numbers, if there are.
    fn numbers(&mut self, count: usize) -> Result<Vec<f64>, ShardError> {
        let bytes = count.checked_mul(size_of::<f64>()).filter(|&bytes| bytes <= self.rest.len());
        let (numbers, rest) = self.rest.split_at(bytes.ok_or(ShardError::OtherColumns)?);
        self.rest = rest;
        Ok(numbers.as_chunks().0.iter().map(|number| f64::from_le_bytes(*number)).collect())
    }

    fn factors(&mut self, count: usize, design: &Design) -> Result<Vec<GroupedFactor>, ShardError> {
        (0..count).map(|_| self.factor(design)).collect()
    }

    fn factor(&mut self, design: &Design) -> Result<GroupedFactor, ShardError> {
        let mut groups = Vec::with_capacity(design.rows().len());
        for layout in design.rows() {
            let rows = u64::from_le_bytes(self.take()?);
            let columns = self.count()?;
            if columns != layout.range.len() {
                return Err(ShardError::OtherColumns);
            }
            let triangle = self.numbers(columns * (columns + 1) / 2)?;
            let factor =
                Factor::of_triangle(columns, rows, &triangle).map_err(|_| ShardError::OtherColumns)?;
            groups.push(Group { parameters: layout.parameters.clone(), factor });
        }
        GroupedFactor::new(design.parameter_count(), groups).map_err(|_| ShardError::OtherColumns)
    }

    fn log(&mut self, columns: ShardColumns<'_>) -> Result<LogFactors, ShardError> {
        let log = self.count()?;
        let folds = self.count()?;
        let moving = self.factors(folds, columns.folds)?;
        let at_rest = self.factors(folds, columns.folds)?;
        let mut rungs = Vec::new();
        for _ in 0..self.count()? {
            let folds = self.count()?;
            rungs.push(self.factors(folds, columns.rungs.ok_or(ShardError::OtherColumns)?)?);
        }
        let poses = usize::try_from(u64::from_le_bytes(self.take()?)).unwrap_or(usize::MAX);
        let poses = self.numbers(poses)?;
        Ok(LogFactors { log, folds: FoldFactors { moving, at_rest }, rungs, poses })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accumulate::{Fold, Rests, accumulate_folds};
    use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_tree};
    use phiw_regressor::{BaseParameters, BaseParametersOptions};
    use phiw_telemetry::Block;

    fn design() -> Design {
        let tree = random_tree(3, &RandomTreeOptions { joints: 2, ..RandomTreeOptions::default() }).unwrap();
        let base = BaseParameters::of_tree(&tree, BaseParametersOptions::default()).unwrap();
        let joints = tree.joint_count();
        Design::new(tree, base, Vec::new()).with_rest_speeds(vec![0.3; joints])
    }

    fn shard(design: &Design) -> Shard {
        let joints = design.tree().joint_count();
        let mut random = RandomNumbers::new(5);
        let mut signal = || (0..60 * joints).map(|_| random.uniform(-1.0, 1.0)).collect::<Vec<f64>>();
        let signals = [signal(), signal(), signal()];
        let t = (0..60).map(f64::from).collect();
        let block = Block::unfiltered(joints, t, signals, signal());
        let folds = [0.0, 20.0, 50.0].map(|start| Fold { log: 0, start, end: start + 15.0 });
        let factors = accumulate_folds(design, &folds, &[&vec![block]], Rests::Kept).unwrap();
        let log = |log| LogFactors {
            log,
            rungs: vec![factors.moving.clone(), Vec::new()],
            folds: factors.clone(),
            poses: vec![0.1; 2 * joints],
        };
        Shard { plan: [7; 32], logs: vec![log(4), log(0)] }
    }

    #[test]
    fn a_shard_reads_back_to_the_last_bit() {
        let design = design();
        let columns = ShardColumns { folds: &design, rungs: Some(&design) };
        let shard = shard(&design);
        let rows = |folds: &[GroupedFactor]| folds.iter().map(GroupedFactor::rows).sum::<u64>();
        assert!(rows(&shard.logs[0].folds.moving) > 0 && rows(&shard.logs[0].folds.at_rest) > 0);
        let bytes = shard.encode();
        let read = Shard::decode(&bytes, &[7; 32], columns).unwrap();
        assert_eq!(read.encode(), bytes);
        assert_eq!(format!("{read:?}"), format!("{shard:?}"));
    }

    #[test]
    fn what_is_no_shard_of_the_plan_is_refused() {
        let design = design();
        let columns = ShardColumns { folds: &design, rungs: Some(&design) };
        let bytes = shard(&design).encode();
        let check = |bytes: &[u8], plan: u8, columns, expected: ShardError| {
            assert_eq!(Shard::decode(bytes, &[plan; 32], columns).unwrap_err(), expected);
        };
        check(b"", 7, columns, ShardError::NotAShard);
        check(b"t,q.a\n0,1\n", 7, columns, ShardError::NotAShard);
        check(&bytes, 8, columns, ShardError::OtherPlan);
        check(&bytes, 7, ShardColumns { rungs: None, ..columns }, ShardError::OtherColumns);
        let mut later = bytes.clone();
        later[MAGIC.len()] = 9;
        check(&later, 7, columns, ShardError::Version { version: 9 });
        for length in (MAGIC.len()..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
            check(&bytes[..length], 7, columns, ShardError::Damaged);
        }
        let mut random = RandomNumbers::new(1);
        for _ in 0..200 {
            let mut changed = bytes.clone();
            let first = MAGIC.len() + 4;
            let place = first + (random.uniform(0.0, 1.0) * (bytes.len() - first) as f64) as usize;
            changed[place] ^= 1;
            check(&changed, 7, columns, ShardError::Damaged);
        }
    }
}
