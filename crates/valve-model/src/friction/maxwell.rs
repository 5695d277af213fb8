//! Maxwell-slip elements: springs in parallel, each of which slips at a torque of its own. F_h(z) = Σ f_i,
//! df_i = k_i·dz while |f_i| < W_i, else df_i = 0. Their torques are the non-local memory of presliding.

use serde::{Deserialize, Serialize};

/// The most elements that a law may have.
pub(crate) const MAX_ELEMENTS: usize = 16;

/// Elements summed side by side.
const LANES: usize = 4;

/// Stiffness and slip torques of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Maxwell {
    count: usize,
    /// The same for every element, N·m/rad.
    stiffness: f64,
    /// W_i, N·m; zero beyond `count`.
    slip_nm: [f64; MAX_ELEMENTS],
}

/// The elements' torques at deflection `z`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Memory {
    z: f64,
    torque_nm: [f64; MAX_ELEMENTS],
}

/// The elements' torque at a deflection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretched {
    /// F_h, N·m.
    pub torque_nm: f64,
    /// dF_h/dz, N·m/rad: of those that stick.
    pub tangent: f64,
    /// dF_h by the scale of the slip torques, N·m: of those that slip.
    pub by_scale: f64,
}

impl Maxwell {
    /// `count` equal springs of `total_stiffness` together, slip torques in proportion to i^`spacing`, adding up to
    /// `total_slip_nm`.
    pub fn new(count: usize, total_stiffness: f64, total_slip_nm: f64, spacing: f64) -> Self {
        let count = count.clamp(1, MAX_ELEMENTS);
        let mut slip_nm = [0.0; MAX_ELEMENTS];
        let mut sum = 0.0;
        for (index, slip) in slip_nm.iter_mut().take(count).enumerate() {
            *slip = ((index + 1) as f64 / count as f64).powf(spacing);
            sum += *slip;
        }
        for slip in &mut slip_nm {
            *slip *= total_slip_nm / sum;
        }
        Self { count, stiffness: total_stiffness / count as f64, slip_nm }
    }

    /// The stretch at which the last element slips, rad.
    pub fn longest_stretch_rad(&self) -> f64 {
        self.slip_nm.iter().fold(0.0, |most: f64, slip| most.max(*slip)) / self.stiffness
    }

    /// F_h at `z`, reached from the memory without turning; slip torques × `scale`.
    #[inline]
    pub fn torque(&self, z: f64, scale: f64, memory: &Memory) -> Stretched {
        let stretch_nm = self.stiffness * (z - memory.z);
        let (mut sum, mut sticking, mut slipping) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        // Sums side by side, which the processor takes several of at a time; elements beyond the count slip at nothing.
        let chunks = memory.torque_nm.chunks_exact(LANES).zip(self.slip_nm.chunks_exact(LANES));
        for (torques, slips) in chunks.take(self.count.div_ceil(LANES)) {
            let sums = sum.iter_mut().zip(&mut sticking).zip(&mut slipping);
            for ((torque, slip), ((sum, sticking), slipping)) in torques.iter().zip(slips).zip(sums) {
                let bound = slip * scale;
                let free = torque + stretch_nm;
                let held = free.max(-bound).min(bound);
                let sticks = free.abs() < bound;
                *sum += held;
                *sticking += if sticks { 1.0 } else { 0.0 };
                *slipping += if sticks { 0.0 } else { slip.copysign(held) };
            }
        }
        Stretched {
            torque_nm: sum.iter().sum(),
            tangent: sticking.iter().sum::<f64>() * self.stiffness,
            by_scale: slipping.iter().sum(),
        }
    }

    /// The deflection at which relaxed elements carry a torque, rad; slip torques × `scale`. They carry no more than all slip
    /// torques together.
    pub fn deflection_rad(&self, torque_nm: f64, scale: f64) -> f64 {
        let (mut z, mut carried_nm, mut sticking) = (0.0, 0.0, self.count as f64);
        // The weakest come first, and slip first.
        for slip in self.slip_nm.iter().take(self.count) {
            let until = slip * scale / self.stiffness;
            let then_nm = carried_nm + (until - z) * sticking * self.stiffness;
            if then_nm >= torque_nm.abs() {
                z += (torque_nm.abs() - carried_nm) / (sticking * self.stiffness);
                return z.copysign(torque_nm);
            }
            (z, carried_nm, sticking) = (until, then_nm, sticking - 1.0);
        }
        z.copysign(torque_nm)
    }

    /// Moves the elements to `z`.
    pub fn remember(&self, z: f64, scale: f64, memory: &mut Memory) {
        let stretch_nm = self.stiffness * (z - memory.z);
        for (torque, slip) in memory.torque_nm.iter_mut().zip(&self.slip_nm).take(self.count) {
            let bound = slip * scale;
            *torque = (*torque + stretch_nm).max(-bound).min(bound);
        }
        memory.z = z;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_loaded_to_a_torque_carry_it() {
        for (count, spacing, scale) in [(8, 1.0, 1.0), (10, 2.5, 0.7), (16, 0.3, 1.4)] {
            let maxwell = Maxwell::new(count, 1000.0, 3.0, spacing);
            for part in [-0.95, -0.2, 1e-3, 0.5, 0.999] {
                let wanted_nm = part * 3.0 * scale;
                let z = maxwell.deflection_rad(wanted_nm, scale);
                let carried = maxwell.torque(z, scale, &Memory::default());
                assert!((carried.torque_nm - wanted_nm).abs() < 1e-12, "{carried:?}, not {wanted_nm}");
                let mut memory = Memory::default();
                maxwell.remember(z, scale, &mut memory);
                let kept_nm = maxwell.torque(z, scale, &memory).torque_nm;
                assert!((kept_nm - wanted_nm).abs() < 1e-12, "{kept_nm}, not {wanted_nm}");
            }
        }
    }
}
