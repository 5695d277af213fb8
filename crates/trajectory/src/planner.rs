//! Time-optimal jerk-limited motions: rsruckig's equations, each result checked.
//!
//! The planner's tolerances are absolute numbers, so every problem is handed over in units of its own, in which its
//! duration and its way are about 1; angles count from the start of the motion. With that it doesn't matter whether
//! the valve turns by a micro-step or by ten thousand turns, nor how hard the limits are. Its solvers are called
//! directly: the interface above them puts its error messages on the heap.

use rsruckig::block::Block;
use rsruckig::position_third_step1::PositionThirdOrderStep1;
use rsruckig::prelude::Profile as Solution;
use rsruckig::velocity_third_step1::VelocityThirdOrderStep1;

use crate::Limits;
use crate::profile::Profile;
use signals::Kinematics;

/// What a plan's end may lack, in the problem's own units, before it is not used: the planner's own tolerance.
const END_TOLERANCE: f64 = 1.1e-8;

/// What the planner gets beyond the limits of speed and acceleration, as a share of them, while the state it starts
/// from is kept within them: most plans start from a state on its way to a limit, and where rounding puts that a bit
/// beyond it the planner fails, or takes a detour that lasts twice as long.
const HEADROOM: f64 = 1e-11;

/// A problem's units in SI.
#[derive(Debug, Clone, Copy)]
struct Unit {
    time_s: f64,
    angle_rad: f64,
    speed_rad_per_s: f64,
    acceleration_rad_per_s2: f64,
    jerk_rad_per_s3: f64,
}

impl Unit {
    /// For a change of angle and one of speed, of which the longest to bring about sets the time.
    fn new(limits: &Limits, start: &Kinematics, way_rad: f64, speed_change_rad_per_s: f64) -> Self {
        let (way, change) = (way_rad.abs(), speed_change_rad_per_s.abs());
        let acceleration = start.acceleration_rad_per_s2.abs();
        let times = [
            way / limits.max_speed_rad_per_s,
            (way / limits.max_acceleration_rad_per_s2).sqrt(),
            (way / limits.max_jerk_rad_per_s3).cbrt(),
            change / limits.max_acceleration_rad_per_s2,
            (change / limits.max_jerk_rad_per_s3).sqrt(),
            acceleration / limits.max_jerk_rad_per_s3,
        ];
        let time_s = times.into_iter().fold(0.0, f64::max);
        let by_speed = start.speed_rad_per_s.abs().max(change) * time_s;
        let angle_rad = way.max(by_speed).max(acceleration * time_s * time_s);
        let speed_rad_per_s = angle_rad / time_s;
        let acceleration_rad_per_s2 = speed_rad_per_s / time_s;
        let jerk_rad_per_s3 = acceleration_rad_per_s2 / time_s;
        Self { time_s, angle_rad, speed_rad_per_s, acceleration_rad_per_s2, jerk_rad_per_s3 }
    }
}

/// The fastest motion from `start` to rest at `way_rad` from it; `None` if none was found within the limits of speed,
/// acceleration and jerk.
pub(crate) fn plan_angle(limits: &Limits, start: &Kinematics, way_rad: f64) -> Option<Profile> {
    if way_rad == 0.0 && *start == Kinematics::at_rest(start.angle_rad) {
        return Some(Profile::starting(*start));
    }
    let start = within_limits(limits, start);
    let profile = with_plateau(limits, &start, way_rad)
        .or_else(|| directly(limits, &start, way_rad))
        .or_else(|| after_a_stop(limits, &start, way_rad))?;
    Some(profile.ending_at_angle(way_rad))
}

/// The fastest way from `start` to a constant speed; `None` as above.
pub(crate) fn plan_speed(limits: &Limits, start: &Kinematics, speed_rad_per_s: f64) -> Option<Profile> {
    let start = within_limits(limits, start);
    let unit = Unit::new(limits, &start, 0.0, speed_rad_per_s - start.speed_rad_per_s);
    if unit.time_s == 0.0 {
        return Some(Profile::starting(start));
    }
    let Problem { speed, acceleration, max_acceleration, max_jerk, .. } =
        Problem::new(limits, &start, &unit)?;
    let target = speed_rad_per_s / unit.speed_rad_per_s;
    let mut boundary = Solution::default();
    boundary.set_boundary_for_velocity(0.0, speed, acceleration, target, 0.0);
    let mut block = Block::default();
    let mut solver = VelocityThirdOrderStep1::new(
        speed,
        acceleration,
        target,
        0.0,
        max_acceleration,
        -max_acceleration,
        max_jerk,
    );
    let found = solver.get_profile(&mut boundary, &mut block);
    let profile = found.then(|| integrated(limits, &start, &unit, &block.p_min))??;
    landed(limits, profile, &unit, speed_rad_per_s)
}

