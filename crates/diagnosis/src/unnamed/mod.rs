//! Laws without a name: where no cause of the list explains what is left, the simplest law in the recorded quantities that does.

mod factor;
mod judge;
mod kept;
mod kind;
mod knots;
mod library;
mod passed_once;
mod search;
mod searched;
mod stand_in;
mod term;
mod told;
mod tone;

pub(crate) use judge::{laws_leave_noise, unnamed};
pub(crate) use told::Extended;
