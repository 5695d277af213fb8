//! A motion that begins within an encoder's step: how much earlier it may have begun than its angle shows.
//!
//! Out of a rest a spool moves for a while before its encoder tells. That is little time, but a contact's bristles turn over in as little
//! angle: with a coarse encoder the torque reverses before the angle moves at all. The motion is drawn once more as it may have been: out of
//! each rest with a constant acceleration, from as long before the angle leaves it as it takes to be clear of the noise after.

use prediction::{Noise, motion_through};
use valve_model::MotionSample;

/// A motion is clear of the noise at so many times the angle within which it doesn't show.
const CLEAR: f64 = 3.0;

/// The motion with each rest left as early as its angle allows; `None` if there is no rest that a motion follows.
pub(crate) fn begun_early(
    time_s: &[f64],
    motions: &[MotionSample],
    noise: Noise,
) -> Option<Vec<MotionSample>> {
    let within_rad = noise.hides_rad();
    let mut angles: Vec<f64> = motions.iter().map(|motion| motion.angle_rad).collect();
    let mut changed = false;
    for leaves in departures(motions) {
        changed |= leave_early(&mut angles, motions, leaves, within_rad);
    }
    changed.then(|| (0..angles.len()).map(|index| motion_through(time_s, &angles, index)).collect())
}

/// The last samples of rests.
fn departures(motions: &[MotionSample]) -> impl Iterator<Item = usize> {
    motions.windows(3).enumerate().filter_map(|(index, three)| match three {
        [before, last, after] => {
            let rests = before.angle_rad == last.angle_rad;
            (rests && after.angle_rad != last.angle_rad).then_some(index + 1)
        }
        _ => None,
    })
}

/// Draws the angle out of the rest that ends at `leaves`; it stays within `within_rad` of what it was.
fn leave_early(angles: &mut [f64], motions: &[MotionSample], leaves: usize, within_rad: f64) -> bool {
    let angle = |index: usize| motions.get(index).map(|motion| motion.angle_rad);
    let Some(rest_rad) = angle(leaves) else { return false };
    let is_clear = |motion: &MotionSample| (motion.angle_rad - rest_rad).abs() > CLEAR * within_rad;
    let rests_for =
        motions.iter().take(leaves + 1).rev().take_while(|motion| motion.angle_rad == rest_rad).count();
    let Some(takes) = motions.iter().skip(leaves).position(is_clear).filter(|takes| *takes < rests_for)
    else {
        return false;
    };
    let Some(clear_rad) = angle(leaves + takes) else { return false };
    for index in leaves - takes..leaves + takes {
        let part = (index + takes - leaves) as f64 / (2 * takes) as f64;
        let drawn_rad = rest_rad + (clear_rad - rest_rad) * part * part;
        if let Some(angle) = angles.get_mut(index) {
            *angle += (drawn_rad - *angle).clamp(-within_rad, within_rad);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 1e-3;
    const NOISE: Noise = Noise { deviation_rad: 1e-3 / 3.464, step_rad: 1e-3 };

    /// A rest, and from `begins` on an acceleration of 20 rad/s², as a smoother draws it: at rest until it is a step away.
    fn drawn(begins: usize, count: usize) -> (Vec<f64>, Vec<f64>, Vec<MotionSample>) {
        let time_s: Vec<f64> = (0..count).map(|index| index as f64 * STEP_S).collect();
        let truth = |index: usize| 10.0 * (index.saturating_sub(begins) as f64 * STEP_S).powi(2);
        let angles: Vec<f64> = (0..count).map(truth).collect();
        let seen: Vec<f64> =
            angles.iter().map(|angle| if *angle > NOISE.step_rad { *angle } else { 0.0 }).collect();
        let motions = (0..count).map(|index| motion_through(&time_s, &seen, index)).collect();
        (time_s, angles, motions)
    }

    #[test]
    fn a_rest_is_left_before_its_angle_shows_it_and_not_further_than_noise_hides() {
        let (time_s, angles, motions) = drawn(100, 200);
        let early = begun_early(&time_s, &motions, NOISE).unwrap();
        for (index, (early, seen)) in early.iter().zip(&motions).enumerate() {
            let moved = early.angle_rad - seen.angle_rad;
            assert!(moved.abs() <= NOISE.hides_rad() * 1.001, "{index}: {moved}");
            assert!(index > 90 || moved == 0.0, "{index}: {moved}");
        }
        // Where the motion hides, the one drawn early is nearer to it than the rest is.
        let off = |of: &[MotionSample]| -> f64 {
            of.iter()
                .zip(&angles)
                .skip(100)
                .take(10)
                .map(|(motion, truth)| (motion.angle_rad - truth).powi(2))
                .sum()
        };
        assert!(off(&early) < off(&motions), "{} and {}", off(&early), off(&motions));
    }

    #[test]
    fn without_a_rest_nothing_changes() {
        let (time_s, _, motions) = drawn(0, 200);
        assert!(begun_early(&time_s, motions.get(20..).unwrap(), NOISE).is_none());
        assert!(begun_early(&time_s, &[], NOISE).is_none());
        // Nor after one that is shorter than the motion needs to be clear of the noise.
        assert!(begun_early(&time_s, motions.get(8..).unwrap(), NOISE).is_none());
    }
}
