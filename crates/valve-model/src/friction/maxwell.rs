//! Maxwell-slip elements: springs in parallel, each of which slips at a torque of its own. F_h(z) = Σ f_i,
//! df_i = k_i·dz while |f_i| < W_i, else df_i = 0. Their torques are the non-local memory of presliding.

use serde::{Deserialize, Serialize};

/// The most elements that a law may have.
pub(crate) const MAX_ELEMENTS: usize = 16;

/// Halvings of the bracket in which the deflection for a torque is looked for: to the last digit.
const BISECTIONS: usize = 52;

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

/// How the slip torques of the elements are spaced: u^s/(1 − u)^t at the part u of them, which is Davies' distribution
/// (Hankin and Lee, Australian & New Zealand Journal of Statistics 48, 2006).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spacing {
    /// s: 1 spaces them evenly from the weakest on.
    pub exponent: f64,
    /// t: how far the strongest stand out; 0: not.
    pub tail: f64,
}

impl Spacing {
    /// Up to a factor; the tail is read `half` an element below, where the last is finite too.
    fn at(&self, part: f64, half: f64) -> f64 {
        part.powf(self.exponent) * (1.0 + half - part).powf(-self.tail)
    }
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
    /// `count` equal springs of `total_stiffness` together, slip torques as `spacing` says, adding up to `total_slip_nm`.
    pub fn new(count: usize, total_stiffness: f64, total_slip_nm: f64, spacing: Spacing) -> Self {
        let count = count.clamp(1, MAX_ELEMENTS);
        let mut slip_nm = [0.0; MAX_ELEMENTS];
        let mut sum = 0.0;
        for (index, slip) in slip_nm.iter_mut().take(count).enumerate() {
            *slip = spacing.at((index + 1) as f64 / count as f64, 0.5 / count as f64);
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

    /// The deflection at which elements carry a torque, reached from the memory without turning, rad; slip torques × `scale`.
    /// They carry no more than all slip torques together; for more it is one at which all slip. The memory is of slip torques
    /// as they are, or × `scale`.
    pub fn deflection_rad(&self, torque_nm: f64, scale: f64, memory: &Memory) -> f64 {
        // Its stretch lets an element go, and its stretch again loads it the other way.
        let reach_rad = self.longest_stretch_rad() * (scale + scale.max(1.0));
        let (mut low, mut high) = (memory.z - reach_rad, memory.z + reach_rad);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.torque(middle, scale, memory).torque_nm < torque_nm {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
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
        for (count, exponent, tail, scale) in [(8, 1.0, 0.0, 1.0), (10, 2.5, 0.4, 0.7), (16, 0.3, 2.0, 1.4)] {
            let maxwell = Maxwell::new(count, 1000.0, 3.0, Spacing { exponent, tail });
            for part in [-0.95, -0.2, 1e-3, 0.5, 0.999] {
                let wanted_nm = part * 3.0 * scale;
                let z = maxwell.deflection_rad(wanted_nm, scale, &Memory::default());
                let carried = maxwell.torque(z, scale, &Memory::default());
                assert!((carried.torque_nm - wanted_nm).abs() < 1e-12, "{carried:?}, not {wanted_nm}");
                let mut memory = Memory::default();
                maxwell.remember(z, scale, &mut memory);
                let kept_nm = maxwell.torque(z, scale, &memory).torque_nm;
                assert!((kept_nm - wanted_nm).abs() < 1e-12, "{kept_nm}, not {wanted_nm}");
                let other_way = maxwell.deflection_rad(-wanted_nm, scale, &memory);
                let turned_nm = maxwell.torque(other_way, scale, &memory).torque_nm;
                assert!((turned_nm + wanted_nm).abs() < 1e-12, "{turned_nm}, not {}", -wanted_nm);
            }
        }
    }
}
