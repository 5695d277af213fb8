//! Leuven friction: T = F_h(z) + σ1·dz/dt + σ2·ω, dz/dt = ω·(1 − sgn(ω·F_h)·|F_h/g(ω)|^n).
//!
//! Equation (3) of the paper, with the sign of ω that it lacks and an exponent n of its own. F_h is the torque of N
//! Maxwell elements (a spring of stiffness k_i that slips at W_i): k_i = σ0/N, W_i in proportion to u^s/(1 − u)^t at the
//! part u of them, ΣW_i = ratio·T_s. The ratio is above one, else z runs away. With a share c of the curve the slip torques
//! are those times 1 − c·(1 − g/T_s): with c = 1 they follow the curve, as in the generalised Maxwell-slip model (Al-Bender,
//! Lampaert, Swevers, IEEE Trans. Automatic Control 50, 2005). A share d of the damping is that of the elements that stick:
//! with d = 1 it is σ1·dz/dt times their part of σ0, which at steady slip torques is σ1·(dF_h/dt)/σ0. t, c and d of 0 are
//! the paper's law.

use serde::{Deserialize, Serialize};

use super::curve::{Curve, CurvePoint, Levels};
use super::law::{Flow, Law, Linearised, Point};
use super::maxwell::{MAX_ELEMENTS, Maxwell, Memory, Spacing};
use super::validate_curve;
use crate::ParamError;
use crate::error::{count, not_negative, positive, require};

/// `[friction]` with `law = "leuven"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeuvenParams {
    /// Coulomb torque T_c, N·m.
    pub coulomb_torque_nm: f64,
    /// Static torque T_s, N·m.
    pub static_torque_nm: f64,
    /// Stribeck velocity ω_s, rad/s.
    pub stribeck_velocity_rad_per_s: f64,
    /// Stribeck exponent δ.
    pub stribeck_exponent: f64,
    /// Stiffness σ0 of all elements together before any slips, N·m/rad.
    pub bristle_stiffness_nm_per_rad: f64,
    /// Bristle damping σ1, N·m·s/rad.
    pub bristle_damping_nm_s_per_rad: f64,
    /// Viscous coefficient σ2, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Exponent n of the transition from presliding to sliding; minor loops close better the higher it is.
    pub transition_exponent: f64,
    /// Number N of Maxwell elements, 8 to 16.
    pub maxwell_elements: u32,
    /// ΣW_i/T_s, above 1.
    pub maxwell_saturation_ratio: f64,
    /// Exponent s of the spacing of the slip levels: 1 spaces them evenly.
    pub maxwell_spacing_exponent: f64,
    /// Exponent t of its tail, 0 to 10: how far the last elements to slip stand out; 0: not.
    #[serde(default)]
    pub maxwell_tail_exponent: f64,
    /// How far the slip torques follow the steady curve as it falls with speed: 0 not at all (the paper's law), 1 wholly
    /// (as in the generalised Maxwell-slip model).
    #[serde(default)]
    pub maxwell_curve_share: f64,
    /// How much of the bristle damping belongs to the elements and ends where they slip: 0 none (the paper's law, σ1·dz/dt),
    /// 1 all.
    #[serde(default)]
    pub maxwell_damping_share: f64,
}

impl LeuvenParams {
    /// The most Maxwell elements that a model may have.
    pub const MAX_ELEMENTS: usize = MAX_ELEMENTS;

    /// Checks the section.
    ///
    /// # Errors
    /// The first number that the law forbids.
    pub fn validate(&self) -> Result<(), ParamError> {
        validate_curve(
            self.coulomb_torque_nm,
            self.static_torque_nm,
            self.stribeck_velocity_rad_per_s,
            self.stribeck_exponent,
        )?;
        positive("bristle_stiffness_nm_per_rad", self.bristle_stiffness_nm_per_rad)?;
        not_negative("bristle_damping_nm_s_per_rad", self.bristle_damping_nm_s_per_rad)?;
        not_negative("viscous_nm_s_per_rad", self.viscous_nm_s_per_rad)?;
        let exponent = self.transition_exponent;
        require(exponent >= 1.0, "transition_exponent", exponent, "a finite number, 1 or above")?;
        count("maxwell_elements", self.maxwell_elements, 8..=16, "8 to 16 elements")?;
        let ratio = self.maxwell_saturation_ratio;
        require(ratio > 1.0, "maxwell_saturation_ratio", ratio, "a finite number above 1")?;
        positive("maxwell_spacing_exponent", self.maxwell_spacing_exponent)?;
        let tail = self.maxwell_tail_exponent;
        require((0.0..=10.0).contains(&tail), "maxwell_tail_exponent", tail, "a number, 0 to 10")?;
        let part = |key, share| require((0.0..=1.0).contains(&share), key, share, "a number, 0 to 1");
        part("maxwell_curve_share", self.maxwell_curve_share)?;
        part("maxwell_damping_share", self.maxwell_damping_share)
    }
}

