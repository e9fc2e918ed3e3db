//! Good inputs in bad surroundings: command lines, closed streams, full disks, little memory, places that
//! cannot be written.

use super::case::{Case, Class, Expectation};
use super::ground::Ground;
use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

const RUNS: [&str; 4] = ["identify", "explain", "next", "retarget"];

/// The classes.
pub fn classes() -> Vec<Class> {
    vec![
        Class::new("streams closed or full", 60, streams),
        Class::new("little memory", 60, memory),
        Class::new("files that may not grow", 60, file_size),
        Class::new("few open files", 30, open_files),
        Class::new("odd command lines", 120, command_lines),
        Class::new("results where an input is", 40, onto_input),
        Class::new("files that are no files", 40, no_file),
    ]
}

fn any_run(ground: &Ground, expectation: Expectation, random: &mut ChaCha8Rng) -> Case {
    let key = *RUNS.choose(random).unwrap_or(&RUNS[0]);
    Case::new(ground, key, expectation, key.to_owned())
}

fn streams(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut case = any_run(ground, Expectation::Starved, random);
    let redirect = *["2>&-", ">&-", ">/dev/full", "2>/dev/full", "<&- >&- 2>&-", "2>/dev/full >/dev/full"]
        .choose(random)
        .unwrap_or(&"2>&-");
    case.shell = format!("{} {redirect}", Case::PLAIN);
    case.story += &format!(" {redirect}");
    case
}

fn memory(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut case = any_run(ground, Expectation::Starved, random);
    let kilobytes = random.random_range(40_000..600_000);
    case.shell = format!("export RAYON_NUM_THREADS=1; ulimit -v {kilobytes}; {}", Case::PLAIN);
    case.story += &format!(" in {kilobytes} kB of address space, one thread");
    case
}

fn file_size(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut case = any_run(ground, Expectation::Starved, random);
    let blocks = random.random_range(0..60);
    // The signal would kill the program; ignored, the write fails as on a full disk.
    case.shell = format!("trap '' XFSZ; ulimit -f {blocks}; {}", Case::PLAIN);
    case.story += &format!(" with files of at most {blocks} blocks");
    case
}

fn open_files(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut case = any_run(ground, Expectation::Starved, random);
    let files = random.random_range(4..24);
    case.shell = format!("ulimit -n {files}; {}", Case::PLAIN);
    case.story += &format!(" with {files} open files");
    case
}

fn command_lines(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    const ODD: [&str; 18] = [
        "",
        "-",
        "--",
        "--urdf",
        "--out=",
        "--train=",
        "nan",
        "\u{1b}[2J",
        "../../x",
        "--declare=nothing",
        "--declare=,,",
        "--hold=joint_1=1e400",
        "--hold=nowhere",
        "--cutoff-hz=-1",
        "--cutoff-hz=nan",
        "--parallel-cutoff-hz=0",
        "--validate=robot.urdf",
        "--train=/dev/zero",
    ];
    let mut case = any_run(ground, Expectation::Starved, random);
    let odd = (*ODD.choose(random).unwrap_or(&"")).to_owned();
    let at = random.random_range(0..=case.words.len());
    case.story += &match random.random_range(0..3) {
        0 => {
            case.words.insert(at, odd.clone());
            format!(": `{}` as word {at}", odd.escape_debug())
        }
        1 => {
            let at = at.min(case.words.len() - 1);
            let lost = case.words.remove(at);
            format!(": without `{lost}`")
        }
        _ => {
            case.words.push(odd.clone());
            format!(": `{}` at the end", odd.escape_debug())
        }
    };
    case
}

fn onto_input(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut case = any_run(ground, Expectation::Refused, random);
    let inputs = &ground.run(case.good).files;
    let input = inputs.choose(random).cloned().unwrap_or_default();
    if let Some(out) = case.words.last_mut() {
        out.clone_from(&input);
    }
    case.story += &format!(" --out {input}");
    case
}

fn no_file(ground: &Ground, random: &mut ChaCha8Rng) -> Case {
    let mut case = any_run(ground, Expectation::Refused, random);
    let inputs: Vec<usize> =
        (0..case.words.len()).filter(|&at| ground.run(case.good).files.contains(&case.words[at])).collect();
    let at = inputs.choose(random).copied().unwrap_or_default();
    let other = *["/dev/zero", "/dev/random", ".", "nowhere.csv", "pipe", "/proc/self/mem"]
        .choose(random)
        .unwrap_or(&".");
    case.story += &format!(": {other} for {}", case.words[at]);
    case.words[at] = other.to_owned();
    if other == "pipe" {
        case.shell = format!("mkfifo pipe; {}", Case::PLAIN);
    }
    case
}
