//! Long work beside Python: on a thread of its own, without the interpreter's lock, told of as it goes, ended by Ctrl-C.

use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// So often Python may say that it wants an end.
const LOOK: Duration = Duration::from_millis(50);

/// What work says of itself.
pub(crate) struct Told {
    /// What is being done.
    pub(crate) what: String,
    /// How much of it is done, from 0 to 1, where that is known.
    pub(crate) part: Option<f64>,
}

/// The work's end of the line.
pub(crate) struct Work {
    told: Sender<Told>,
    /// Set where an end is wanted.
    pub(crate) stop: Arc<AtomicBool>,
}

impl Work {
    /// Tells where it is; whether anybody listens is nobody's concern.
    pub(crate) fn tell(&self, what: impl Into<String>, part: Option<f64>) {
        drop(self.told.send(Told { what: what.into(), part }));
    }

    /// Whether an end is wanted.
    pub(crate) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Does work; `progress` is called on this thread, as `progress(what, part)`.
///
/// # Errors
/// What `progress` or a signal's handler raises: the work is ended then, and its result dropped.
pub(crate) fn beside_python<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Work) -> T + Send,
) -> PyResult<T> {
    py.detach(|| {
        let (told, listened) = channel();
        let stop: Arc<AtomicBool> = Arc::default();
        let line = Work { told, stop: Arc::clone(&stop) };
        std::thread::scope(|scope| {
            let worker = scope.spawn(move || work(&line));
            let mut raised: Option<PyErr> = None;
            loop {
                let told = match listened.recv_timeout(LOOK) {
                    Ok(told) => Some(told),
                    Err(RecvTimeoutError::Timeout) => None,
                    // The worker has dropped its end.
                    Err(RecvTimeoutError::Disconnected) => break,
                };
                if raised.is_none() {
                    raised = Python::attach(|py| look(py, told, progress.as_ref())).err();
                    stop.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            // A panic of ours goes on as Python's PanicException.
            let result = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            raised.map_or(Ok(result), Err)
        })
    })
}

fn look(py: Python<'_>, told: Option<Told>, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    if let (Some(Told { what, part }), Some(progress)) = (told, progress) {
        progress.call1(py, (what, part))?;
    }
    Ok(())
}
