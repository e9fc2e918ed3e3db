//! What is said of declared effects that the logs refute.

use phiw_report::number::significant;
use phiw_residual::trace::Withdrawn;

/// One sentence for each constant of a kind that is beyond the same bound on some joints and has left the
/// model, or stays in it.
pub fn sentences(withdrawn: &[Withdrawn]) -> Vec<String> {
    let mut alike: Vec<Vec<&Withdrawn>> = Vec::new();
    for effect in withdrawn {
        match alike.iter_mut().find(|others| key(others[0]) == key(effect)) {
            Some(others) => others.push(effect),
            None => alike.push(vec![effect]),
        }
    }
    alike.iter().map(|effects| sentence(effects)).collect()
}

/// What the sentence has in common for all of its joints.
fn key(effect: &Withdrawn) -> (&str, &str, bool, bool) {
    (&effect.spec.kind, &effect.name, is_below(effect), effect.kept)
}

fn is_below(effect: &Withdrawn) -> bool {
    effect.interval_95[1] < effect.bounds.0
}

fn sentence(effects: &[&Withdrawn]) -> String {
    let first = effects[0];
    let (bound, side) = match is_below(first) {
        true => (first.bounds.0, "below"),
        false => (first.bounds.1, "above"),
    };
    let what_follows = match (first.kept, effects.len()) {
        (true, 1) => "it stays, since without it the error on motion held out is larger",
        (true, _) => "they stay, since without them the error on motion held out is larger",
        (false, 1) => "it is not in the model",
        (false, _) => "they are not in the model",
    };
    let of_joint = |effect: &&Withdrawn| {
        let [low, high] = effect.interval_95.map(|value| significant(value, 3));
        format!("{low} to {high} {} of {}", effect.unit, effect.spec.joints.join(" and "))
    };
    format!(
        "{} was declared, and the logs refute it where its {} is certain (95 %) to be {side} {}, which it can not be: {}; \
         {what_follows}",
        first.spec.kind.replace('_', " "),
        first.name,
        significant(bound, 3),
        effects.iter().map(of_joint).collect::<Vec<_>>().join(", "),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_identification::EffectSpec;

    fn refuted(kind: &str, joint: &str, kept: bool) -> Withdrawn {
        Withdrawn {
            spec: EffectSpec::new(kind, &[joint]),
            name: "fc".to_owned(),
            unit: "N·m".to_owned(),
            interval_95: [-0.4, -0.2],
            bounds: (0.0, f64::INFINITY),
            kept,
        }
    }

    #[test]
    fn effects_of_one_kind_are_refuted_in_one_sentence() {
        let coulomb = |joint, kept| refuted("coulomb_friction", joint, kept);
        let said = sentences(&[
            coulomb("elbow", false),
            refuted("viscous_friction", "elbow", false),
            coulomb("wrist", false),
            coulomb("hip", true),
        ]);
        assert_eq!(
            said,
            [
                "coulomb friction was declared, and the logs refute it where its fc is certain (95 %) to be below 0, \
                 which it can not be: −0.400 to −0.200 N·m of elbow, −0.400 to −0.200 N·m of wrist; they are not in the model",
                "viscous friction was declared, and the logs refute it where its fc is certain (95 %) to be below 0, \
                 which it can not be: −0.400 to −0.200 N·m of elbow; it is not in the model",
                "coulomb friction was declared, and the logs refute it where its fc is certain (95 %) to be below 0, \
                 which it can not be: −0.400 to −0.200 N·m of hip; it stays, since without it the error on motion held \
                 out is larger",
            ]
        );
    }
}
