//! Where logs lie in the session that they are of.

use crate::survey::Survey;
use serde::{Deserialize, Serialize};

/// Where a log lies in its session.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Session {
    /// Which log it is, counted from 0.
    pub log: usize,
    /// What to add to the log's stamps to get the session's time, in seconds.
    #[serde(with = "crate::any_number")]
    pub offset: f64,
}

/// Numbers the logs of a session and puts them on one time axis.
///
/// Stamps that overlap nowhere are taken to count from one origin and are kept. Where any two logs overlap,
/// each log is put behind the one before it in the order given.
pub fn arrange_session(surveys: &mut [Survey]) {
    let mut ranges: Vec<_> = surveys.iter().map(Survey::time_range).collect();
    ranges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let overlap = ranges.windows(2).any(|pair| pair[1].0 <= pair[0].1);
    let mut end = None;
    for (log, survey) in surveys.iter_mut().enumerate() {
        let (first, last) = survey.time_range();
        let offset = match end {
            Some(end) if overlap => end + survey.period - first,
            _ => 0.0,
        };
        survey.session = Session { log, offset };
        end = Some(last + offset);
    }
}
