//! Many machines: parts of the runs, taken together again, and a script for Slurm.

use super::arguments::RunArguments;
use super::run_file;
use super::setup::Settings;
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Part `index` of `count`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        match numbers {
            Some((index, count)) if index >= 1 && index <= count => Ok(Shard { index, count }),
            _ => Err(format!("`{text}` is not a part; write 1/4 for the first of four")),
        }
    }
}

/// The jobs of a shard: every n-th, so that each has its share of every arm.
pub fn part<T>(jobs: Vec<T>, shard: Option<Shard>) -> Vec<T> {
    let Some(Shard { index, count }) = shard else { return jobs };
    jobs.into_iter().skip(index as usize - 1).step_by(count as usize).collect()
}

/// Copies the runs of all shards into one folder.
///
/// # Errors
/// The shards are of different settings, have the same run with different content, or a file can not be
/// copied.
pub fn merge(shards: &[PathBuf], out: &Path) -> anyhow::Result<()> {
    let settings = Settings::read(&shards[0])?;
    for shard in shards {
        ensure!(
            Settings::read(shard)? == settings,
            "{} and {} were made with different settings: run both with the same",
            shard.display(),
            shards[0].display()
        );
    }
    settings.keep(out)?;
    for shard in shards {
        for path in run_file::all(shard)? {
            let target = out.join(path.strip_prefix(shard)?);
            let text = std::fs::read(&path).with_context(|| path.display().to_string())?;
            match std::fs::read(&target) {
                Ok(there) if there == text => continue,
                Ok(_) if shard.as_path() != out => {
                    anyhow::bail!("{} is there already, with other content", target.display())
                }
                _ => {}
            }
            run_file::replace(&target, &text)?;
        }
    }
    Ok(())
}

/// Writes a job array to standard output: each task is a shard in the same folder, and a last job takes them
/// together.
///
/// # Errors
/// The command line of this program is not text.
pub fn slurm(arguments: &RunArguments) -> anyhow::Result<()> {
    let count = arguments.slurm.unwrap_or(1).max(1);
    let words = without(std::env::args().skip(1).collect(), &["--slurm", "--out", "--shard"]);
    let quoted: Vec<String> = words.iter().map(|word| format!("'{}'", word.replace('\'', r"'\''"))).collect();
    let out = arguments.out.display();
    println!(
        "#!/bin/sh\n\
         # {count} parts of `cargo xtask paper`, then one job that takes them together.\n\
         #   sbatch THIS_FILE    from the folder of the workspace, which all nodes must see\n\
         # Build first: cargo build --release -p xtask. A part that is requeued goes on where it was.\n\
         #SBATCH --job-name=phiw-paper\n\
         #SBATCH --array=1-{count}\n\
         #SBATCH --requeue\n\
         set -e\n\
         export CARGO_MANIFEST_DIR=\"$PWD/xtask\"\n\
         program=\"${{CARGO_TARGET_DIR:-target}}/release/xtask\"\n\
         export RAYON_NUM_THREADS=\"${{SLURM_CPUS_PER_TASK:-1}}\"\n\
         \"$program\" {} --out '{out}/shard'\"$SLURM_ARRAY_TASK_ID\" --shard \"$SLURM_ARRAY_TASK_ID/{count}\"\n\
         # The last part to finish takes all together.\n\
         touch '{out}/shard'\"$SLURM_ARRAY_TASK_ID\"/done\n\
         if [ \"$(ls '{out}'/shard*/done | wc -l)\" -eq {count} ]; then\n\
         \x20 \"$program\" paper merge --out '{out}' '{out}'/shard[0-9]*\n\
         fi",
        quoted.join(" ")
    );
    Ok(())
}

/// A command line without some options and their values.
fn without(words: Vec<String>, options: &[&str]) -> Vec<String> {
    let mut kept = Vec::new();
    let mut words = words.into_iter();
    while let Some(word) = words.next() {
        if options.contains(&word.as_str()) {
            words.next();
        } else if !options
            .iter()
            .any(|option| word.strip_prefix(option).is_some_and(|rest| rest.starts_with('=')))
        {
            kept.push(word);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_all_of_it_and_disjoint() {
        for count in 1..6 {
            let mut all: Vec<u32> =
                (1..=count).flat_map(|index| part((0..17).collect(), Some(Shard { index, count }))).collect();
            all.sort_unstable();
            assert_eq!(all, (0..17).collect::<Vec<u32>>(), "{count} parts");
        }
        assert_eq!(part(vec![1, 2], None), [1, 2]);
    }

    #[test]
    fn a_part_is_written_as_a_fraction() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, count: 3 }));
        for wrong in ["0/3", "4/3", "1", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_script_s_command_line_has_no_option_twice() {
        let words =
            ["paper", "--slurm", "4", "--seeds=8", "--out", "x", "--slurm=4", "--outer"].map(str::to_owned);
        assert_eq!(without(words.to_vec(), &["--slurm", "--out"]), ["paper", "--seeds=8", "--outer"]);
    }
}
