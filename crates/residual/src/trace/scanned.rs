//! Constants that were found by scanning, with their deviations.

use phiw_effects::{Catalogue, Constants, SignalRanges};
use phiw_identification::fitting::{ByConstant, FreeConstant, accumulate, free_constants};
use phiw_identification::{Data, Design, Effect, EffectCatalogue, IdentificationError, Identified};

/// The derivative is taken over this share of the way to the nearest others that a kind would look at first.
const SHARE: f64 = 0.01;
/// First order is taken to hold this many times as far, but no further than half of the constant, unless its
/// kind looks further at once.
const REACH: f64 = 5.0;

/// A constant of an effect in which the model is not linear.
#[derive(Clone, Debug, PartialEq)]
pub struct ScannedConstant {
    /// The effect: its place in the design.
    pub effect: usize,
    /// The constant's name.
    pub name: String,
    /// Its value, as the model has it (SI units).
    pub value: f64,
    /// How sure it is; none where the logs tell it so poorly that a first order says nothing.
    pub free: Option<FreeConstant>,
}

/// The constants of a fitted model that its kinds refine within `ranges`, as sure as the training folds are
/// of them; the model's own deviations and intervals are then of parameters with these constants free.
///
/// One more pass over the training motion, where there is any such constant.
///
/// # Errors
/// A log cannot be read any more.
pub fn scanned_constants(
    catalogue: &Catalogue,
    ranges: &SignalRanges,
    model: &mut Identified,
    data: &Data<'_>,
) -> Result<Vec<ScannedConstant>, IdentificationError> {
    scanned_constants_of(catalogue, ranges, model, data, |_, _| true)
}

/// The same for those constants only, by their effects' places in the design and their names; the others are
/// taken for known.
pub(super) fn scanned_constants_of(
    catalogue: &Catalogue,
    ranges: &SignalRanges,
    model: &mut Identified,
    data: &Data<'_>,
    is_free: impl Fn(usize, &str) -> bool,
) -> Result<Vec<ScannedConstant>, IdentificationError> {
    let Identified { design, fit, .. } = model;
    let tree = design.tree();
    let (mut constants, mut reaches) = (Vec::new(), Vec::new());
    let mut derivatives: Vec<Box<dyn Effect>> = Vec::new();
    for (index, effect) in design.effects().iter().enumerate() {
        let (spec, parameters) = (effect.spec(), effect.parameters());
        let near = catalogue.refined(&spec, tree, ranges, 0)?;
        for (name, &value) in &spec.constants {
            // Where it stands for a parameter, that has the deviation.
            if !is_free(index, name) || parameters.iter().any(|parameter| parameter.name == *name) {
                continue;
            }
            // What differs in a second constant, too, is another form and no step of this one.
            let alone = near.iter().filter(|near| differ_alone(near, &spec.constants, name));
            let ways = alone.filter_map(|near| near.get(name)).map(|near| (near - value).abs());
            let Some(reach) = ways.filter(|way| *way > 0.0).min_by(f64::total_cmp) else { continue };
            let step = SHARE * reach;
            let beside = |side: f64| catalogue.build(&spec.clone().with(name, value + side * step), tree);
            let values = &fit.parameters[design.effect_parameters(index)];
            let sides = [beside(-1.0)?, beside(1.0)?];
            derivatives.push(Box::new(ByConstant::new(spec.clone(), name, sides, values, step)));
            constants.push(ScannedConstant { effect: index, name: name.clone(), value, free: None });
            reaches.push((REACH * reach).min(0.5 * value.abs()).max(reach));
        }
    }
    if constants.is_empty() {
        return Ok(constants);
    }
    let built = design.effects().iter().map(|effect| catalogue.build(&effect.spec(), tree));
    let mut effects: Vec<Box<dyn Effect>> = built.collect::<Result<_, _>>()?;
    effects.extend(derivatives);
    let mut parameters = fit.parameters.clone();
    parameters.resize(parameters.len() + constants.len(), 0.0);
    let wider = Design::new(tree.clone(), design.base().clone(), effects)
        .with_rest_speeds(design.rest_speeds().to_vec())
        .with_own_reference(&parameters)?;
    let folds = accumulate(&wider, &data.train, &data.sources)?;
    let values: Vec<(f64, f64)> = constants.iter().map(|constant| constant.value).zip(reaches).collect();
    let free = free_constants(fit, &folds, &values)?;
    constants.iter_mut().zip(free).for_each(|(constant, free)| constant.free = free);
    Ok(constants)
}

/// Whether two sets of constants agree in all but `name`.
fn differ_alone(one: &Constants, other: &Constants, name: &str) -> bool {
    let without = |constants: &Constants| {
        let mut constants = constants.clone();
        constants.remove(name);
        constants
    };
    without(one) == without(other)
}
