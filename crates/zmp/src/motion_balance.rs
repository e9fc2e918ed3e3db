//! The worst instant of a motion.

use crate::{Balance, SupportError, SupportPolygon, ZmpModel, ZmpWorkspace};
use phiw_dynamics::BodyKinematics;

/// What a robot stands on.
#[derive(Clone, Debug, PartialEq)]
pub struct Stance {
    /// The region that its ZMP must not leave: the support polygon, or the paper's bounds of it as a polygon.
    support: SupportPolygon,
    /// The point that the region shrinks to.
    about: [f64; 2],
    /// l_z.
    floor_height: f64,
}

impl Stance {
    /// A floor at `floor_height` \[m\] in the world, the region of it that carries, and the point that the
    /// region shrinks to when it is reduced (the origin in the paper's equation 10).
    ///
    /// # Errors
    /// The region cannot shrink to a point outside it.
    pub fn new(support: SupportPolygon, about: [f64; 2], floor_height: f64) -> Result<Self, SupportError> {
        crate::bounds::check_reduction(0.0, about, support.contains(about))?;
        Ok(Stance { support, about, floor_height })
    }

    /// The region.
    pub fn support(&self) -> &SupportPolygon {
        &self.support
    }

    /// The point that it shrinks to \[m\].
    pub fn about(&self) -> [f64; 2] {
        self.about
    }

    /// The floor's height in the world, l_z \[m\].
    pub fn floor_height(&self) -> f64 {
        self.floor_height
    }
}

/// One ZMP over a motion: its worst instants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstZmp {
    /// Smallest signed margin to the region's border \[m\]; −∞ if the robot leaves the floor at some sample, +∞ for a motion
    /// without samples.
    pub margin: f64,
    /// The sample at which it is that small.
    pub sample: usize,
    /// The ZMP there \[m\]; none where the robot does not press on the floor.
    pub zmp: Option<[f64; 2]>,
    /// The largest α at which the region reduced by (10) still contains the whole motion; negative if the
    /// whole region does not.
    pub largest_reduction: f64,
}

impl WorstZmp {
    /// Before the first sample.
    pub const NONE: WorstZmp =
        WorstZmp { margin: f64::INFINITY, sample: 0, zmp: None, largest_reduction: 1.0 };

    /// Takes in the ZMP of the sample `sample`.
    pub fn add(&mut self, sample: usize, zmp: Option<[f64; 2]>, stance: &Stance) {
        let (margin, reduction) = zmp.map_or((f64::NEG_INFINITY, f64::NEG_INFINITY), |zmp| {
            (stance.support.signed_margin(zmp), stance.support.largest_reduction(zmp, stance.about))
        });
        if margin < self.margin {
            *self = WorstZmp { margin, sample, zmp, ..*self };
        }
        self.largest_reduction = self.largest_reduction.min(reduction);
    }

    /// Whether the ZMP stays inside the region reduced by `alpha`: the constraint (12) with (10).
    pub fn is_allowed(&self, alpha: f64) -> bool {
        self.largest_reduction >= alpha
    }
}

/// Both ZMPs over a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionBalance {
    /// By equation (8).
    pub point_mass: WorstZmp,
    /// With angular momentum.
    pub multi_body: WorstZmp,
    /// Number of samples.
    pub samples: usize,
    /// Largest distance between the two \[m\].
    pub largest_difference: f64,
}

impl MotionBalance {
    /// Before the first sample.
    pub const NONE: MotionBalance = MotionBalance {
        point_mass: WorstZmp::NONE,
        multi_body: WorstZmp::NONE,
        samples: 0,
        largest_difference: 0.0,
    };

    /// Of a motion, sample by sample `[q, v, a]` as in [`ZmpWorkspace::evaluate`], for the standing
    /// parameters `parameters`.
    ///
    /// # Errors
    /// A slice or the workspace does not fit the robot, or the robot's motion can not be computed.
    pub fn of_motion<'a, K: BodyKinematics>(
        mut robot: K,
        parameters: &[f64],
        stance: &Stance,
        motion: impl IntoIterator<Item = [&'a [f64]; 3]>,
        workspace: &mut ZmpWorkspace,
    ) -> Result<Self, K::Error> {
        let mut balance = MotionBalance::NONE;
        for [q, v, a] in motion {
            balance.add(&workspace.evaluate(&mut robot, parameters, q, v, a)?, stance);
        }
        Ok(balance)
    }

    /// Takes in the next sample.
    pub fn add(&mut self, balance: &Balance, stance: &Stance) {
        let [point, bodies] =
            [ZmpModel::PointMass, ZmpModel::MultiBody].map(|model| balance.zmp(model, stance.floor_height));
        self.point_mass.add(self.samples, point, stance);
        self.multi_body.add(self.samples, bodies, stance);
        if let (Some(point), Some(bodies)) = (point, bodies) {
            let difference = (point[0] - bodies[0]).hypot(point[1] - bodies[1]);
            self.largest_difference = self.largest_difference.max(difference);
        }
        self.samples += 1;
    }

    /// The worst of one of the two.
    pub fn of(&self, model: ZmpModel) -> &WorstZmp {
        match model {
            ZmpModel::PointMass => &self.point_mass,
            ZmpModel::MultiBody => &self.multi_body,
        }
    }
}
