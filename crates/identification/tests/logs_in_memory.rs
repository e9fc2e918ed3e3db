//! Logs in memory beside logs in files, and work that is called off.

use crate::synthetic;

use phiw_dynamics::Tree;
use phiw_identification::{BlockSource, IdentificationError, Interruption, KeptBlocks, LogSet};
use phiw_telemetry::{Block, ConditioningOptions, LogError, LogSource, NamedColumns, TorqueColumns};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

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

fn logs(
    tree: &Tree,
    logs: Vec<LogSource>,
    interruption: &Interruption,
) -> Result<LogSet, IdentificationError> {
    let (torque, options) = (TorqueColumns::Required, ConditioningOptions::default());
    LogSet::surveyed(tree, [logs, Vec::new()], torque, &options, interruption.clone(), &|_, _, _| ())
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
    let columns = Some(Arc::new(log(&tree, &file)));
    let in_memory = LogSource { columns, ..LogSource::from(Path::new("in memory")) };
    let logs = logs(&tree, vec![file.into(), in_memory], &Interruption::default()).unwrap();
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
    let interruption = Interruption::default();
    let logs_of_file = logs(&tree, vec![file.clone().into()], &interruption).unwrap();
    let sources = logs_of_file.sources(&|_, _, _| ());
    let all = blocks(&sources[0]).len();
    let kept = KeptBlocks::keep(&[&sources[0]], usize::MAX).unwrap();
    // Of memory first: what is called off stays so.
    for (source, most) in [(&kept[0] as &dyn BlockSource, 1), (&sources[0], 0)] {
        let mut seen = 0;
        let outcome = source.stream(&mut |_| {
            seen += 1;
            interruption.call_off();
            ControlFlow::Continue(())
        });
        assert!(matches!(outcome, Err(LogError::Interrupted)), "{outcome:?}");
        assert!(seen == most && all > 1, "{seen} of {all}");
    }
    let again = logs(&tree, vec![file.into()], &interruption);
    assert!(matches!(again, Err(IdentificationError::Log(LogError::Interrupted))));
}

#[test]
fn columns_of_a_log_are_equally_long() {
    let columns = vec![("t".to_owned(), vec![0.0, 1.0]), ("q.j".to_owned(), vec![0.0])];
    let message = NamedColumns::new("log", columns).unwrap_err().to_string();
    assert_eq!(message, "log: column `q.j` has 1 values, but `t` has 2; give each as many");
    let none = NamedColumns::new("log", vec![("t".to_owned(), vec![])]).unwrap_err();
    assert!(matches!(none, LogError::Empty { .. }));
}
