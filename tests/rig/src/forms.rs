//! Functional forms that the rig gives to effects: waves over an angle, growth with rest, dependence on temperature.

/// A 2π-periodic function without a mean.
#[derive(Debug, Clone)]
pub(crate) enum Wave {
    /// Order, amplitude and phase of each sine.
    Sines(Vec<(f64, f64, f64)>),
    /// A smooth bump (a von Mises curve less its mean) of unit height above its foot, scaled.
    Bump { height: f64, centre_rad: f64, sharpness: f64, mean: f64 },
}

/// exp(−κ)·I0(κ): the mean of exp(κ·(cos x − 1)) over a turn.
fn bump_mean(sharpness: f64) -> f64 {
    let points = 256;
    let at =
        |k: i32| (sharpness * ((std::f64::consts::TAU * f64::from(k) / f64::from(points)).cos() - 1.0)).exp();
    (0..points).map(at).sum::<f64>() / f64::from(points)
}

impl Wave {
    pub fn bump(height: f64, centre_rad: f64, sharpness: f64) -> Self {
        Self::Bump { height, centre_rad, sharpness, mean: bump_mean(sharpness) }
    }

    pub fn at(&self, angle_rad: f64) -> f64 {
        match self {
            Self::Sines(sines) => sines.iter().map(|(k, a, phase)| a * (k * angle_rad + phase).sin()).sum(),
            Self::Bump { height, centre_rad, sharpness, mean } => {
                height * ((sharpness * ((angle_rad - centre_rad).cos() - 1.0)).exp() - mean)
            }
        }
    }

    /// Cosine and sine coefficients of the orders 1 to `orders`.
    pub fn coefficients(&self, orders: usize) -> (Vec<f64>, Vec<f64>) {
        let points = 512;
        let part = |order: usize, sine: bool| {
            let one = |k: i32| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(points);
                let (s, c) = (order as f64 * angle).sin_cos();
                self.at(angle) * if sine { s } else { c }
            };
            2.0 * (0..points).map(one).sum::<f64>() / f64::from(points)
        };
        let all = |sine| (1..=orders).map(|order| part(order, sine)).collect();
        (all(false), all(true))
    }
}

/// Growth with the time at rest, 0 at none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Growth {
    pub gain: f64,
    pub time_constant_s: f64,
    /// Logarithmic, as rocks and elastomers do; else exponential.
    pub logarithmic: bool,
}

impl Growth {
    pub fn after(&self, rest_s: f64) -> f64 {
        let x = rest_s.max(0.0) / self.time_constant_s;
        self.gain * if self.logarithmic { (1.0 + x).ln() } else { 1.0 - (-x).exp() }
    }
}

/// A factor that falls (or grows) with temperature.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Thermal {
    /// exp(−β·Δ)
    Exponential(f64),
    /// Vogel's law with the same slope at the reference, 40 °C.
    Vogel(f64),
    /// 1 + β·Δ
    Linear(f64),
}

/// Vogel's temperature for mineral oil, °C below zero.
const VOGEL_C: f64 = 95.0;

impl Thermal {
    pub fn factor(&self, celsius: f64, reference_c: f64) -> f64 {
        let warmer = celsius - reference_c;
        match self {
            Self::Exponential(beta) => (-beta * warmer).exp(),
            Self::Linear(beta) => 1.0 + beta * warmer,
            Self::Vogel(beta) => {
                let absolute = reference_c + VOGEL_C;
                (beta * absolute * absolute * (1.0 / (celsius + VOGEL_C) - 1.0 / absolute)).exp()
            }
        }
    }
}
