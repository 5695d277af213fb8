//! Model files: one valve's parameters, read and written.

mod comments;
mod read;
mod read_custom;
mod read_design;
mod read_effects;
mod read_friction;
mod write;

pub use comments::ModelComments;
pub(crate) use read::asked;
pub use read::parse_model;
pub use write::write_model;

const FORMAT: &str = "stepvalve-model";
const FORMAT_VERSION: u64 = 1;
