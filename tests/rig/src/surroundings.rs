//! What friction and laws depend on at an instant.

/// What surrounds the contact.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Surroundings {
    pub angle_rad: f64,
    pub speed_rad_per_s: f64,
    /// Where the motion is given.
    pub acceleration_rad_per_s2: f64,
    pub pressure_mpa: f64,
    pub celsius: f64,
    /// Time on the log's clock.
    pub clock_s: f64,
}
