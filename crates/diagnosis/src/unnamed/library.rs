//! The elementary functions that these data can show, by what they act on.

use crate::extend::stroke::{tells_apart, turns};
use crate::log::facts::Facts;
use crate::show::waves::Wave;
use crate::unnamed::factor::Factor;
use valve_model::{ActsOn, Covariate};

/// The lowest orders of the angle, which are always looked at.
const LOW_ORDERS: [usize; 2] = [1, 2];
/// Rests shorter than this, s, and strokes shorter than this, rad, are none.
const SHORT_REST_S: f64 = 0.1;
const SHORT_STROKE_RAD: f64 = 0.1;
/// Where the fit of a saturating speed begins, as a part of the fastest, which is at least this.
const SATURATING: f64 = 0.1;
const SLOW_RAD_PER_S: f64 = 0.01;

/// What the residual itself suggests.
#[derive(Debug, Clone, Default)]
pub(crate) struct Suggested {
    /// Orders of the angle that stand out of it.
    pub orders: Vec<usize>,
    /// A tone over the clock.
    pub tone: Option<Wave>,
    /// An order of the angle that is no whole number.
    pub order: Option<Wave>,
}

/// The functions, simplest first.
pub(crate) fn library(acts_on: ActsOn, facts: &Facts, suggested: &Suggested) -> Vec<Factor> {
    let mut factors =
        if acts_on == ActsOn::Torque { of_signed_motion(facts) } else { of_motion_either_way(facts) };
    factors.extend(of_angle(acts_on, facts, suggested));
    factors.extend(of_pressure(acts_on));
    factors.extend(of_temperature(acts_on, facts.reference_temperature_c));
    factors.extend(of_the_past(facts));
    factors.retain(|factor| facts.varies(factor.of) && may_depend(acts_on, factor.of, facts));
    let tone = suggested.tone.filter(|_| acts_on == ActsOn::Torque);
    factors.extend(tone.map(|tone| Factor::wave(Covariate::Time, tone.frequency, tone.span)));
    factors
}

/// Whether a quantity only grows while the log is made.
pub(crate) fn drifts(of: Covariate) -> bool {
    matches!(of, Covariate::Time | Covariate::Distance)
}

/// Whether a law that acts on this may be a function of a quantity. A torque that only follows the clock, the distance or the rest can't be told
/// from a transducer's zero that drifts, nor can friction that follows the first two where all motion goes one way.
pub(crate) fn may_depend(acts_on: ActsOn, of: Covariate, facts: &Facts) -> bool {
    match acts_on {
        ActsOn::Torque => !drifts(of) && of != Covariate::TimeAtRest,
        ActsOn::Level | ActsOn::Viscous => !drifts(of) || facts.excitation.both_ways,
    }
}

/// Functions of the pressure: of the list are a torque by it, and levels by a power of its size up to 3/2.
fn of_pressure(acts_on: ActsOn) -> [Factor; 3] {
    let of = |text: &str, unit| Factor::plain(Covariate::PressureDrop, text, unit);
    let root = of("sqrt(abs(pressure_drop)/1e6)", "MPa^0.5");
    let square = of("(pressure_drop/1e6)^2", "MPa^2");
    match acts_on {
        ActsOn::Torque => [of("(pressure_drop/1e6)", "MPa").on_the_list(), root, square],
        ActsOn::Level => [of("(abs(pressure_drop)/1e6)", "MPa").on_the_list(), root.on_the_list(), square],
        ActsOn::Viscous => [of("(abs(pressure_drop)/1e6)", "MPa"), root, square],
    }
}

/// Functions of the temperature: of the list are levels and σ2 in proportion.
fn of_temperature(acts_on: ActsOn, reference_c: f64) -> [Factor; 2] {
    let warmer = format!("(oil_temperature - {reference_c})");
    let in_proportion = Factor::plain(Covariate::OilTemperature, &warmer, "K");
    let square = Factor::plain(Covariate::OilTemperature, &format!("{warmer}^2"), "K^2");
    [if acts_on == ActsOn::Torque { in_proportion } else { in_proportion.on_the_list() }, square]
}

