//! Extensions of the model under test: the candidate effects, and hypotheses made of them.

pub(crate) mod candidate;
pub(crate) mod catalogue;
pub(crate) mod hypothesis;
pub(crate) mod stroke;
pub(crate) mod suspected;
pub(crate) mod tolerance;
pub(crate) mod untestable;
