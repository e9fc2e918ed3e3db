//! What the logs tell, in words: by link and parameter, in sums that are written out, or not at all; and
//! which motion would tell more.

use crate::Error;
use crate::next::motions;
use crate::session::Session;
use crate::warnings::file_name;
use phiw_curriculum::CurriculumError;
use phiw_dynamics::Tree;
use phiw_dynamics::inertia::{PARAMETER_NAMES, PARAMETERS_PER_BODY};
use phiw_estimation::grouped_factor;
use phiw_identification::consistent::Consistent;
use phiw_identification::model::standard_unit;
use phiw_identification::told::{InformationSettings, Told, told};
use phiw_identification::{Design, EffectCatalogue, IdentificationError, Identified};
use phiw_report::json::{InformationJson, TellingMotionJson, ToldJson};
use phiw_report::number::significant;
use phiw_report::page::ToldSection;
use rayon::prelude::*;

/// Motions that are named.
const MOTIONS: usize = 3;
/// Masses that a terminal shows.
const MASSES: usize = 4;

/// What the logs of a session tell of a fitted design; with a folder of motions, what these would.
///
/// # Errors
/// A motion cannot be read.
pub fn information(
    session: &Session,
    identified: &Identified,
    consistent: &Consistent,
) -> Result<InformationJson, Error> {
    let Identified { design, fit, train_folds, .. } = identified;
    let told = told(design, fit, train_folds, consistent, InformationSettings::default())?;
    let names = names(design);
    let offsets = offsets(design);
    let sums = told.sums();
    let number = |name: String, leading: usize, value: f64, std: f64| ToldJson {
        name,
        value,
        std,
        unit: names[leading].unit.clone(),
    };
    let alone = told.alone().into_iter().map(|(parameter, value, std)| {
        number(names[parameter].words.clone(), parameter, value + offsets[parameter], std)
    });
    let sum_of = |terms: &[(usize, f64)]| -> f64 {
        terms.iter().map(|(parameter, factor)| factor * offsets[*parameter]).sum()
    };
    let in_sums = sums.iter().map(|sum| {
        let leading = sum.terms[0].0;
        number(written(&sum.terms, &names), leading, sum.value + sum_of(&sum.terms), sum.std)
    });
    Ok(InformationJson {
        narrower_by: told.narrower_by(),
        parameters: told.parameters(),
        directions: told.directions(),
        told: alone.collect(),
        sums: in_sums.collect(),
        not_told: told
            .not_at_all(&sums)
            .into_iter()
            .map(|parameter| names[parameter].words.clone())
            .collect(),
        motions: match &session.arguments.motions {
            Some(_) => telling(session, design, &told, &names)?,
            None => Vec::new(),
        },
    })
}

/// A parameter in words.
struct Name {
    /// `mass of forearm`, `viscous friction of elbow`.
    words: String,
    unit: String,
}

fn names(design: &Design) -> Vec<Name> {
    let tree = design.tree();
    let of_body = |parameter: usize| {
        let own = parameter % PARAMETERS_PER_BODY;
        Name { words: standard_name(tree, parameter), unit: standard_unit(own).to_owned() }
    };
    let mut names: Vec<Name> = (0..PARAMETERS_PER_BODY * tree.bodies().len()).map(of_body).collect();
    for effect in design.effects() {
        let (kind, parameters) = (effect.spec().kind.replace('_', " "), effect.parameters());
        let several = parameters.len() > 1;
        names.extend(parameters.into_iter().map(|parameter| Name {
            words: match several {
                true => format!("{kind} ({}) of {}", parameter.name, parameter.joint),
                false => format!("{kind} of {}", parameter.joint),
            },
            unit: parameter.unit,
        }));
    }
    names
}