/// The motion where it is long enough to reach the speed limit: up to it, along it, and to a stop. Put together from
/// the two changes of speed, since seconds of acceleration and days of rotation don't fit into one set of units.
fn with_plateau(limits: &Limits, start: &Kinematics, way_rad: f64) -> Option<Profile> {
    let speed_rad_per_s = limits.max_speed_rad_per_s.copysign(way_rad);
    let mut profile = plan_speed(limits, start, speed_rad_per_s)?;
    let plateau = Kinematics { speed_rad_per_s, ..Kinematics::default() };
    let stop = plan_speed(limits, &plateau, 0.0)?;
    let plateau_rad = way_rad - profile.end().angle_rad - stop.end().angle_rad;
    profile.push(plateau_rad / speed_rad_per_s, 0.0)?;
    profile.append(&stop)?;
    Some(profile)
}

/// The motion where it is too short for that.
fn directly(limits: &Limits, start: &Kinematics, way_rad: f64) -> Option<Profile> {
    let unit = Unit::new(limits, start, way_rad, start.speed_rad_per_s);
    let solution = Problem::new(limits, start, &unit)?.solve(way_rad / unit.angle_rad)?;
    let profile = landed(limits, integrated(limits, start, &unit, &solution)?, &unit, 0.0)?;
    let error = (profile.end().angle_rad - way_rad) / unit.angle_rad;
    (error.abs() <= END_TOLERANCE).then_some(profile)
}

/// The shortest stop, and from there to the target. Just where the shortest stop leads to the target or a hair beside
/// it the equations are singular, and about one plan in a million is not found; there this is as good.
fn after_a_stop(limits: &Limits, start: &Kinematics, way_rad: f64) -> Option<Profile> {
    let mut profile = plan_speed(limits, start, 0.0)?;
    let rest_rad = way_rad - profile.end().angle_rad;
    profile.append(&directly(limits, &Kinematics::default(), rest_rad)?)?;
    Some(profile)
}

/// Start and limits in a problem's own units.
#[derive(Debug, Clone, Copy)]
struct Problem {
    speed: f64,
    acceleration: f64,
    max_speed: f64,
    max_acceleration: f64,
    max_jerk: f64,
}

impl Problem {
    /// `None` where the numbers overflow.
    fn new(limits: &Limits, start: &Kinematics, unit: &Unit) -> Option<Self> {
        let headroom = 1.0 + HEADROOM;
        let problem = Self {
            speed: start.speed_rad_per_s / unit.speed_rad_per_s,
            acceleration: start.acceleration_rad_per_s2 / unit.acceleration_rad_per_s2,
            max_speed: limits.max_speed_rad_per_s / unit.speed_rad_per_s * headroom,
            max_acceleration: limits.max_acceleration_rad_per_s2 / unit.acceleration_rad_per_s2 * headroom,
            max_jerk: limits.max_jerk_rad_per_s3 / unit.jerk_rad_per_s3,
        };
        let Self { speed, acceleration, max_speed, max_acceleration, max_jerk } = problem;
        let numbers = [speed, acceleration, max_speed, max_acceleration, max_jerk];
        numbers.iter().all(|number| number.is_finite()).then_some(problem)
    }

    /// The fastest motion to rest at `way`; `None` if the planner finds none.
    fn solve(&self, way: f64) -> Option<Solution> {
        let mut boundary = Solution::default();
        boundary.set_boundary(0.0, self.speed, self.acceleration, way, 0.0, 0.0);
        let mut block = Block::default();
        // A new one each time: what it keeps from problem to problem must not reach the reference.
        let mut solver = PositionThirdOrderStep1::new(
            0.0,
            self.speed,
            self.acceleration,
            way,
            0.0,
            0.0,
            self.max_speed,
            -self.max_speed,
            self.max_acceleration,
            -self.max_acceleration,
            self.max_jerk,
        );
        solver.get_profile(&boundary, &mut block).then_some(block.p_min)
    }
}

/// The state without what it has beyond the limits: not more than the headroom of an earlier plan, which must not add
/// up. The speed counts as it is when the acceleration has been taken back.
fn within_limits(limits: &Limits, state: &Kinematics) -> Kinematics {
    let (most, fastest) = (limits.max_acceleration_rad_per_s2, limits.max_speed_rad_per_s);
    let acceleration_rad_per_s2 = state.acceleration_rad_per_s2.clamp(-most, most);
    let gain = acceleration_rad_per_s2 * acceleration_rad_per_s2.abs() / (2.0 * limits.max_jerk_rad_per_s3);
    let beyond = state.speed_rad_per_s + gain;
    let speed_rad_per_s = state.speed_rad_per_s - (beyond - beyond.clamp(-fastest, fastest));
    Kinematics { speed_rad_per_s, acceleration_rad_per_s2, ..*state }
}

/// The solution's times and jerks, integrated from the start in SI.
fn integrated(limits: &Limits, start: &Kinematics, unit: &Unit, solution: &Solution) -> Option<Profile> {
    let mut profile = Profile::starting(*start);
    for (time, jerk) in solution.t.iter().zip(&solution.j) {
        // The planner's jerk is the limit, 0, or minus the limit.
        let jerk_rad_per_s3 = if *jerk == 0.0 { 0.0 } else { limits.max_jerk_rad_per_s3.copysign(*jerk) };
        profile.push(time * unit.time_s, jerk_rad_per_s3)?;
    }
    Some(profile)
}

