//! Runs that move alike, judged by the measured motion alone: the name of a run's kind adds nothing to it.

use log_data::Run;

/// Speeds that differ by less than about this factor are alike.
const SPEEDS: f64 = 4.0;
/// A reversal counts if the swing after it exceeds this fraction of the run's span.
const TURN: f64 = 0.1;
/// Up to this many reversals are few.
const FEW: usize = 4;

/// What two runs that move alike have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Class {
    /// The mean speed's logarithm to the base `SPEEDS`, rounded.
    speed: i32,
    /// The span's logarithm, likewise.
    span: i32,
    /// None, few or many reversals.
    reversals: u8,
}

impl Class {
    /// A run's class, by its measured angle.
    pub fn of(run: &Run) -> Self {
        let angles = &run.angle_rad;
        let (least, most) = angles
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), at| (least.min(*at), most.max(*at)));
        let span = most - least;
        let duration_s = (run.end_s() - run.start_s()).max(f64::MIN_POSITIVE);
        // The distance is summed between reversals, so that encoder noise doesn't add to it.
        let (travelled, reversals) = swings(angles, TURN * span);
        let logarithm = |value: f64| (value.max(1e-9).ln() / SPEEDS.ln()).round() as i32;
        let reversals = match reversals {
            0 => 0,
            some if some <= FEW => 1,
            _ => 2,
        };
        Self { speed: logarithm(travelled / duration_s), span: logarithm(span), reversals }
    }
}

/// The distance travelled in swings of at least `least`, and the number of reversals.
fn swings(angles: &[f64], least: f64) -> (f64, usize) {
    let Some(&first) = angles.first() else { return (0.0, 0) };
    let (mut low, mut high, mut turned_at, mut way) = (first, first, first, 0.0);
    let (mut travelled, mut reversals) = (0.0, 0);
    for &angle in angles {
        (low, high) = (low.min(angle), high.max(angle));
        let turn = if way >= 0.0 && high - angle > least {
            Some((-1.0, high))
        } else if way <= 0.0 && angle - low > least {
            Some((1.0, low))
        } else {
            None
        };
        let Some((new_way, at)) = turn else { continue };
        if way != 0.0 {
            reversals += 1;
            travelled += f64::abs(at - turned_at);
        }
        (way, turned_at, low, high) = (new_way, at, angle, angle);
    }
    let last = if way > 0.0 { high } else { low };
    (travelled + f64::abs(last - turned_at), reversals)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn class(angle: impl Fn(f64) -> f64) -> Class {
        let time_s: Vec<f64> = (0..2000).map(|k| 1e-3 * f64::from(k)).collect();
        let angle_rad = time_s.iter().map(|at| angle(*at)).collect();
        Class::of(&Run { time_s, angle_rad, ..Run::default() })
    }

    #[test]
    fn runs_are_alike_by_their_motion() {
        let slow = class(|at| 0.7 * at);
        assert_eq!(slow, class(|at| 1.0 - 0.75 * at), "both ways are alike");
        assert_ne!(slow, class(|at| 7.0 * at));
        let sine = class(|at| 0.3 * (20.0 * at).sin());
        assert_ne!(slow, sine);
        assert_eq!(sine, class(|at| 0.28 * (21.0 * at).cos()));
        assert_eq!(class(|_| 0.1), class(|_| 0.3), "rests are alike");
    }
}
