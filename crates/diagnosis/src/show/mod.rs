//! What a residual shows: size, dependences, spectrum, whiteness, and observations in words.

pub(crate) mod colour;
pub(crate) mod conditions;
pub(crate) mod geared;
pub(crate) mod loose;
pub(crate) mod mains;
pub(crate) mod observe;
pub(crate) mod orders;
pub(crate) mod own_zeros;
pub(crate) mod repeated;
pub(crate) mod residual;
pub(crate) mod ripple;
pub(crate) mod spectrum;
pub(crate) mod structure;
pub(crate) mod tone;
pub(crate) mod waves;
pub(crate) mod whiteness;
