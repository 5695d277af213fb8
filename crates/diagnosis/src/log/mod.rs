//! The log prepared for fits: cut into pieces, its noise estimated, its excitation determined.

pub(crate) mod at_most_seen;
pub(crate) mod campaign;
pub(crate) mod classes;
pub(crate) mod course;
pub(crate) mod cut;
pub(crate) mod driven;
pub(crate) mod error_model;
pub(crate) mod excitation;
pub(crate) mod facts;
pub(crate) mod holds;
pub(crate) mod hum;
pub(crate) mod initial_state;
pub(crate) mod inputs;
pub(crate) mod kind;
pub(crate) mod loose_ripple;
pub(crate) mod lost_steps;
pub(crate) mod moments;
pub(crate) mod noise;
pub(crate) mod onset;
pub(crate) mod past;
pub(crate) mod piece;
pub(crate) mod predictions;
pub(crate) mod ready;
pub(crate) mod torque;
pub(crate) mod work;
