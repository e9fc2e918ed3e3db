//! Frictions with a memory: torques of the way since the last reversal.

/// A friction that builds up over a way, not at once.
#[derive(Clone, Debug, PartialEq)]
pub enum Presliding {
    /// Springs in parallel, each of which slips at its own torque (Iwan 1966): `[yield way [rad, m], slip
    /// torque [N·m, N]]`.
    MaxwellSlip {
        /// The springs.
        elements: Vec<[f64; 2]>,
    },
    /// LuGre's bristles without micro-damping (Canudas de Wit et al. 1995): ż = q̇ − |q̇|·z/way;
    /// torque·z/way.
    LuGre {
        /// Torque when sliding \[N·m, N\].
        torque: f64,
        /// Way over which the bristles bend \[rad, m\].
        way: f64,
    },
}

impl Presliding {
    /// How many numbers it remembers.
    pub(crate) fn memory_size(&self) -> usize {
        match self {
            Presliding::MaxwellSlip { elements } => elements.len(),
            Presliding::LuGre { .. } => 1,
        }
    }

    /// Torque at the end of a step that is made at `speed`. It rises with the speed, so a step can be solved
    /// for it.
    pub(crate) fn torque(&self, memory: &[f64], speed: f64, step_s: f64) -> f64 {
        match self {
            Presliding::MaxwellSlip { elements } => {
                let slip = |(force, &element): (&f64, &[f64; 2])| slipped(*force, element, speed * step_s);
                memory.iter().zip(elements).map(slip).sum()
            }
            Presliding::LuGre { torque, way } => bent(memory[0], *torque, *way, speed * step_s),
        }
    }

    /// Remembers the step.
    pub(crate) fn advance(&self, memory: &mut [f64], speed: f64, step_s: f64) {
        match self {
            Presliding::MaxwellSlip { elements } => {
                for (force, &element) in memory.iter_mut().zip(elements) {
                    *force = slipped(*force, element, speed * step_s);
                }
            }
            Presliding::LuGre { torque, way } => memory[0] = bent(memory[0], *torque, *way, speed * step_s),
        }
    }
}

/// A spring's force after a way, no more than its slip force.
fn slipped(force: f64, [yield_way, limit]: [f64; 2], way: f64) -> f64 {
    (force + way * limit / yield_way).clamp(-limit, limit)
}

/// The bristles' force after a way in one direction: the exact solution of their equation.
fn bent(force: f64, torque: f64, bristle_way: f64, way: f64) -> f64 {
    let end = torque * way.signum();
    end + (force - end) * (-way.abs() / bristle_way).exp()
}

#[cfg(test)]
mod tests {
    use super::Presliding;

    /// A slow sinusoid there and back: the torque stays in bounds, and the cycle takes energy.
    fn check(law: &Presliding, limit: f64) {
        let (mut memory, mut work) = (vec![0.0; law.memory_size()], 0.0);
        let mut highest = 0.0_f64;
        for step in 0..4000 {
            let speed = (step as f64 * 1e-3 * std::f64::consts::TAU).cos();
            let torque = law.torque(&memory, speed, 1e-3);
            law.advance(&mut memory, speed, 1e-3);
            assert!((torque - law.torque(&memory, 0.0, 1e-3)).abs() < 1e-12);
            work += torque * speed * 1e-3;
            highest = highest.max(torque.abs());
        }
        assert!(highest <= limit * (1.0 + 1e-12) && highest > 0.99 * limit, "{highest} of {limit}");
        assert!(work > 0.0);
    }

    #[test]
    fn memories_are_bounded_and_dissipate() {
        check(&Presliding::MaxwellSlip { elements: vec![[0.02, 0.5], [0.05, 1.0], [0.1, 0.5]] }, 2.0);
        check(&Presliding::LuGre { torque: 1.5, way: 0.01 }, 1.5);
    }

    #[test]
    fn a_reversal_of_a_maxwell_spring_is_a_straight_line_of_twice_its_yield_way() {
        let law = Presliding::MaxwellSlip { elements: vec![[0.1, 2.0]] };
        let mut memory = vec![2.0];
        for step in 1..=20 {
            law.advance(&mut memory, -1.0, 0.01);
            assert!((memory[0] - (2.0 - 0.2 * f64::from(step))).abs() < 1e-12);
        }
        law.advance(&mut memory, -1.0, 0.01);
        assert_eq!(memory[0], -2.0);
    }
}