/// The law with its coefficients prepared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct LeuvenLaw {
    curve: Curve,
    maxwell: Maxwell,
    stiffness: f64,
    damping: f64,
    exponent: f64,
    curve_share: f64,
    damping_share: f64,
}

/// Halvings of the bracket in [`LeuvenLaw::frozen`]: to 1e-4 of it, enough for a method of last resort.
const BISECTIONS: usize = 14;

/// The hysteresis torque where the law is asked.
struct Hysteresis {
    point: CurvePoint,
    /// F_h, N·m.
    torque_nm: f64,
    /// dF_h/dz, N·m/rad; by the curve's speed, N·m·s/rad; by the levels, N·m.
    tangent: f64,
    by_curve_speed: f64,
    by_level: f64,
    /// sgn(ω)·F_h/g.
    reached: f64,
    /// sgn(reached)·|reached|^n
    power: f64,
}

impl LeuvenLaw {
    pub fn new(params: &LeuvenParams) -> Self {
        let curve = Curve::new(
            params.coulomb_torque_nm,
            params.static_torque_nm,
            params.stribeck_velocity_rad_per_s,
            params.stribeck_exponent,
            params.viscous_nm_s_per_rad,
        );
        let maxwell = Maxwell::new(
            params.maxwell_elements as usize,
            params.bristle_stiffness_nm_per_rad,
            params.maxwell_saturation_ratio * params.static_torque_nm,
            Spacing { exponent: params.maxwell_spacing_exponent, tail: params.maxwell_tail_exponent },
        );
        Self {
            curve,
            maxwell,
            stiffness: params.bristle_stiffness_nm_per_rad,
            damping: params.bristle_damping_nm_s_per_rad,
            exponent: params.transition_exponent,
            curve_share: params.maxwell_curve_share,
            damping_share: params.maxwell_damping_share,
        }
    }

    /// A deflection that releases every element, rad.
    fn release_rad(&self, levels: &Levels) -> f64 {
        2.0 * self.maxwell.longest_stretch_rad() * slip_scale(levels)
    }

    fn hysteresis(&self, at: Point, levels: &Levels, memory: &Memory) -> Hysteresis {
        let direction = at.direction;
        let point = self.curve.at(at.curve_speed, direction, levels);
        let (scale, by_curve_speed) = self.scale(&point, direction, levels);
        let stretched = self.maxwell.torque(at.z, scale, memory);
        let reached = direction * stretched.torque_nm / point.torque_nm;
        let power = reached.abs().powf(self.exponent).copysign(reached);
        Hysteresis {
            point,
            torque_nm: stretched.torque_nm,
            tangent: stretched.tangent,
            by_curve_speed: stretched.by_scale * by_curve_speed,
            by_level: stretched.by_scale * scale / levels.level,
            reached,
            power,
        }
    }

    /// The damping of dz/dt, N·m·s/rad. It steps where an element slips, which the derivatives pass over.
    fn damping_at(&self, here: &Hysteresis) -> f64 {
        self.damping * (1.0 - self.damping_share * (1.0 - here.tangent / self.stiffness))
    }

    /// What scales the slip torques, and its derivative by the curve's speed, s/rad.
    #[inline]
    fn scale(&self, point: &CurvePoint, direction: f64, levels: &Levels) -> (f64, f64) {
        let most = slip_scale(levels);
        if self.curve_share == 0.0 {
            return (most, 0.0);
        }
        let at_rest_nm = self.curve.at_rest_nm(direction, levels);
        let lost = self.curve_share * (1.0 - point.torque_nm / at_rest_nm);
        (most * (1.0 - lost), most * self.curve_share * point.slope / at_rest_nm)
    }
}

