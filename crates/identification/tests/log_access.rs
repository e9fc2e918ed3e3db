//! Logs in memory beside logs in files, and work that is called off.

mod synthetic;

use phiw_dynamics::Tree;
use phiw_identification::{BlockSource, IdentificationError, KeptBlocks, LogAccess, LogSet};
use phiw_telemetry::{Block, ConditioningOptions, LogError, NamedColumns, TorqueColumns};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// A log of the robot in a file, with a gap, and the columns of that file.
fn log(tree: &Tree, path: &Path) -> NamedColumns {
    let mut recording = synthetic::recording(tree, 3, 20.0, 1.0, 0.1, 1);
    recording.q[500] = f64::NAN;
    recording.write_csv(path).unwrap();
    let column = |values: &[f64], joint: usize| values.iter().skip(joint).step_by(3).copied().collect();
    let mut columns = vec![("t".to_owned(), recording.t.clone())];
    let optional = [("qd", &recording.qd), ("qdd", &recording.qdd)];
    let optional = optional.into_iter().filter_map(|(signal, values)| Some((signal, values.as_ref()?)));
    for (signal, values) in [("q", &recording.q), ("tau", &recording.tau)].into_iter().chain(optional) {
        let named = |(joint, name)| (format!("{signal}.{name}"), column(values, joint));
        columns.extend(recording.joints.iter().enumerate().map(named));
    }
    NamedColumns::new("in memory", columns).unwrap()
}

fn logs(tree: &Tree, names: &[PathBuf], access: LogAccess) -> Result<LogSet, IdentificationError> {
    let (torque, options) = (TorqueColumns::Required, ConditioningOptions::default());
    LogSet::surveyed(tree, [names, &[]], torque, &options, access, &|_, _, _| ())
}

fn blocks(source: &dyn BlockSource) -> Vec<Block> {
    let mut all = Vec::new();
    source.blocks(&mut |block| all.push(block)).unwrap();
    all
}

#[test]
fn a_log_in_memory_gives_the_blocks_of_its_file() {
    let tree = synthetic::robot(8, 3);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log.csv");
    let mut access = LogAccess::default();
    access.insert(log(&tree, &file));
    let logs = logs(&tree, &[file, "in memory".into()], access).unwrap();
    let surveys = logs.surveys();
    assert_eq!((surveys[0].rows, surveys[0].used_rows), (surveys[1].rows, surveys[1].used_rows));
    let sources = logs.sources(&|_, _, _| ());
    let [of_file, of_memory] = [0, 1].map(|log| blocks(&sources[log]));
    assert!(of_file.len() == of_memory.len() && !of_file.is_empty());
    for (a, b) in of_file.iter().zip(&of_memory) {
        assert_eq!((&a.q, &a.qd, &a.tau, &a.outputs), (&b.q, &b.qd, &b.tau, &b.outputs));
    }
}

#[test]
fn what_is_called_off_ends_at_the_next_block() {
    let tree = synthetic::robot(8, 3);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("log.csv");
    log(&tree, &file);
    let access = LogAccess::default();
    let interruption = access.interruption();
    let logs_of_file = logs(&tree, &[file.clone()], access.clone()).unwrap();
    let sources = logs_of_file.sources(&|_, _, _| ());
    let all = blocks(&sources[0]).len();
    let kept = KeptBlocks::keep(&[&sources[0]], usize::MAX).unwrap();
    for source in [&sources[0] as &dyn BlockSource, &kept[0]] {
        interruption.store(false, Ordering::Relaxed);
        let mut seen = 0;
        let outcome = source.stream(&mut |_| {
            seen += 1;
            interruption.store(true, Ordering::Relaxed);
            ControlFlow::Continue(())
        });
        assert!(matches!(outcome, Err(LogError::Interrupted)), "{outcome:?}");
        assert!(seen == 1 && all > 1, "{seen} of {all}");
    }
    let again = logs(&tree, &[file], access);
    assert!(matches!(again, Err(IdentificationError::Log(LogError::Interrupted))));
}

#[test]
fn columns_of_a_log_are_equally_long() {
    let columns = vec![("t".to_owned(), vec![0.0, 1.0]), ("q.j".to_owned(), vec![0.0])];
    let message = NamedColumns::new("log", columns).unwrap_err().to_string();
    assert_eq!(message, "log: column `q.j` has 1 values, but `t` has 2; give each as many");
}
