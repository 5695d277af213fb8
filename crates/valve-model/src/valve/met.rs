//! A valve met in the midst of its life: what its bristles, spring and play must be for it to be where it is.

use super::customs::Customs;
use super::input::ValveInput;
use super::params::ValveParams;
use super::shaft::{Shaft, ShaftState};
use super::step::ValveState;
use crate::friction::{AnyLaw, Law, Point, sign};
use crate::{ContactPast, FrictionState};

/// A rotor held by this part of what friction can hold, or more, lies at the end of the encoder's play.
const HELD: f64 = 0.25;

impl ValveParams {
    /// A valve whose encoder reads `encoder_rad` at a speed (rad/s) under the beginning of `input`: its bristles, and the
    /// spring of a compliant coupling, hold against the motor and the other torques, as far as they can; the rotor lies at
    /// `side` of the encoder's play (−1 to 1), or without one where it turned to, or is drawn to. How long the contact has
    /// rested, how far it has travelled and where its bristles came from is in `past`.
    pub fn met_at(
        &self,
        encoder_rad: f64,
        speed_rad_per_s: f64,
        side: Option<f64>,
        input: &ValveInput,
        past: &ContactPast,
    ) -> ValveState {
        let seen = Met { encoder_rad, speed_rad_per_s, side, input, past };
        match &self.friction.law {
            AnyLaw::Stribeck(law) => seen.state(self, law),
            AnyLaw::Dahl(law) => seen.state(self, law),
            AnyLaw::LuGre(law) => seen.state(self, law),
            AnyLaw::Leuven(law) => seen.state(self, law),
        }
    }
}

struct Met<'a> {
    encoder_rad: f64,
    speed_rad_per_s: f64,
    side: Option<f64>,
    input: &'a ValveInput,
    past: &'a ContactPast,
}

/// What friction has to hold, N·m, and what it can.
struct Held {
    needed_nm: f64,
    most_nm: f64,
    other_nm: f64,
}

impl Held {
    fn part(&self) -> f64 {
        if self.most_nm > 0.0 { (self.needed_nm / self.most_nm).clamp(-1.0, 1.0) } else { 0.0 }
    }
}

impl Met<'_> {
    fn state<L: Law>(&self, params: &ValveParams, law: &L) -> ValveState {
        let friction = FrictionState::after(&params.friction, self.past, self.speed_rad_per_s);
        let input = ValveInput { command_end_rad: self.input.command_start_rad, ..*self.input };
        let shaft = Shaft::<L, true>::new(params, law, &input, 1.0, &friction);
        let encoder_shaft_rad = params.measurement.shaft_under(self.encoder_rad);
        let seen = self.held(&shaft, encoder_shaft_rad);
        let likely =
            if self.speed_rad_per_s == 0.0 { seen.part() / HELD } else { sign(self.speed_rad_per_s) };
        let side = self.side.unwrap_or(likely);
        let rotor_rad =
            encoder_shaft_rad + side.clamp(-1.0, 1.0) * params.measurement.backlash_half_width_rad;
        let held = self.held(&shaft, rotor_rad);
        let mut state = ValveState::at_rest(rotor_rad);
        state.encoder_shaft_rad = encoder_shaft_rad;
        state.speed_rad_per_s = self.speed_rad_per_s;
        state.rotor_speed_rad_per_s = self.speed_rad_per_s;
        state.friction = self.loaded(&shaft, rotor_rad, held.part() * held.most_nm);
        if let Some(coupling) = shaft.coupling() {
            state.angle_rad -= (held.part() * held.most_nm + held.other_nm) / coupling.stiffness_nm_per_rad;
        }
        state
    }

    /// The spool as it moves.
    fn moving(&self, angle: f64) -> ShaftState<true> {
        ShaftState { angle, speed: self.speed_rad_per_s, ..ShaftState::default() }
    }

    /// A contact that carries a torque: where its past says before, loaded since.
    fn loaded<L: Law>(&self, shaft: &Shaft<'_, L, true>, rotor_rad: f64, torque_nm: f64) -> FrictionState {
        let before = ContactPast { deflection_rad: self.past.came_from_rad, ..*self.past };
        let mut friction = FrictionState::after(&shaft.params.friction, &before, self.speed_rad_per_s);
        let levels = shaft.levels_at(&self.moving(rotor_rad), 0.0);
        friction.z = shaft.law.deflection_rad(torque_nm, &levels, &friction.memory);
        let at = Point { speed: 0.0, curve_speed: 0.0, z: friction.z, direction: sign(torque_nm) };
        shaft.law.remember(at, &levels, &mut friction.memory);
        friction
    }

    fn held<L: Law>(&self, shaft: &Shaft<'_, L, true>, rotor_rad: f64) -> Held {
        let moving = self.moving(rotor_rad);
        let users_nm = |customs: &Customs| customs.torque_nm(&shaft.moment(&moving, 0.0, 0.0));
        let other_nm = shaft.other(rotor_rad).0 + shaft.customs().map_or(0.0, users_nm);
        let damping_nm = shaft.params.damping_nm_s_per_rad * self.speed_rad_per_s;
        let needed_nm = shaft.motor_nm(rotor_rad, 0.0) - damping_nm - other_nm;
        let creep = f64::MIN_POSITIVE.copysign(needed_nm);
        let most_nm = shaft.law.steady_nm(creep, &shaft.levels_at(&moving, 0.0)).abs();
        Held { needed_nm, most_nm, other_nm }
    }
}
