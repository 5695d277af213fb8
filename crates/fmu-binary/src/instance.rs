//! An instance: a unit with its importer's log. Every call into it comes through here.

use crate::resources::folder;
use fmu::{MODEL_FILE, Unit, UnitError, token};
use std::ffi::{CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Statuses that both versions of the standard share.
pub const OK: c_int = 0;
pub const DISCARD: c_int = 2;
pub const ERROR: c_int = 3;
pub const FATAL: c_int = 4;

/// FMI 2.0's logger: environment, instance, status, category, format, values of the format.
pub type Logger2 = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);
/// FMI 3.0's: environment, status, category, message.
pub type Logger3 = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// How an importer is told.
#[derive(Clone, Copy)]
pub enum Tell {
    Two(Option<Logger2>, *mut c_void),
    Three(Option<Logger3>, *mut c_void),
}

/// Who tells: the instance's name, and the way.
pub struct Log {
    pub name: CString,
    pub tell: Tell,
}

impl Log {
    pub fn new(name: &str, tell: Tell) -> Self {
        Self { name: CString::new(name).unwrap_or_default(), tell }
    }

    fn error(&self, status: c_int, message: &str) {
        let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
        let category = c"logStatusError";
        match self.tell {
            // SAFETY: the importer's logger, called as the standard says, with a format that takes one text; all texts live
            // through the call.
            Tell::Two(Some(logger), environment) => unsafe {
                logger(
                    environment,
                    self.name.as_ptr(),
                    status,
                    category.as_ptr(),
                    c"%s".as_ptr(),
                    message.as_ptr(),
                );
            },
            // SAFETY: as above; this logger takes no format.
            Tell::Three(Some(logger), environment) => unsafe {
                logger(environment, status, category.as_ptr(), message.as_ptr());
            },
            Tell::Two(None, _) | Tell::Three(None, _) => {}
        }
    }
}

/// A unit, the text that it was made of, and its importer's log.
pub struct Instance {
    pub unit: Unit,
    text: String,
    log: Log,
}

impl Instance {
    /// The unit whose resources lie at `location`, as a pointer for the importer; null, and a line in its log, where it can't be made.
    pub fn open(log: Log, told: &str, location: &str) -> *mut c_void {
        let opened = catch_unwind(AssertUnwindSafe(|| open(told, location)));
        match opened {
            Ok(Ok((unit, text))) => Box::into_raw(Box::new(Self { unit, text, log })).cast(),
            Ok(Err(message)) => {
                log.error(ERROR, &message);
                std::ptr::null_mut()
            }
            Err(_) => {
                log.error(FATAL, DEFECT);
                std::ptr::null_mut()
            }
        }
    }

    /// As it was made.
    pub fn reset(&mut self) -> Result<(), UnitError> {
        self.unit = Unit::new(&self.text)?;
        Ok(())
    }
}

const DEFECT: &str = "a defect of stepvalve's unit: please report it with the model and the inputs";

fn open(told: &str, location: &str) -> Result<(Unit, String), String> {
    let file = folder(location).join(MODEL_FILE);
    let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    let in_file = |error: UnitError| format!("{}: {error}", file.display());
    let own = token(&text).map_err(in_file)?;
    if own != told {
        return Err(format!(
            "{}: the model is another than the description's ({own}, expected {told}): export it again with `stepvalve export fmu`",
            file.display()
        ));
    }
    Unit::new(&text).map(|unit| (unit, text)).map_err(in_file)
}

/// Runs a call on an instance. Its errors go to the importer's log; nothing unwinds into the importer.
///
/// # Safety
/// `instance` is null or was made by [`Instance::open`], is not freed, and no other call on it runs.
pub unsafe fn with(
    instance: *mut c_void,
    call: impl FnOnce(&mut Instance) -> Result<(), UnitError>,
) -> c_int {
    // SAFETY: the caller's promise.
    let Some(instance) = (unsafe { instance.cast::<Instance>().as_mut() }) else { return ERROR };
    match catch_unwind(AssertUnwindSafe(|| call(instance))) {
        Ok(Ok(())) => OK,
        Ok(Err(error)) => {
            instance.log.error(ERROR, &error.to_string());
            ERROR
        }
        Err(_) => {
            instance.log.error(FATAL, DEFECT);
            FATAL
        }
    }
}

/// Ends an instance.
///
/// # Safety
/// As for [`with`]; the instance is gone afterwards.
pub unsafe fn free(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: made by Box::into_raw in `Instance::open`, and freed once.
        let instance = unsafe { Box::from_raw(instance.cast::<Instance>()) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(instance)));
    }
}