/// `mass of forearm`, `first moment x of forearm`, `Ixx of forearm`: the link's name, not the joint's.
fn standard_name(tree: &Tree, parameter: usize) -> String {
    let link = &tree.bodies()[parameter / PARAMETERS_PER_BODY].link;
    match parameter % PARAMETERS_PER_BODY {
        0 => format!("mass of {link}"),
        1 => format!("first moment x of {link}"),
        2 => format!("first moment y of {link}"),
        3 => format!("first moment z of {link}"),
        own => format!("{} of {link}", PARAMETER_NAMES[own]),
    }
}

/// What a parameter that was fitted by linearisation has in the constant of the same name.
fn offsets(design: &Design) -> Vec<f64> {
    let mut offsets = vec![0.0; PARAMETERS_PER_BODY * design.tree().bodies().len()];
    for effect in design.effects() {
        let constants = effect.spec().constants;
        let at = |name: &String| constants.get(name).copied().unwrap_or_default();
        offsets.extend(effect.parameters().iter().map(|parameter| at(&parameter.name)));
    }
    offsets
}

/// `Izz of upper_arm + 0.25 · mass of forearm`.
fn written(terms: &[(usize, f64)], names: &[Name]) -> String {
    let mut text = String::new();
    for (index, (parameter, factor)) in terms.iter().enumerate() {
        match (index, *factor < 0.0) {
            (0, _) => {}
            (_, true) => text.push_str(" − "),
            (_, false) => text.push_str(" + "),
        }
        if (factor.abs() - 1.0).abs() > 5e-4 {
            text.push_str(&format!("{} · ", significant(factor.abs(), 3)));
        }
        text.push_str(&names[*parameter].words);
    }
    text
}

/// The motions of the folder that would tell most of what is not told, best first.
fn telling(
    session: &Session,
    design: &Design,
    told: &Told,
    names: &[Name],
) -> Result<Vec<TellingMotionJson>, Error> {
    let Some(folder) = &session.arguments.motions else { return Ok(Vec::new()) };
    let interrupted = || session.arguments.in_memory.interruption.is_called_off();
    let motions = motions::read_all(folder, &session.tree, &|_, _, _| ())?;
    // Effects that need torques or measured signals say nothing before the motion has been run.
    let foreseeable: Vec<usize> =
        (0..design.effects().len()).filter(|&effect| design.effects()[effect].needs().is_empty()).collect();
    let base = design.base().count();
    let parameters: Vec<usize> =
        (0..base).chain(foreseeable.iter().flat_map(|&effect| design.effect_parameters(effect))).collect();
    let plan = session.logs.conditioning().plan(&session.logs.surveys()[0])?;
    let rows = |motion: &phiw_curriculum::motion::Motion| -> Result<_, Error> {
        if interrupted() {
            return Err(Error::Interrupted);
        }
        let build =
            |&effect: &usize| session.catalogue.build(&design.effects()[effect].spec(), &session.tree);
        let effects = foreseeable.iter().map(build).collect::<Result<_, _>>()?;
        let own = Design::new(session.tree.clone(), design.base().clone(), effects);
        let factor = grouped_factor(&own, motion.block()).map_err(CurriculumError::from)?;
        let share = motion.period_s() * plan.output_rate_hz();
        let rows = told.rows(design, &factor, &parameters, share).map_err(IdentificationError::from)?;
        let nats = told.nats_of_untold(&rows).map_err(IdentificationError::from)?;
        Ok((nats, rows))
    };
    let all: Result<Vec<_>, Error> = motions.dataset.motions().par_iter().map(rows).collect();
    let mut all: Vec<_> = all?.into_iter().zip(&motions.files).collect();
    all.sort_by(|((a, _), _), ((b, _), _)| b.total_cmp(a));
    let before: Vec<usize> = told.alone().iter().map(|told| told.0).collect();
    let of_motion = |((nats, rows), file): (_, &std::path::PathBuf)| {
        let with: Told = told.with_rows(&rows).map_err(IdentificationError::from)?;
        let new = with.alone().into_iter().map(|told| told.0).filter(|told| !before.contains(told));
        Ok(TellingMotionJson {
            file: file_name(file),
            nats,
            directions: with.directions().saturating_sub(told.directions()),
            tells: new.map(|parameter| names[parameter].words.clone()).collect(),
        })
    };
    all.into_iter().take(MOTIONS).map(of_motion).collect()
}

