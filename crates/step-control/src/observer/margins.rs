//! The loop of encoder, observer and motor as a transfer function, and how far it is from instability.
//!
//! The loop is cut at the command: w is what the controller asks of the motor beyond the feed-forward, y the deviation that
//! the encoder reads. With z = exp(jωT), A, b₀, b₁ the shaft over one cycle, g the filter's gain, c = (1, 0, 0), a the age of a
//! reading in cycles when the newest command ends, and h, l the state feedback on the estimate and on the present w:
//!
//! P(z) = c·(zI − A)⁻¹·(b₀ + b₁·z)
//!
//! C(z) = h·Aᵃ·M·g / [zᵃ⁺¹ + l·zᵃ − h·(Aᵃ·M·(I − g·c)·(b₀/z + b₁) + Σᵢ₌₁..ₐ Aᵃ⁻ⁱ·(b₀·zⁱ⁻¹ + b₁·zⁱ))],
//! M = (I − (I − g·c)·A/z)⁻¹
//!
//! The loop transfer is L = −C·P; the loop is at the limit of stability where L = −1. It is linear: a valve that slides, on the
//! motor's spring K = T_hold·N_r about a small load angle. Friction that opposes the motion damps it further; a load angle γ
//! weakens the spring to K·cos γ.

use crate::observer::Observer;
use crate::observer::shaft::{Shaft, discrete};
use nalgebra::{Complex, DMatrix, DVector, Matrix3, RowVector3, Vector3};
use std::f64::consts::{PI, TAU};

type Cplx = Complex<f64>;

/// Frequencies at which the transfer function is evaluated, up to half the cycle rate.
const FREQUENCIES: u32 = 1500;

/// The lowest of them, Hz.
const LOWEST_HZ: f64 = 0.1;

/// How far a loop is from instability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// The least factor on the loop's gain, up or down, that makes it unstable; as a ratio above 1.
    pub gain: f64,
    /// The least additional phase lag or lead that does, rad.
    pub phase_rad: f64,
    /// The least additional dead time that does, s.
    pub delay_s: f64,
    /// The highest frequency at which the loop's gain is 1, Hz; 0 where it never is.
    pub crossover_hz: f64,
}

/// The loop with a shaft that may differ from the one that the observer was designed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loop<'a> {
    pub observer: &'a Observer,
    pub shaft: Shaft,
    /// Cycles from a reading to the end of the newest command.
    pub age_cycles: usize,
}

impl Loop<'_> {
    /// L at a frequency, Hz.
    pub(crate) fn at(&self, frequency_hz: f64) -> Option<Cplx> {
        let z = Cplx::from_polar(1.0, TAU * frequency_hz * self.shaft.period_s);
        Some(-self.controller(z)? * self.plant(z)?)
    }

    fn plant(&self, z: Cplx) -> Option<Cplx> {
        let (a, by_start, by_end) = discrete(&self.shaft, true);
        let (a, by_start, by_end) = (complex(&a), vector(&by_start), vector(&by_end));
        // The disturbance's own state stays out: it is not driven by the command.
        let resolvent = (Matrix3::from_diagonal_element(z) - a).try_inverse()?;
        Some((resolvent * (by_start + by_end * z)).x)
    }

    fn controller(&self, z: Cplx) -> Option<Cplx> {
        let parts = self.observer.parts();
        let (a, by_start, by_end) =
            (complex(&parts.transition), vector(&parts.by_start), vector(&parts.by_end));
        let gain = vector(&parts.gain);
        let one = Cplx::from(1.0);
        let reading = RowVector3::new(one, Cplx::from(0.0), Cplx::from(0.0));
        let kept = Matrix3::identity() - gain * reading;
        let filter = (Matrix3::identity() - kept * a / z).try_inverse()?;
        let mut ahead = Matrix3::<Cplx>::identity();
        let mut of_commands = Vector3::<Cplx>::zeros();
        let mut power = one;
        for _ in 0..self.age_cycles {
            ahead = a * ahead;
            of_commands = a * of_commands + by_start * power + by_end * (power * z);
            power *= z;
        }
        let of_commands = of_commands + ahead * filter * kept * (by_start / z + by_end);
        let state = parts.feedback;
        let weights = RowVector3::new(Cplx::from(-state.x), Cplx::from(-state.y), Cplx::from(1.0 + state.z));
        let numerator = (weights * ahead * filter * gain).x;
        let denominator = power * z + power * state.z - (weights * of_commands).x;
        Some(numerator / denominator)
    }

    /// The margins, if the transfer function exists at all frequencies.
    pub(crate) fn margins(&self) -> Option<Margins> {
        let highest_hz = 0.5 / self.shaft.period_s;
        let ratio = (highest_hz / LOWEST_HZ).powf(1.0 / f64::from(FREQUENCIES));
        let mut margins =
            Margins { gain: f64::INFINITY, phase_rad: PI, delay_s: f64::INFINITY, crossover_hz: 0.0 };
        let mut before: Option<Cplx> = None;
        for index in 0..FREQUENCIES {
            let frequency_hz = LOWEST_HZ * ratio.powi(index as i32);
            let now = self.at(frequency_hz)?;
            if let Some(before) = before {
                margins.note(before, now, frequency_hz);
            }
            before = Some(now);
        }
        Some(margins)
    }
}

