//! The sparsity of J'J of one sample: coordinates of the left and the right hand are not coupled, for
//! example.

use std::ops::Range;

/// Zeros that are taken along rather than beginning a new run.
const BRIDGED: usize = 2;

/// The elements of a sample's J'J that can differ from zero, in its upper triangle, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    /// Coordinates and parameters.
    size: usize,
    /// For each coordinate, runs of columns from its own on: coordinates, then those of the border.
    runs: Vec<[Vec<Range<usize>>; 2]>,
}

impl Pattern {
    /// All of `point` coordinates and `border` parameters meet.
    pub fn dense(point: usize, border: usize) -> Self {
        let size = point + border;
        let one = |run: Range<usize>| std::iter::once(run).collect();
        Pattern { size, runs: (0..point).map(|row| [one(row..point), one(point..size)]).collect() }
    }

    /// Those meet of which `meet` says so.
    pub fn of(point: usize, border: usize, meet: impl Fn(usize, usize) -> bool) -> Self {
        let size = point + border;
        let runs = |row: usize, columns: Range<usize>| {
            let mut runs: Vec<Range<usize>> = Vec::new();
            for column in columns.filter(|&column| column == row || meet(row, column)) {
                match runs.last_mut() {
                    Some(run) if column <= run.end + BRIDGED => run.end = column + 1,
                    _ => runs.push(column..column + 1),
                }
            }
            runs
        };
        Pattern {
            size,
            runs: (0..point).map(|row| [runs(row, row..point), runs(row, point..size)]).collect(),
        }
    }

    /// Runs of columns in a row: coordinates, and parameters.
    #[inline(always)]
    pub fn runs(&self, row: usize) -> &[Vec<Range<usize>>; 2] {
        &self.runs[row]
    }
    /// All runs as ranges of a matrix that is stored row by row.
    #[inline(always)]
    pub fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        self.runs.iter().enumerate().flat_map(move |(row, runs)| {
            let start = row * self.size;
            runs.iter().flatten().map(move |run| start + run.start..start + run.end)
        })
    }
}
