//! Frictions that have a viscous part, a dry one, or both.

use crate::bristles::Bristles;
use crate::columns::Formula;
use phiw_identification::effect::Sample;

/// The constant that says which of the two there are.
pub(crate) const PART: &str = "part";
/// The viscous one alone.
pub(crate) const VISCOUS: f64 = 0.0;
/// The dry one alone.
pub(crate) const DRY: f64 = 1.0;
/// Both, the viscous one first.
pub(crate) const BOTH: f64 = 2.0;

/// A viscous and a dry friction, each in a column of its own, or one of them.
pub(crate) struct ViscousAndDry<V, D> {
    pub part: f64,
    pub viscous: V,
    pub dry: Bristles<D>,
}

impl<V, D> Formula for ViscousAndDry<V, D>
where
    V: Fn(&Sample<'_>) -> f64 + Send + Sync,
    D: Fn(&Sample<'_>) -> f64 + Send + Sync,
{
    type Memory = <Bristles<D> as Formula>::Memory;

    fn columns(&self, memory: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]) {
        if self.part != DRY {
            columns[0] = (self.viscous)(sample);
        }
        if self.part != VISCOUS {
            let place = columns.len() - 1;
            self.dry.columns(memory, sample, &mut columns[place..]);
        }
    }
}

/// Of what describes the viscous and the dry part, that of the parts that there are.
pub(crate) fn of_part<T>(part: f64, both: &[T; 2]) -> &[T] {
    match part {
        VISCOUS => &both[..1],
        DRY => &both[1..],
        _ => &both[..],
    }
}
