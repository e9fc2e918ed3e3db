//! What is said of the bodies that can exist, in words and in `report.json`.

use crate::analysis::Analysis;
use crate::page::counted;
use crate::report_json::by_joint;
use crate::session::Session;
use crate::{Error, extents};
use phiw_identification::consistent::{Consistent, ConsistentSettings, Ellipsoid, Known, consistent};
use phiw_identification::fitting::{Fit, TorqueError};
use phiw_identification::{Data, Identified};
use phiw_report::json::{ConsistencyJson, OfBothFits};
use phiw_report::number::percent;

/// The fit over bodies that can exist, and what least squares says beside it.
pub struct PossibleBodies {
    /// The fit.
    pub consistent: Consistent,
    /// Bodies that least squares has made impossible, by the joints that carry them.
    pub impossible: Vec<String>,
    /// The error of least squares on motion held out.
    pub least_squares: TorqueError,
    /// What is said of links whose geometry is not known.
    unknown_extents: Option<String>,
}

impl PossibleBodies {
    /// Of a model that was identified by least squares. It takes the possible bodies where these foretell
    /// better. Without its rows it does not where its columns are made of its own torque.
    ///
    /// # Errors
    /// What is known of the bodies contradicts itself, or a log cannot be read any more.
    pub fn settle(
        session: &Session,
        identified: Identified,
        data: Option<&Data<'_>>,
    ) -> Result<(Identified, Self), Error> {
        if data.is_none() && identified.design.needs().of_reference() {
            let own = Self::beside_held(session, &identified)?;
            return Ok((identified, own));
        }
        let own = Self::beside(session, &identified)?;
        let (identified, is_taken) = identified.with_possible(&own.consistent, data)?;
        Ok((identified, own.taken_as_the_model(is_taken)))
    }

    /// Of a model that stays as it is: one that more than these logs has told.
    ///
    /// # Errors
    /// What is known of the bodies contradicts itself.
    pub fn beside_held(session: &Session, identified: &Identified) -> Result<Self, Error> {
        Ok(Self::beside(session, identified)?.taken_as_the_model(false))
    }

    fn taken_as_the_model(mut self, is_taken: bool) -> Self {
        self.consistent.foretells_better = is_taken;
        self
    }

    fn beside(session: &Session, identified: &Identified) -> Result<Self, Error> {
        let (known, unknown_extents) = known(session)?;
        let settings = ConsistentSettings { known, ..ConsistentSettings::default() };
        let Identified { design, fit, train_folds, held_out_folds, .. } = identified;
        let consistent = consistent(design, fit, train_folds, held_out_folds, &settings)?;
        let joint = |&body: &usize| design.tree().bodies()[body].joint.clone();
        Ok(PossibleBodies {
            impossible: consistent.impossible_by_least_squares.iter().map(joint).collect(),
            least_squares: identified.held_out.clone(),
            consistent,
            unknown_extents,
        })
    }

    /// A warning where least squares has made bodies that cannot exist, or effects out of their bounds.
    pub fn warnings(&self, bodies: usize, fit: &Fit) -> Vec<String> {
        let mut warnings: Vec<String> = self.unknown_extents.iter().cloned().collect();
        if !self.impossible.is_empty() {
            let what = match self.consistent.foretells_better {
                true => {
                    "the model has the possible ones that fit best, which foretell training motion that is left out better"
                }
                false => "identified.urdf holds the possible ones that fit best, model.json both",
            };
            warnings.push(format!(
                "no distribution of mass has the least-squares parameters of {} of {} ({}): {what}",
                self.impossible.len(),
                counted(bodies, "body").replace("bodys", "bodies"),
                self.impossible.join(", ")
            ));
        }
        if !self.consistent.certified {
            warnings.push(format!(
                "the fit of possible bodies is not certified: it may be {:.1e} above its optimum (training residuals as small as {:.1e} leave too few digits)",
                self.consistent.gap,
                fit.residual_std.iter().copied().fold(f64::INFINITY, f64::min)
            ));
        }
        warnings
    }
}

/// What possible bodies cost, in one sentence.
pub fn sentence(analysis: &Analysis<'_>) -> String {
    let PossibleBodies { consistent, impossible, least_squares, .. } = &analysis.possible;
    let bodies = analysis.model.bodies.len();
    let why = match impossible.len() {
        0 => "by least squares, whose bodies can exist, too".to_owned(),
        count => format!("by least squares, {count} of whose {bodies} bodies cannot exist"),
    };
    format!(
        "With bodies that can exist (identified.urdf) the held-out error is {} %; {} % {why}.",
        percent(consistent.held_out.relative),
        percent(least_squares.relative)
    )
}

/// The same as numbers.
pub fn json(analysis: &Analysis<'_>) -> ConsistencyJson {
    let joints = analysis.joints();
    let PossibleBodies { consistent, impossible, least_squares, .. } = &analysis.possible;
    let both: Vec<OfBothFits> = (consistent.held_out.rmse.iter().zip(&least_squares.rmse))
        .map(|(&consistent, &least_squares)| OfBothFits { least_squares, consistent })
        .collect();
    ConsistencyJson {
        prior_weight: consistent.weight,
        gap: consistent.gap,
        certified: consistent.certified,
        is_model: consistent.foretells_better,
        impossible: impossible.clone(),
        validate: by_joint(&joints, &both),
        validate_relative: OfBothFits {
            least_squares: least_squares.relative,
            consistent: consistent.held_out.relative,
        },
    }
}

/// What the user knows of the bodies, and a warning where geometry that was asked for is not known.
fn known(session: &Session) -> Result<(Vec<Known>, Option<String>), Error> {
    let bodies = session.tree.bodies();
    let body_of = |link: &String| {
        let links = || bodies.iter().map(|body| body.link.as_str()).collect::<Vec<_>>().join(", ");
        let body = bodies.iter().position(|body| body.link == *link);
        body.ok_or_else(|| Error::UnknownLink { link: link.clone(), links: links() })
    };
    let mut known = Vec::new();
    for (link, mass) in &session.arguments.mass {
        known.push(Known::Mass(body_of(link)?, *mass));
    }
    for (link, [x, y, z, a, b, c]) in &session.arguments.inside {
        let ellipsoid = Ellipsoid { center: [*x, *y, *z], half_axes: [*a, *b, *c] };
        known.push(Known::Inside(body_of(link)?, ellipsoid));
    }
    let mut warning = None;
    if session.arguments.inside_geometry {
        let (extents, unknown) = extents::of_bodies(session);
        let given: Vec<usize> =
            session.arguments.inside.iter().map(|(link, _)| body_of(link)).collect::<Result<_, _>>()?;
        let others = extents.into_iter().filter(|(body, _)| !given.contains(body));
        known.extend(others.map(|(body, extent)| Known::InsideBox(body, extent.lower, extent.upper)));
        warning = unknown;
    }
    for (link, image) in &session.arguments.mirrored {
        known.push(Known::Mirrored(body_of(link)?, body_of(image)?));
    }
    let of_links: f64 = session.arguments.mass.iter().map(|(_, mass)| mass).sum();
    if let Some(total) = session.arguments.total_mass {
        if session.arguments.mass.len() >= bodies.len() || of_links >= total {
            return Err(Error::TotalMass { total, of_links });
        }
        known.push(Known::TotalMass(total));
    }
    Ok((known, warning))
}
