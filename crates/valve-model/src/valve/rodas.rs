//! One sub-step of the integrator: Rodas5P, a Rosenbrock method of fifth order with eight stages, L-stable and stiffly
//! accurate, with an embedded one of fourth order whose difference is the error.
//!
//! Source: Steinebach, "Construction of Rosenbrock–Wanner method Rodas5P and numerical benchmarks within the Julia
//! Differential Equations package", BIT Numerical Mathematics 63:27, 2023. Stage i solves
//! (1/(hγ)·I − J)·k_i = f(t + α_i·h, y + Σ a_ij·k_j) + Σ c_ij/h·k_j + d_i·h·∂f/∂t.

use super::crossing::Speeds;
use super::linear::{Jacobian, Solver};
use super::shaft::{Shaft, ShaftState};
use crate::friction::{Law, Memory};

const GAMMA: f64 = 0.211_937_563_194_290_14;

/// What goes into a stage: the weights a_ij and c_ij of those before it, its time α_i, its part d_i of ∂f/∂t.
struct Stage<const N: usize> {
    state: [f64; N],
    rate: [f64; N],
    time: f64,
    drift: f64,
}

const SECOND: Stage<1> = Stage {
    state: [3.0],
    rate: [-14.155_112_264_123_755],
    time: 0.635_812_689_582_870_4,
    drift: -0.423_875_126_388_580_27,
};
const THIRD: Stage<2> = Stage {
    state: [2.849_394_379_747_939, 0.458_422_422_044_639_23],
    rate: [-17.972_960_358_859_52, -2.859_693_295_451_294],
    time: 0.409_579_839_339_753_5,
    drift: -0.338_462_712_623_592_4,
};
const FOURTH: Stage<3> = Stage {
    state: [-6.954_028_509_809_101, 2.489_845_061_869_568, -10.358_996_098_473_584],
    rate: [147.121_502_757_117_16, -1.412_214_027_182_13, 71.689_402_513_023_58],
    time: 0.976_930_672_506_071_6,
    drift: 1.804_645_287_288_273_4,
};
const FIFTH: Stage<4> = Stage {
    state: [
        2.802_998_627_562_896_4,
        0.507_246_473_622_820_6,
        -0.398_831_254_177_052_4,
        -0.047_211_872_304_046_41,
    ],
    rate: [165.435_170_248_716_76, -0.459_282_345_649_112_6, 42.909_383_369_586_03, -5.961_986_721_573_306],
    time: 0.428_840_360_955_866_4,
    drift: 2.325_825_639_765_069,
};
/// The last three are at the sub-step's end: their a_ij (those of the seventh and eighth stage add the one before to
/// it) and c_ij.
const SIXTH: ([f64; 5], [f64; 5]) = (
    [
        -7.502_846_399_306_121,
        2.561_846_144_803_919,
        -11.627_539_656_261_098,
        -0.182_687_676_599_422_56,
        0.030_198_172_008_377_946,
    ],
    [
        24.854_864_614_690_072,
        -3.000_922_700_283_218_6,
        47.493_111_002_076_8,
        5.581_419_782_155_812_5,
        -0.661_069_182_524_947_1,
    ],
);
const SEVENTH: [f64; 6] = [
    30.912_732_140_285_99,
    -3.120_824_334_993_797_4,
    77.799_546_460_708_92,
    34.286_460_282_947_83,
    -19.097_331_116_725_623,
    -28.087_943_162_872_662,
];
const EIGHTH: [f64; 7] = [
    37.802_771_233_905_63,
    -3.257_196_902_907_227_6,
    112.269_188_494_963_27,
    66.934_723_124_404_7,
    -40.066_189_370_910_02,
    -54.667_802_628_779_68,
    -9.488_616_523_096_27,
];

/// Where a sub-step leads.
pub(super) struct Trial<const FULL: bool> {
    pub end: ShaftState<FULL>,
    pub error: ShaftState<FULL>,
    /// The spool's speed throughout, for [`super::crossing`].
    pub speeds: Speeds,
}

/// A sub-step being tried.
struct Step<'a, 'b, L, const FULL: bool> {
    shaft: &'a Shaft<'b, L, FULL>,
    start: &'a ShaftState<FULL>,
    jacobian: &'a Jacobian<FULL>,
    memory: &'a Memory,
    solver: Solver<FULL>,
    time_s: f64,
    step_s: f64,
    per_step: f64,
}

impl<L: Law, const FULL: bool> Step<'_, '_, L, FULL> {
    #[inline(always)]
    fn stage<const N: usize>(&self, stage: &Stage<N>, before: [&ShaftState<FULL>; N]) -> ShaftState<FULL> {
        let at = self.start.plus_all(&stage.state, before);
        let drift = self.jacobian.by_time;
        let right = self.right(&at, stage.time, &stage.rate, before).plus(stage.drift * self.step_s, drift);
        self.solver.solve(right)
    }

    /// A stage at the end of the sub-step.
    #[inline(always)]
    fn last<const N: usize>(
        &self,
        at: &ShaftState<FULL>,
        weights: &[f64; N],
        before: [&ShaftState<FULL>; N],
    ) -> ShaftState<FULL> {
        self.solver.solve(self.right(at, 1.0, weights, before))
    }

    #[inline(always)]
    fn right<const N: usize>(
        &self,
        at: &ShaftState<FULL>,
        time: f64,
        weights: &[f64; N],
        before: [&ShaftState<FULL>; N],
    ) -> ShaftState<FULL> {
        let sum = ShaftState::default().plus_all(weights, before);
        let motor = &self.jacobian.motor;
        let time_s = self.time_s + time * self.step_s;
        self.shaft.rates(at, time_s, motor, self.memory).plus(self.per_step, sum)
    }
}

