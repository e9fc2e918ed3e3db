//! `cargo xtask conventions`: what is said of logs that count joints otherwise than the URDF.
//!
//! # What it asks
//!
//! Whether signs, exchanged columns, units of torques and mountings that differ between a log and its URDF
//! are told, and whether anything is said where nothing differs. What some changes do no torque can show: a
//! joint about the vertical that turns the other way on a symmetric robot. So not all can be told.
//!
//! # How it is run
//!
//! `cargo xtask conventions`. Robots, motions and noise are those of the suite `wide_right` of `cargo xtask
//! undeclared`, developing seeds; each change is made to the conditioned samples of each case. With
//! `--setting NAME=VALUE,VALUE…` one of `ConventionSettings` takes these values one after the other.
//!
//! # What it prints
//!
//! For each change in how many cases it alone was told, with joints and amount; it and something else; only
//! something else; nothing. And how often something was said of logs as the URDF has them. Then what was said
//! of each log that was read otherwise than it should be, with its seed.
//!
//! # Where results go
//!
//! Nowhere but to standard output.

mod change;

use crate::undeclared::{NamedValues, named_values, write_right_models};
use anyhow::Context;
use change::{Change, changes};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_identification::checks::{Convention, ConventionSettings, conventions};
use phiw_identification::{BlockSource, Data, LogSet};
use phiw_telemetry::{Block, ConditioningOptions};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Command line of `cargo xtask conventions`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Robots with their logs.
    #[arg(long, default_value_t = 45)]
    count: usize,
    /// Give one of the settings these values one after the other, and print what each value does.
    #[arg(long, value_name = "NAME=VALUE,VALUE…", value_parser = named_values)]
    setting: Option<NamedValues>,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
}

/// How often a change was told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Told {
    alone: usize,
    with_more: usize,
    only_other: usize,
    nothing: usize,
}

impl Told {
    fn count(&mut self, change: Option<&Change>, said: &[Convention]) {
        let is_told = change.is_some_and(|change| said.iter().any(|said| change.is(said)));
        match (is_told, said.len()) {
            (_, 0) => self.nothing += 1,
            (true, 1) => self.alone += 1,
            (true, _) => self.with_more += 1,
            (false, _) => self.only_other += 1,
        }
    }

    fn add(&mut self, other: &Told) {
        self.alone += other.alone;
        self.with_more += other.with_more;
        self.only_other += other.only_other;
        self.nothing += other.nothing;
    }
}

/// What is said of a case and its changes.
#[derive(Default)]
struct OfCase {
    told: BTreeMap<&'static str, Told>,
    /// What was said of logs that were read otherwise than they should be.
    wrong: Vec<String>,
}

/// The row of logs that are as the URDF has them.
const AS_IT_IS: &str = "as the URDF has it";

/// Prints the table, once for each value of the setting.
///
/// # Errors
/// A case cannot be written or read, or there is no such setting.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let cases = write_right_models(0..arguments.count, folder.path())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.jobs).build()?;
    let runs: Vec<Option<(&str, f64)>> = match &arguments.setting {
        None => vec![None],
        Some(NamedValues { name, values }) => {
            values.iter().map(|value| Some((name.as_str(), *value))).collect()
        }
    };
    for run in runs {
        let mut settings = ConventionSettings::default();
        if let Some((name, value)) = run {
            settings.set(name, value)?;
            println!("## {name} = {value}\n");
        }
        let of_case = |(seed, case): (u64, &Path)| told(case, seed, &settings);
        let all: Vec<OfCase> = pool.install(|| {
            let cases = cases.par_iter().map(|(seed, folder)| (*seed, folder.as_path()));
            cases.map(of_case).collect::<anyhow::Result<_>>()
        })?;
        println!("{}", table(&all));
        all.iter().flat_map(|case| &case.wrong).for_each(|line| println!("{line}"));
    }
    Ok(())
}

/// What is said of each change to a case.
fn told(case: &Path, seed: u64, settings: &ConventionSettings) -> anyhow::Result<OfCase> {
    let tree = read_urdf_file(case.join("robot.urdf"), &UrdfOptions::default())
        .with_context(|| case.display().to_string())?
        .tree;
    let train = ["train_a.csv", "train_b.csv"].map(|name| case.join(name));
    let logs = LogSet::open(&tree, &train, &[], &ConditioningOptions::default(), &|_, _, _| ())?;
    let sources = logs.sources(&|_, _, _| ());
    let mut blocks: Vec<Vec<Block>> = Vec::new();
    for source in &sources {
        let mut own = Vec::new();
        source.blocks(&mut |block| own.push(block))?;
        blocks.push(own);
    }
    let said = |blocks: &[Vec<Block>]| {
        let data = Data {
            train: logs.training_folds(),
            held_out: Vec::new(),
            sources: blocks.iter().map(|source| source as &dyn BlockSource).collect(),
            rest_speeds: logs.rest_speeds(),
        };
        conventions(&tree, &data, settings)
    };
    let mut all = OfCase::default();
    let mut count = |name: &'static str, change: Option<&Change>, said: &[Convention]| {
        let told = all.told.entry(name).or_default();
        let before = *told;
        told.count(change, said);
        if told.alone == before.alone && (change.is_some() || !said.is_empty()) {
            let what = said.iter().map(|said| format!("{:?} of {:?}", said.kind, said.joints));
            let joints = change.map(|change| format!(" {:?}", change.joints)).unwrap_or_default();
            all.wrong.push(format!("- {seed}, {name}{joints}: {}", what.collect::<Vec<_>>().join("; ")));
        }
    };
    count(AS_IT_IS, None, &said(&blocks)?);
    for change in changes(&tree, seed) {
        let mut changed = blocks.clone();
        changed.iter_mut().try_for_each(|blocks| change.apply(&tree, blocks))?;
        count(change.name, Some(&change), &said(&changed)?);
    }
    Ok(all)
}

fn table(cases: &[OfCase]) -> String {
    let mut sum: BTreeMap<&str, Told> = BTreeMap::new();
    cases.iter().flat_map(|case| &case.told).for_each(|(name, told)| sum.entry(name).or_default().add(told));
    let row = |name: &str, told: &Told| {
        let Told { alone, with_more, only_other, nothing } = told;
        format!("| {name} | {alone} | {with_more} | {only_other} | {nothing} |\n")
    };
    let mut text =
        "| log | told | and something else | something else | nothing |\n|---|--:|--:|--:|--:|\n".to_owned();
    sum.iter().for_each(|(name, told)| text.push_str(&row(name, told)));
    let mut changed = Told::default();
    sum.iter().filter(|(name, _)| **name != AS_IT_IS).for_each(|(_, told)| changed.add(told));
    text + &row("all changes", &changed)
}

#[cfg(test)]
mod tests {
    use super::{AS_IT_IS, OfCase, Told, told};
    use crate::undeclared::write_right_models;
    use phiw_identification::checks::ConventionSettings;

    #[test]
    fn a_log_as_it_is_is_left_alone_and_a_turned_sign_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let cases = write_right_models(9..10, folder.path()).unwrap();
        let (seed, case) = &cases[0];
        let OfCase { told, wrong } = told(case, *seed, &ConventionSettings::default()).unwrap();
        assert_eq!(told[AS_IT_IS], Told { nothing: 1, ..Told::default() }, "{wrong:?}");
        assert_eq!(told["all torques' signs"], Told { alone: 1, ..Told::default() }, "{wrong:?}");
    }
}
