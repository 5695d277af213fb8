//! Maxwell-slip elements: springs in parallel, each of which slips at a torque of its own. F_h(z) = Σ f_i,
//! df_i = k_i·dz while |f_i| < W_i, else df_i = 0. Their torques are the non-local memory of presliding.

use serde::{Deserialize, Serialize};

/// The most elements that a law may have.
pub(crate) const MAX_ELEMENTS: usize = 16;

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

    /// F_h in N·m at `z`, reached from the memory without turning, and dF_h/dz; slip torques × `scale`.
    #[inline]
    pub fn torque(&self, z: f64, scale: f64, memory: &Memory) -> (f64, f64) {
        let stretch_nm = self.stiffness * (z - memory.z);
        let (mut sum, mut sticking) = (0.0, 0.0);
        for (torque, slip) in memory.torque_nm.iter().zip(&self.slip_nm).take(self.count) {
            let bound = slip * scale;
            let free = torque + stretch_nm;
            sum += free.max(-bound).min(bound);
            sticking += if free.abs() < bound { 1.0 } else { 0.0 };
        }
        (sum, sticking * self.stiffness)
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
