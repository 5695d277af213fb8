//! An array of numbers, as MAT and NumPy files hold it.

/// An array of a file.
pub struct Array {
    /// Its name.
    pub name: String,
    /// Its size in each dimension.
    pub shape: Vec<u64>,
    /// Its numbers, the first index running fastest.
    pub numbers: Vec<f64>,
}