/// Functions of what only grows, for factors of friction.
fn of_the_past(facts: &Facts) -> Vec<Factor> {
    let mut factors = Vec::new();
    if facts.longest_rest_s > SHORT_REST_S {
        factors.push(Factor::plain(Covariate::TimeAtRest, "time_at_rest", "s"));
        factors.push(Factor::plain(Covariate::TimeAtRest, "ln(1 + time_at_rest/1)", ""));
    }
    factors.push(Factor::plain(Covariate::Distance, "distance", "rad"));
    factors.push(Factor::plain(Covariate::Distance, "sqrt(distance)", "rad^0.5"));
    factors.push(Factor::plain(Covariate::Time, "time", "s"));
    factors
}

/// Functions of speed and acceleration for torques, which know the direction.
fn of_signed_motion(facts: &Facts) -> Vec<Factor> {
    // Only what a model has can be off by a factor.
    let known_if = |there: bool, factor: Factor| if there { factor.on_the_list() } else { factor };
    let has_inertia = facts.load_inertia.is_some_and(|inertia| inertia > 0.0);
    let speed = |text: &str, unit| Factor::plain(Covariate::Speed, text, unit);
    let acceleration = |text: &str, unit| Factor::plain(Covariate::Acceleration, text, unit);
    vec![
        known_if(facts.viscous > 0.0, speed("speed", "rad/s")),
        speed("abs(speed)", "rad/s"),
        speed("speed*abs(speed)", "(rad/s)^2"),
        speed("speed^2", "(rad/s)^2"),
        speed("speed^3", "(rad/s)^3"),
        Factor::power_of_speed(),
        known_if(has_inertia, acceleration("acceleration", "rad/s^2")),
        acceleration("abs(acceleration)", "rad/s^2"),
        acceleration("acceleration*abs(acceleration)", "(rad/s^2)^2"),
    ]
}

/// The same for factors of friction, which has the direction itself.
fn of_motion_either_way(facts: &Facts) -> Vec<Factor> {
    let speed = |text: &str, unit| Factor::plain(Covariate::Speed, text, unit);
    let mut factors = vec![
        speed("abs(speed)", "rad/s"),
        speed("sqrt(abs(speed))", "(rad/s)^0.5"),
        speed("speed^2", "(rad/s)^2"),
        speed("speed", "rad/s"),
        Factor::saturating(SATURATING * facts.fastest_rad_per_s.max(SLOW_RAD_PER_S)),
    ];
    // A simulated valve's friction takes part in its acceleration.
    if facts.kind.motion_is_measured {
        let acceleration = |text: &str, unit| Factor::plain(Covariate::Acceleration, text, unit);
        factors.push(acceleration("abs(acceleration)", "rad/s^2"));
        factors.push(acceleration("acceleration", "rad/s^2"));
    }
    factors
}

fn of_angle(acts_on: ActsOn, facts: &Facts, suggested: &Suggested) -> Vec<Factor> {
    let (least, most) = facts.angle_rad;
    if most - least < SHORT_STROKE_RAD {
        return Vec::new();
    }
    let mut orders: Vec<usize> = LOW_ORDERS.into_iter().chain(suggested.orders.iter().copied()).collect();
    orders.sort_unstable();
    orders.dedup();
    orders.retain(|order| tells_apart(&[*order], turns(facts)));
    let listed = acts_on != ActsOn::Viscous;
    let harmonics = orders.into_iter().map(|order| Factor { listed, ..Factor::harmonic(order) });
    let own = suggested.order.map(|order| Factor::wave(Covariate::Angle, order.frequency, order.span));
    let straight = match acts_on {
        ActsOn::Torque => Factor::spring(facts.angle_rad),
        _ => Factor::plain(Covariate::Angle, "angle", "rad"),
    };
    std::iter::once(straight).chain(harmonics).chain(own).collect()
}