/// The page's section.
pub fn section(information: &InformationJson) -> ToldSection {
    let line = |told: &ToldJson| format!("{}: {}", told.name, value(told));
    ToldSection {
        note: format!(
            "Told is what the logs make at least {} times narrower than it was believed before: a body as \
             the URDF has it, its mass give or take itself; an effect, up to a joint's whole torque. {} of \
             {} directions of all parameters are. Values are those of bodies that can exist \
             (identified.urdf), ± one standard deviation.",
            information.narrower_by, information.directions, information.parameters
        ),
        told: information.told.iter().map(line).collect(),
        sums: information.sums.iter().map(line).collect(),
        not_told: by_owner(&information.not_told),
        motions: motion_lines(information),
    }
}

/// `2.31 ± 0.04 kg`.
fn value(told: &ToldJson) -> String {
    format!("{} ± {} {}", significant(told.value, 4), significant(told.std, 2), told.unit)
}

/// `forearm: mass, Ixx` of `mass of forearm` and `Ixx of forearm`.
fn by_owner(names: &[String]) -> Vec<String> {
    let mut owners: Vec<(&str, Vec<&str>)> = Vec::new();
    for name in names {
        let (what, owner) = name.split_once(" of ").unwrap_or((name, ""));
        match owners.iter_mut().find(|(known, _)| *known == owner) {
            Some((_, own)) => own.push(what),
            None => owners.push((owner, vec![what])),
        }
    }
    owners.into_iter().map(|(owner, own)| format!("{owner}: {}", own.join(", "))).collect()
}

fn motion_lines(information: &InformationJson) -> Vec<String> {
    let line = |motion: &TellingMotionJson| {
        let tells = match motion.tells.as_slice() {
            [] => "no parameter by itself".to_owned(),
            tells => tells.join(", "),
        };
        let nats = significant(motion.nats, 2);
        format!(
            "{}: {nats} nats of what is not told; {} more directions, with them {tells}",
            motion.file, motion.directions
        )
    };
    information.motions.iter().map(line).collect()
}

/// A few lines for a terminal.
pub fn summary(information: &InformationJson) -> Vec<String> {
    let InformationJson { told, sums, not_told, narrower_by, .. } = information;
    let mut lines = vec![format!(
        "told by the logs ({} times narrower than believed before): {} parameters by themselves, {} sums; not at all: {} (report.html names them)",
        narrower_by,
        told.len(),
        sums.len(),
        not_told.len()
    )];
    let masses = told.iter().filter(|told| told.name.starts_with("mass of "));
    let masses: Vec<String> =
        masses.take(MASSES).map(|told| format!("{} {}", told.name, value(told))).collect();
    lines.extend((!masses.is_empty()).then(|| masses.join("; ")));
    lines.extend(motion_lines(information).first().map(|line| format!("next, {line}")));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_gathered_by_link() {
        let names = ["mass of arm", "Ixx of arm", "viscous friction of j1", "Iyy of fore of arm"];
        let names: Vec<String> = names.map(str::to_owned).to_vec();
        assert_eq!(by_owner(&names), ["arm: mass, Ixx", "j1: viscous friction", "fore of arm: Iyy"]);
    }

    #[test]
    fn a_sum_is_written_with_its_factors() {
        let names: Vec<Name> = ["Izz of a", "mass of b", "Izz of b"]
            .map(|words| Name { words: words.to_owned(), unit: "kg·m²".to_owned() })
            .into();
        let sum = [(0, 1.0), (2, 1.0), (1, -0.25)];
        assert_eq!(written(&sum, &names), "Izz of a + Izz of b − 0.250 · mass of b");
    }
}
