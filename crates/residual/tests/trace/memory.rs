//! Effects with memory, in logs that are read block by block.

use super::robot::{URDF, folds, record};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::{BlockSource, Data, EffectCatalogue, EffectSpec, Variants, identify};
use phiw_telemetry::{Conditioning, ConditioningOptions};

/// A hysteresis began anew in each block of a log, eight seconds long at a thousand samples a second, and was
/// fitted with what it had forgotten.
#[test]
fn a_hysteresis_is_the_same_however_long_blocks_are() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let catalogue = Catalogue::default();
    let log = record(&tree, 3, &|_, _| ());
    let surveys = [log.survey().unwrap()];
    let of_blocks = |block_samples: usize| {
        let options = ConditioningOptions { block_samples, ..ConditioningOptions::default() };
        let conditioning = Conditioning::choose(&surveys, &options).unwrap();
        let blocks = log.blocks(&conditioning).unwrap();
        let sources: Vec<&dyn BlockSource> = vec![&blocks];
        let (train, held_out) = folds();
        let data = Data { train, held_out, sources, rest_speeds: vec![0.01; 2] };
        let mut hysteresis = EffectSpec::new("hysteresis", &["elbow"]);
        hysteresis.constants.insert("presliding".into(), 0.2);
        let ranges = SignalRanges::of_surveys(&surveys);
        let mut declared: Vec<Variants> = ["viscous_friction", "coulomb_friction"]
            .into_iter()
            .flat_map(|kind| catalogue.declare(kind, &tree, &ranges).unwrap())
            .collect();
        declared.push(vec![catalogue.build(&hysteresis, &tree).unwrap()]);
        identify(&tree, declared, &data).unwrap().train.rmse[1]
    };
    let (short, whole) = (of_blocks(1 << 9), of_blocks(1 << 16));
    assert!((short / whole - 1.0).abs() < 1e-6, "{short} N·m, {whole} N·m");
}