impl Margins {
    /// Updates the margins with the segment of the curve between two frequencies.
    fn note(&mut self, before: Cplx, now: Cplx, frequency_hz: f64) {
        if (before.norm() - 1.0) * (now.norm() - 1.0) <= 0.0 {
            let from_negative_rad = (-now).arg();
            self.phase_rad = self.phase_rad.min(from_negative_rad.abs());
            // A dead time turns the curve clockwise, from where it is to −180°.
            let lag_rad = from_negative_rad.rem_euclid(TAU);
            self.delay_s = self.delay_s.min(lag_rad / (TAU * frequency_hz));
            self.crossover_hz = self.crossover_hz.max(frequency_hz);
        }
        let crosses = before.im * now.im <= 0.0 && now.re < 0.0 && before.re < 0.0;
        if crosses && now.norm() > 0.0 {
            let norm = now.norm();
            self.gain = self.gain.min(norm.max(1.0 / norm));
        }
    }
}

fn complex(matrix: &Matrix3<f64>) -> Matrix3<Cplx> {
    matrix.map(Cplx::from)
}

fn vector(vector: &Vector3<f64>) -> Vector3<Cplx> {
    vector.map(Cplx::from)
}

impl Loop<'_> {
    /// The largest magnitude of the closed loop's poles: below 1 the loop is stable.
    pub(crate) fn spectral_radius(&self) -> f64 {
        let size = FIXED_STATES + self.age_cycles + 2;
        let mut matrix = DMatrix::<f64>::zeros(size, size);
        for column in 0..size {
            let mut state = vec![0.0; size];
            if let Some(one) = state.get_mut(column) {
                *one = 1.0;
            }
            let next = self.advanced(&state);
            matrix.set_column(column, &DVector::from_vec(next));
        }
        matrix.complex_eigenvalues().iter().map(|pole| pole.norm()).fold(0.0, f64::max)
    }

    /// The closed loop a cycle later. The state is x and ẋ at the time of a reading, the estimate of the cycle before, and
    /// the commands from the cycle before that reading to the newest.
    fn advanced(&self, state: &[f64]) -> Vec<f64> {
        let parts = self.observer.parts();
        let at = |index: usize| state.get(index).copied().unwrap_or_default();
        let command = |index: usize| at(FIXED_STATES + index);
        let predicted = parts.transition * Vector3::new(at(2), at(3), at(4))
            + parts.by_start * command(0)
            + parts.by_end * command(1);
        let estimate = predicted + parts.gain * (at(0) - predicted.x);
        let mut ahead = estimate;
        for index in 1..=self.age_cycles {
            ahead = parts.transition * ahead
                + parts.by_start * command(index)
                + parts.by_end * command(index + 1);
        }
        let newest = self.observer.torque_nm(&ahead, command(self.age_cycles + 1));
        let (a, by_start, by_end) = discrete(&self.shaft, true);
        let moved = a * Vector3::new(at(0), at(1), 0.0)
            + by_start * command(1)
            + by_end * self.next_command(state, newest);
        let mut next = vec![moved.x, moved.y, estimate.x, estimate.y, estimate.z];
        next.extend((1..=self.age_cycles + 1).map(command));
        next.push(newest);
        next
    }

    /// The command one cycle after the reading: a newer one exists already unless the loop has no dead time.
    fn next_command(&self, state: &[f64], newest: f64) -> f64 {
        state.get(FIXED_STATES + 2).copied().unwrap_or(newest)
    }
}

/// Number of the closed loop's states, the commands not counted.
const FIXED_STATES: usize = 5;
