//! The Stribeck curve g(ω) = T_c + (T_s − T_c)·exp(−|ω/ω_s|^δ) in N·m, prepared, and what scales it.

use serde::{Deserialize, Serialize};

/// A Stribeck curve with its reciprocals taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Curve {
    coulomb_nm: f64,
    static_nm: f64,
    per_stribeck_velocity: f64,
    exponent: f64,
    viscous_nm_s_per_rad: f64,
}

/// What scales friction at one instant: 1 and 0 throughout for the nominal model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Levels {
    /// Factor of T_c and T_s.
    pub level: f64,
    /// Its derivative by the spool's angle, 1/rad.
    pub level_per_rad: f64,
    /// Factor of T_s alone, on top.
    pub static_factor: f64,
    /// Factor of σ2.
    pub viscous: f64,
    /// Asymmetry of T_c and T_s: × (1 + a·sgn ω).
    pub asymmetry: f64,
    /// Asymmetry of σ2: × (1 + b·sgn ω).
    pub viscous_asymmetry: f64,
}

impl Levels {
    pub const NOMINAL: Self = Self {
        level: 1.0,
        level_per_rad: 0.0,
        static_factor: 1.0,
        viscous: 1.0,
        asymmetry: 0.0,
        viscous_asymmetry: 0.0,
    };
}

/// The curve at one speed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurvePoint {
    /// g, N·m, positive.
    pub torque_nm: f64,
    /// dg/dω at the curve's speed, N·m·s/rad.
    pub slope: f64,
    /// σ2 in effect, N·m·s/rad.
    pub viscous: f64,
}

/// exp(−x) is zero to double precision beside one from here on.
const NEGLIGIBLE_EXPONENT: f64 = 40.0;

impl Curve {
    pub fn new(
        coulomb_nm: f64,
        static_nm: f64,
        stribeck_velocity_rad_per_s: f64,
        exponent: f64,
        viscous_nm_s_per_rad: f64,
    ) -> Self {
        let per_stribeck_velocity = 1.0 / stribeck_velocity_rad_per_s;
        Self { coulomb_nm, static_nm, per_stribeck_velocity, exponent, viscous_nm_s_per_rad }
    }

    /// T_c and T_s without a velocity dependence between them: T_c throughout.
    pub fn flat(coulomb_nm: f64, viscous_nm_s_per_rad: f64) -> Self {
        Self::new(coulomb_nm, coulomb_nm, f64::INFINITY, 2.0, viscous_nm_s_per_rad)
    }

    /// ω_s, rad/s; infinite for a flat curve.
    pub fn stribeck_velocity(&self) -> f64 {
        1.0 / self.per_stribeck_velocity
    }

    /// T_c, N·m.
    pub fn coulomb_nm(&self) -> f64 {
        self.coulomb_nm
    }

    /// sgn(ω)·g(ω) + σ2·ω in N·m, zero at rest.
    pub fn steady_nm(&self, speed: f64, levels: &Levels) -> f64 {
        if speed == 0.0 {
            return 0.0;
        }
        let point = self.at(speed, speed.signum(), levels);
        point.torque_nm.copysign(speed) + point.viscous * speed
    }

    /// g at the least speed in the direction of `sign` (±1), N·m.
    #[inline]
    pub fn at_rest_nm(&self, sign: f64, levels: &Levels) -> f64 {
        let scale = levels.level * (1.0 + levels.asymmetry * sign);
        scale * (self.static_nm * levels.static_factor).max(self.coulomb_nm)
    }

    /// g and σ2 at `curve_speed` (rad/s), for motion in the direction of `sign` (±1).
    #[inline]
    pub fn at(&self, curve_speed: f64, sign: f64, levels: &Levels) -> CurvePoint {
        let (shape, log_slope) = self.shape(curve_speed);
        let excess_nm = (self.static_nm * levels.static_factor - self.coulomb_nm).max(0.0);
        let scale = levels.level * (1.0 + levels.asymmetry * sign);
        CurvePoint {
            torque_nm: scale * (self.coulomb_nm + excess_nm * shape),
            slope: scale * excess_nm * shape * log_slope,
            viscous: self.viscous_nm_s_per_rad * levels.viscous * (1.0 + levels.viscous_asymmetry * sign),
        }
    }

    /// exp(−|ω/ω_s|^δ) and the derivative of its logarithm by ω.
    #[inline]
    fn shape(&self, speed: f64) -> (f64, f64) {
        let ratio = speed * self.per_stribeck_velocity;
        if self.exponent == 2.0 {
            let power = ratio * ratio;
            if power > NEGLIGIBLE_EXPONENT {
                return (0.0, 0.0);
            }
            return ((-power).exp(), -2.0 * ratio * self.per_stribeck_velocity);
        }
        let size = ratio.abs();
        // As the power is, at a fraction of its cost.
        let plain = self.exponent == 1.0;
        let power = if plain { size } else { size.powf(self.exponent) };
        if power > NEGLIGIBLE_EXPONENT {
            return (0.0, 0.0);
        }
        // Below exponent 1 the slope is infinite at zero speed; the bound touches linearisations alone.
        let steepness = if plain { 1.0 } else { size.max(1e-9).powf(self.exponent - 1.0) };
        let slope = -self.exponent * steepness;
        ((-power).exp(), slope.abs().copysign(-speed) * self.per_stribeck_velocity)
    }
}
