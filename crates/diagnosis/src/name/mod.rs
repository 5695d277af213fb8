//! Which causes are accepted: candidates are screened, fitted as rivals, and compared on groups that they were not fitted on.

pub(crate) mod apart;
pub(crate) mod exchange;
pub(crate) mod fine;
pub(crate) mod forms;
pub(crate) mod late;
pub(crate) mod own;
pub(crate) mod pair;
pub(crate) mod prune;
pub(crate) mod refine;
pub(crate) mod repeats;
pub(crate) mod rivals;
pub(crate) mod round;
pub(crate) mod screen;
pub(crate) mod select;
pub(crate) mod selection;
pub(crate) mod simplify;
pub(crate) mod threshold;
pub(crate) mod tried;
pub(crate) mod turned;
pub(crate) mod twins;