/// The slip torques grow with the levels, so that they stay above the curve.
fn slip_scale(levels: &Levels) -> f64 {
    levels.level * levels.static_factor.max(1.0) * (1.0 + levels.asymmetry.abs())
}

impl Law for LeuvenLaw {
    fn flow(&self, at: Point, levels: &Levels, memory: &Memory) -> Flow {
        let here = self.hysteresis(at, levels, memory);
        let rate = at.speed * (1.0 - here.power);
        let viscous_nm = here.point.viscous * at.curve_speed;
        Flow { torque_nm: here.torque_nm + self.damping_at(&here) * rate + viscous_nm, rate }
    }

    fn linearise(&self, at: Point, levels: &Levels, memory: &Memory) -> Linearised {
        let here = self.hysteresis(at, levels, memory);
        let rate = at.speed * (1.0 - here.power);
        let viscous_nm = here.point.viscous * at.curve_speed;
        let damping = self.damping_at(&here);
        let size = here.reached.abs().max(1e-12);
        let steepness = self.exponent * here.power.abs() / size;
        let by_torque = -at.speed * at.direction * steepness / here.point.torque_nm;
        let rate_by_speed = 1.0 - here.power;
        let rate_by_curve_speed = at.speed * self.exponent * here.power * here.point.slope
            / here.point.torque_nm
            + by_torque * here.by_curve_speed;
        let rate_by_z = by_torque * here.tangent;
        let rate_by_level = at.speed * self.exponent * here.power / levels.level + by_torque * here.by_level;
        Linearised {
            flow: Flow { torque_nm: here.torque_nm + damping * rate + viscous_nm, rate },
            torque_by_speed: damping * rate_by_speed,
            torque_by_curve_speed: here.by_curve_speed + damping * rate_by_curve_speed + here.point.viscous,
            torque_by_z: here.tangent + damping * rate_by_z,
            torque_by_level: here.by_level + damping * rate_by_level,
            rate_by_speed,
            rate_by_curve_speed,
            rate_by_z,
            rate_by_level,
        }
    }

