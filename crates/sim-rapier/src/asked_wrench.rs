//! The wrench at the base in a motion that inverse dynamics was asked for: computed when somebody wants it.
//!
//! The engine has no inverse dynamics that would give it on the way, and a pass of this workspace's own takes
//! a good part of the time that the engine needs.

use phiw_dynamics::{AnalyticBackend, DynamicsBackend};
use std::cell::RefCell;

/// A motion, and the wrench once it is known.
pub(crate) struct AskedWrench {
    inner: RefCell<Inner>,
}

struct Inner {
    analytic: AnalyticBackend,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    force: Vec<f64>,
    wrench: Option<[f64; 6]>,
}

impl AskedWrench {
    pub(crate) fn new(analytic: AnalyticBackend) -> Self {
        let (q, v) = (vec![0.0; analytic.configuration_size()], vec![0.0; analytic.velocity_size()]);
        let inner = Inner { analytic, q, a: v.clone(), force: v.clone(), v, wrench: Some([0.0; 6]) };
        AskedWrench { inner: RefCell::new(inner) }
    }

    /// Keeps a motion. Sizes are the caller's duty.
    pub(crate) fn ask(&mut self, q: &[f64], v: &[f64], a: &[f64]) {
        let inner = self.inner.get_mut();
        inner.q.copy_from_slice(q);
        inner.v.copy_from_slice(v);
        inner.a.copy_from_slice(a);
        inner.wrench = None;
    }

    /// Keeps a wrench that is known.
    pub(crate) fn set(&mut self, wrench: [f64; 6]) {
        self.inner.get_mut().wrench = Some(wrench);
    }

    /// The wrench; not a number for a motion that is not finite.
    pub(crate) fn get(&self) -> [f64; 6] {
        let Inner { analytic, q, v, a, force, wrench } = &mut *self.inner.borrow_mut();
        *wrench.get_or_insert_with(|| match analytic.inverse_dynamics(q, v, a, force) {
            Ok(()) => analytic.base_wrench(),
            Err(_) => [f64::NAN; 6],
        })
    }
}