/// Tries a sub-step of `step_s` from `start`, `time_s` into the cycle, where the equations have `jacobian`; `None` where
/// it can't be taken at all.
#[inline]
pub(super) fn attempt<L: Law, const FULL: bool>(
    shaft: &Shaft<'_, L, FULL>,
    start: &ShaftState<FULL>,
    jacobian: &Jacobian<FULL>,
    (time_s, step_s): (f64, f64),
    memory: &Memory,
) -> Option<Trial<FULL>> {
    let per_step = 1.0 / step_s;
    let solver = Solver::new(jacobian, per_step * (1.0 / GAMMA))?;
    let step = Step { shaft, start, jacobian, memory, solver, time_s, step_s, per_step };
    let k1 = step.solver.solve(jacobian.rates.plus(GAMMA * step_s, jacobian.by_time));
    let k2 = step.stage(&SECOND, [&k1]);
    let k3 = step.stage(&THIRD, [&k1, &k2]);
    let k4 = step.stage(&FOURTH, [&k1, &k2, &k3]);
    let k5 = step.stage(&FIFTH, [&k1, &k2, &k3, &k4]);
    let at = start.plus_all(&SIXTH.0, [&k1, &k2, &k3, &k4, &k5]);
    let k6 = step.last(&at, &SIXTH.1, [&k1, &k2, &k3, &k4, &k5]);
    let at = at.plus(1.0, k6);
    let k7 = step.last(&at, &SEVENTH, [&k1, &k2, &k3, &k4, &k5, &k6]);
    let at = at.plus(1.0, k7);
    let error = step.last(&at, &EIGHTH, [&k1, &k2, &k3, &k4, &k5, &k6, &k7]);
    let end = at.plus(1.0, error);
    let stages = [k1.speed, k2.speed, k3.speed, k4.speed, k5.speed, k6.speed, k7.speed, error.speed];
    let speeds = Speeds { start: start.speed, end: end.speed, stages };
    end.is_finite().then_some(Trial { end, error, speeds })
}

#[cfg(test)]
mod tests {
    use super::super::crossing::Course;
    use super::super::input::ValveInput;
    use super::*;
    use crate::friction::AnyLaw;
    use crate::*;

    /// The rig's motor with soft bristles.
    fn valve() -> ValveParams {
        let friction = FrictionParams::LuGre(LuGreParams::BENCH_RIG);
        let motor = MotorParams::BENCH_RIG;
        let load = Some(LoadParams { inertia_kg_m2: 1e-4 });
        let effects = Vec::new();
        let (orifice, oil, clearance, seals) = (None, None, None, None);
        let name = String::new();
        let motor = Some(motor);
        ValveParams::new(&Model { name, motor, load, friction, orifice, oil, clearance, seals, effects })
            .unwrap()
    }

    /// `length_s` from `start` in `count` even steps; the last one's trial.
    fn walk(start: ShaftState<false>, length_s: f64, count: u32) -> Trial<false> {
        let valve = valve();
        let AnyLaw::LuGre(law) = &valve.friction.law else { panic!("another law") };
        let input = ValveInput {
            command_start_rad: 0.02,
            command_end_rad: 0.0208,
            pressure_drop_pa: 0.0,
            oil_temperature_c: 40.0,
            current_ratio: 1.0,
        };
        let shaft = Shaft::new(&valve, law, &input, 1e-3, &FrictionState::default());
        let memory = Memory::default();
        let step_s = length_s / f64::from(count);
        let mut state = start;
        let mut last = None;
        for index in 0..count {
            let time_s = step_s * f64::from(index);
            let jacobian = Jacobian::new(&shaft, &state, time_s, &memory);
            let trial = attempt(&shaft, &state, &jacobian, (time_s, step_s), &memory).unwrap();
            state = trial.end;
            last = Some(trial);
        }
        last.unwrap()
    }

    #[test]
    fn the_order_is_the_fifth_and_the_error_is_that_of_the_fourth() {
        let start = ShaftState { angle: 0.0147, speed: 0.15, z: 1.55e-3, ..ShaftState::default() };
        let exact = walk(start, 8e-4, 256).end;
        let gap = |count: u32| (walk(start, 8e-4, count).end.speed - exact.speed).abs();
        let order = (gap(8) / gap(32)).log2() / 2.0;
        assert!((4.5..5.5).contains(&order), "order {order}");
        let estimate = |length_s: f64| walk(start, length_s, 1).error.speed.abs();
        let order = (estimate(2e-4) / estimate(5e-5)).log2() / 2.0 - 1.0;
        assert!((3.5..5.0).contains(&order), "the embedded method's order: {order}");
    }

    #[test]
    fn a_turn_is_found_where_the_speed_is_zero() {
        let start = ShaftState { angle: 0.019_4, speed: 0.02, z: 1.6e-3, ..ShaftState::default() };
        let whole = walk(start, 2e-5, 1);
        let change = whole.end.speed - start.speed;
        let Course::Turns { part, depth } = whole.speeds.course(1.0, change) else {
            panic!("no turn on the way to {} rad/s", whole.end.speed)
        };
        let there = walk(start, 2e-5 * part, 8).end.speed;
        assert!(there.abs() < 1e-7, "{there} rad/s at the turn, {depth} beyond");
        assert!(depth >= -whole.end.speed && depth < 1.0, "{depth}");
    }
}