/// The profile with exactly this speed, and no acceleration, at its end; `None` if it is more than rounding away from
/// that, or leaves the limits on the way.
fn landed(limits: &Limits, profile: Profile, unit: &Unit, speed_rad_per_s: f64) -> Option<Profile> {
    let speed = (profile.end().speed_rad_per_s - speed_rad_per_s) / unit.speed_rad_per_s;
    let acceleration = profile.end().acceleration_rad_per_s2 / unit.acceleration_rad_per_s2;
    let close = speed.abs() <= END_TOLERANCE && acceleration.abs() <= END_TOLERANCE;
    (close && profile.keeps(limits)).then(|| profile.ending_at_speed(speed_rad_per_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits() -> impl Strategy<Value = Limits> {
        (-2.0..3.0_f64, -1.0..5.0_f64, 0.0..9.0_f64).prop_map(|(v, a, j)| Limits {
            min_angle_rad: None,
            max_angle_rad: None,
            max_speed_rad_per_s: 10_f64.powf(v),
            max_acceleration_rad_per_s2: 10_f64.powf(a),
            max_jerk_rad_per_s3: 10_f64.powf(j),
            unhomed_speed_rad_per_s: 0.2,
        })
    }

    /// A state from which the speed limit can still be kept.
    fn start(limits: &Limits, speed: f64, acceleration: f64) -> Kinematics {
        let jerk = limits.max_jerk_rad_per_s3;
        let speed_rad_per_s = speed * limits.max_speed_rad_per_s;
        let room = limits.max_speed_rad_per_s - speed_rad_per_s.abs();
        let steepest = limits.max_acceleration_rad_per_s2.min((2.0 * jerk * room).sqrt());
        let acceleration_rad_per_s2 = acceleration * steepest;
        Kinematics { speed_rad_per_s, acceleration_rad_per_s2, ..Kinematics::default() }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

        /// The rest of a fastest motion is the fastest motion for the rest.
        #[test]
        fn planning_anew_on_the_way_costs_no_time(limits in limits(), speed in -1.0..1.0_f64,
            acceleration in -1.0..1.0_f64, decade in -6.0..2.0_f64, way in -1.0..1.0_f64, share in 0.0..1.0_f64) {
            let way_rad = way * 10_f64.powf(decade);
            let whole = plan_angle(&limits, &start(&limits, speed, acceleration), way_rad).unwrap();
            let since_s = share * whole.duration_s();
            let there = whole.at(since_s);
            let rest = plan_angle(&limits, &there, way_rad - there.angle_rad);
            prop_assert!(rest.is_some());
            let lost_s = since_s + rest.unwrap().duration_s() - whole.duration_s();
            // What the planner's tolerance of the angle can cost in time.
            let unit = Unit::new(&limits, &there, way_rad - there.angle_rad, there.speed_rad_per_s);
            prop_assert!(lost_s.abs() <= 1e-4 * whole.duration_s() + 0.02 * unit.time_s, "{} s of {}", lost_s, whole.duration_s());
        }

        /// From a state that is just on its way to the speed limit, as in the middle of most motions.
        #[test]
        fn the_edge_of_the_speed_limit_makes_no_detour(limits in limits(), share in 0.0..1.0_f64, way in -1.0..1.0_f64) {
            let to_limit = plan_speed(&limits, &Kinematics::default(), limits.max_speed_rad_per_s).unwrap();
            let edge = to_limit.at(to_limit.duration_s() * (1.0 - 0.5 * share));
            let inside = Kinematics { speed_rad_per_s: edge.speed_rad_per_s - 1e-7 * limits.max_speed_rad_per_s, ..edge };
            let way_rad = way * 2.2 * to_limit.end().angle_rad;
            let there = plan_angle(&limits, &edge, way_rad).unwrap().duration_s();
            let near = plan_angle(&limits, &inside, way_rad).unwrap().duration_s();
            prop_assert!((there - near).abs() <= 1e-2 * there, "{} s, and {} s from just inside", there, near);
        }

        #[test]
        fn a_plan_is_found_for_every_problem(limits in limits(), speed in -1.0..1.0_f64, acceleration in -1.0..1.0_f64,
            decade in -8.0..5.0_f64, way in -1.0..1.0_f64, target in -1.0..1.0_f64, at_rest in any::<bool>()) {
            let from = if at_rest { Kinematics::default() } else { start(&limits, speed, acceleration) };
            let way_rad = way * 10_f64.powf(decade);
            prop_assert!(plan_angle(&limits, &from, way_rad).is_some(), "angle");
            prop_assert!(plan_speed(&limits, &from, target * limits.max_speed_rad_per_s).is_some(), "speed");
            prop_assert!(plan_speed(&limits, &from, 0.0).is_some(), "stop");
        }
    }
}
