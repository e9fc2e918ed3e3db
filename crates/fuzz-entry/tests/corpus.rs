//! The kept corpus, and some hundred inputs more, on every run.

use phiw_fuzz_entry::{TARGETS, random_log, random_robot};
use proptest::prelude::*;
use std::path::Path;

#[test]
fn the_corpus_is_survived() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for (name, target) in TARGETS {
        let files: Vec<_> =
            std::fs::read_dir(corpus.join(name)).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty(), "{name} has no corpus");
        for file in files {
            println!("{}", file.display());
            target(&std::fs::read(file).unwrap());
        }
    }
}

/// Each file of the corpus with one byte changed, which readers of binary files are sensitive to.
#[test]
fn spoiled_files_of_the_corpus_are_survived() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    for (name, target) in TARGETS {
        for entry in std::fs::read_dir(corpus.join(name)).unwrap() {
            let good = std::fs::read(entry.unwrap().path()).unwrap();
            for place in (0..good.len()).step_by((good.len() / 40).max(1)) {
                let mut spoiled = good.clone();
                spoiled[place] ^= 0x81;
                target(&spoiled);
                target(&good[..place]);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn random_robots_and_logs_are_survived(bytes in prop::collection::vec(any::<u8>(), 200..3000)) {
        random_robot(&bytes);
        random_log(&bytes);
    }
}
