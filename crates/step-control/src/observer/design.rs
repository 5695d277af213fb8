//! Design of the observer for the margins that are required.

use crate::observer::margins::{Loop, Margins};
use crate::observer::shaft::{Shaft, ShaftFactors};
use crate::observer::{MOST_NOISE_COUNTS, Observer, ObserverSettings, TORQUE_NOISES_COUNTS};

/// Margins required of the loop of a damping observer: a factor on its gain (6 dB), and phase (45°).
const GAIN_MARGIN: f64 = 2.0;
const PHASE_MARGIN_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Shafts with which it has to be stable: inertia 30 % off, and a spring that is weak at a load angle of 45°.
const OTHER_SHAFTS: [ShaftFactors; 3] = [
    ShaftFactors { inertia: 0.7, stiffness: 1.0 },
    ShaftFactors { inertia: 1.3, stiffness: 1.0 },
    ShaftFactors { inertia: 1.0, stiffness: std::f64::consts::FRAC_1_SQRT_2 },
];

/// The fastest observer that has the required margins, with a dead time of `age_cycles` from a reading to the end of the newest command.
pub(crate) fn design(shaft: &Shaft, settings: ObserverSettings, age_cycles: usize) -> Observer {
    let [first, more @ ..] = TORQUE_NOISES_COUNTS;
    let mut observer = Observer::with_noise(shaft, settings, first);
    for noise in more {
        if !settings.damps || has_margins(&observer, shaft, age_cycles) {
            break;
        }
        observer = Observer::with_noise(shaft, settings, noise);
    }
    observer.cautious = Observer::with_noise(shaft, settings, MOST_NOISE_COUNTS).filter;
    observer
}

fn has_margins(observer: &Observer, shaft: &Shaft, age_cycles: usize) -> bool {
    let with = |factors: ShaftFactors| Loop { observer, shaft: shaft.times(factors), age_cycles };
    let enough = |margins: Margins| margins.gain >= GAIN_MARGIN && margins.phase_rad >= PHASE_MARGIN_RAD;
    with(ShaftFactors::BELIEVED).margins().is_some_and(enough)
        && OTHER_SHAFTS.iter().all(|factors| with(*factors).spectral_radius() < 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Complex;
    use std::f64::consts::TAU;

    fn shaft(period_s: f64) -> Shaft {
        Shaft { inertia_kg_m2: 5e-4, stiffness_nm_per_rad: 300.0, damping_nm_s_per_rad: 0.02, period_s }
    }

    fn designed(shaft: &Shaft, age_cycles: usize, damps: bool) -> Observer {
        let settings = ObserverSettings {
            bandwidth_hz: 320.0,
            torque_limit_nm: 3.0,
            count_rad: TAU / 131_072.0,
            noise_rad: 1e-5,
            delay_cycles: age_cycles as u64 - 1,
            damps,
        };
        design(shaft, settings, age_cycles)
    }

    #[test]
    fn every_observer_has_the_margins_that_are_stated() {
        for (period_s, damps) in
            [(2.5e-4, true), (5e-4, true), (1e-3, true), (2e-3, false), (4e-3, false), (1e-2, false)]
        {
            for age_cycles in 1..=2 {
                let shaft = shaft(period_s);
                let observer = designed(&shaft, age_cycles, damps);
                let designed = Loop { observer: &observer, shaft, age_cycles };
                let found = designed.margins().unwrap();
                let what = format!("{period_s} s, {age_cycles} cycles: {found:?}");
                assert!(found.gain >= 2.0 && found.phase_rad.to_degrees() >= 45.0, "{what}");
                assert!(found.delay_s > 0.5e-3, "{what}");
                for (inertia, stiffness) in [(1.0, 1.0), (0.7, 1.0), (1.3, 1.0), (1.0, 0.71)] {
                    let other = Loop { shaft: shaft.times(ShaftFactors { inertia, stiffness }), ..designed };
                    assert!(other.spectral_radius() < 1.0, "{what}, inertia × {inertia}");
                }
            }
        }
    }

    #[test]
    fn where_a_pole_leaves_the_circle_the_loop_transfer_is_minus_one() {
        let shaft = shaft(1e-3);
        let observer = designed(&shaft, 1, true);
        let with = |inertia: f64| Loop {
            observer: &observer,
            shaft: shaft.times(ShaftFactors { inertia, stiffness: 1.0 }),
            age_cycles: 1,
        };
        let (mut unstable, mut stable) = (0.2, 1.0);
        assert!(with(unstable).spectral_radius() > 1.0 && with(stable).spectral_radius() < 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (unstable + stable);
            if with(middle).spectral_radius() < 1.0 { stable = middle } else { unstable = middle }
        }
        let edge = with(stable);
        let distance = |frequency_hz: f64| (Complex::from(1.0) + edge.at(frequency_hz).unwrap()).norm();
        let nearest = (1..5000).map(|index| distance(0.1 * f64::from(index))).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.01, "{nearest}");
        let margins = edge.margins().unwrap();
        assert_relative_eq!(margins.gain, 1.0, epsilon = 0.02);
        assert!(margins.phase_rad.to_degrees() < 3.0, "{margins:?}");
    }
}