    /// No closed form: implicit Euler, z − z0 = Δt·dz/dt(z), whose right side falls as z goes with ω; solved by a
    /// fixed number of bisections.
    fn frozen(&self, at: Point, dt_s: f64, levels: &Levels, memory: &Memory) -> f64 {
        let travel = at.speed * dt_s;
        let rest = |z: f64| {
            let here = self.hysteresis(Point { z, ..at }, levels, memory);
            at.z + travel * (1.0 - here.power) - z
        };
        // Forwards it can't go further than the shaft; backwards not past where the hysteresis torque is zero.
        let ahead = rest(at.z) * travel >= 0.0;
        let reach = if ahead { travel } else { -at.speed.signum() * self.release_rad(levels) };
        let (mut near, mut far) = (at.z, at.z + reach);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (near + far);
            if rest(middle) * reach >= 0.0 {
                near = middle;
            } else {
                far = middle;
            }
        }
        0.5 * (near + far)
    }

    fn torque(&self, at: Point, rate: f64, levels: &Levels, memory: &Memory) -> f64 {
        let here = self.hysteresis(at, levels, memory);
        here.torque_nm + self.damping_at(&here) * rate + here.point.viscous * at.curve_speed
    }

    fn remember(&self, at: Point, levels: &Levels, memory: &mut Memory) {
        let scale = if self.curve_share == 0.0 {
            slip_scale(levels)
        } else {
            self.scale(&self.curve.at(at.curve_speed, at.direction, levels), at.direction, levels).0
        };
        self.maxwell.remember(at.z, scale, memory);
    }

    fn deflection_rad(&self, torque_nm: f64, levels: &Levels, memory: &Memory) -> f64 {
        self.maxwell.deflection_rad(torque_nm, slip_scale(levels), memory)
    }

    fn curve(&self) -> &Curve {
        &self.curve
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }

    fn damping(&self) -> f64 {
        self.damping
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(maxwell_curve_share: f64, maxwell_damping_share: f64) -> LeuvenLaw {
        LeuvenLaw::new(&LeuvenParams {
            coulomb_torque_nm: 1.5,
            static_torque_nm: 3.0,
            stribeck_velocity_rad_per_s: 0.05,
            stribeck_exponent: 2.0,
            bristle_stiffness_nm_per_rad: 1000.0,
            bristle_damping_nm_s_per_rad: 1.0,
            viscous_nm_s_per_rad: 2e-2,
            transition_exponent: 3.0,
            maxwell_elements: 10,
            maxwell_saturation_ratio: 1.3,
            maxwell_spacing_exponent: 2.0,
            maxwell_tail_exponent: 0.5,
            maxwell_curve_share,
            maxwell_damping_share,
        })
    }

    #[test]
    fn elements_that_slip_damp_no_longer() {
        let (all, own) = (law(1.0, 0.0), law(1.0, 1.0));
        let (levels, memory) = (Levels::NOMINAL, Memory::default());
        for z in [1e-5, 1.5e-3, 4e-3, 9e-3] {
            let at = Point { speed: 0.03, curve_speed: 0.03, z, direction: 1.0 };
            let (with_all, with_own) = (all.flow(at, &levels, &memory), own.flow(at, &levels, &memory));
            assert_eq!(with_all.rate, with_own.rate);
            let scale = own.scale(&own.curve.at(at.curve_speed, 1.0, &levels), 1.0, &levels).0;
            let sticking = own.maxwell.torque(z, scale, &memory).tangent / own.stiffness;
            let lost_nm = with_all.torque_nm - with_own.torque_nm;
            let expected_nm = own.damping * (1.0 - sticking) * with_own.rate;
            assert!((lost_nm - expected_nm).abs() < 1e-12, "{lost_nm}, not {expected_nm} at {z}");
            assert!((sticking == 1.0) == (z == 1e-5), "{sticking} of them stick at {z}");
        }
    }

    /// The integrator's order hangs on these.
    #[test]
    fn the_derivatives_are_those_of_the_flow() {
        let levels = |level| Levels { level, ..Levels::NOMINAL };
        let places = [
            (0.0, 0.0, 0.04, 1.7e-3),
            (0.5, 1.0, 0.03, 2.3e-3),
            (1.0, 0.0, 0.06, 1.1e-3),
            (1.0, 0.75, 0.05, 1.9e-3),
        ];
        for (share, damping_share, speed, z) in places {
            let law = law(share, damping_share);
            let at = Point { speed, curve_speed: speed, z, direction: 1.0 };
            let memory = Memory::default();
            let flow = |at: Point, level: f64| law.flow(at, &levels(level), &memory);
            let told = law.linearise(at, &levels(1.0), &memory);
            let check = |name: &str, up: Flow, down: Flow, size: f64, torque: f64, rate: f64| {
                let by = |up: f64, down: f64| (up - down) / (2.0 * size);
                let (by_torque, by_rate) = (by(up.torque_nm, down.torque_nm), by(up.rate, down.rate));
                assert!(
                    (by_torque - torque).abs() < 1e-5 * torque.abs().max(1.0),
                    "{name}: {torque}, not {by_torque}"
                );
                assert!((by_rate - rate).abs() < 1e-5 * rate.abs().max(1.0), "{name}: {rate}, not {by_rate}");
            };
            let d = 1e-8;
            let moved = |ds: f64, dc: f64, dz: f64| {
                flow(Point { speed: speed + ds, curve_speed: speed + dc, z: z + dz, ..at }, 1.0)
            };
            let name = |of: &str| format!("share {share} by {of}");
            check(
                &name("speed"),
                moved(d, 0.0, 0.0),
                moved(-d, 0.0, 0.0),
                d,
                told.torque_by_speed,
                told.rate_by_speed,
            );
            check(
                &name("the curve's speed"),
                moved(0.0, d, 0.0),
                moved(0.0, -d, 0.0),
                d,
                told.torque_by_curve_speed,
                told.rate_by_curve_speed,
            );
            check(&name("z"), moved(0.0, 0.0, d), moved(0.0, 0.0, -d), d, told.torque_by_z, told.rate_by_z);
            check(
                &name("level"),
                flow(at, 1.0 + d),
                flow(at, 1.0 - d),
                d,
                told.torque_by_level,
                told.rate_by_level,
            );
        }
    }
}
