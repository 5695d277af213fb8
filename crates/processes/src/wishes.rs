//! What the supervisor wants of a process, heard by a thread of its own.

use crate::frame::read_frame;
use crate::part::ToChild;
use crate::side_thread;
use std::io::{self, stdin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

/// What the supervisor wants while the cycles run; written by a thread that listens, read by the loop.
#[derive(Debug, Default)]
pub(crate) struct Wishes {
    stop: AtomicBool,
    finish: AtomicBool,
    orphaned: AtomicBool,
}

impl Wishes {
    /// The cycles shall end now.
    pub(crate) fn stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.orphaned()
    }

    /// The process shall end.
    pub(crate) fn finish(&self) -> bool {
        self.finish.load(Ordering::Relaxed)
    }

    /// The supervisor is gone.
    pub(crate) fn orphaned(&self) -> bool {
        self.orphaned.load(Ordering::Relaxed)
    }
}

/// Listens to the supervisor on a thread of the normal scheduler, so that the loop need not.
///
/// # Errors
/// Where there is no such thread.
pub(crate) fn listen(wishes: &Arc<Wishes>) -> io::Result<Receiver<ToChild>> {
    let (sender, receiver) = channel();
    let wishes = Arc::clone(wishes);
    side_thread::start("wishes", move || hear(&wishes, &sender))?;
    Ok(receiver)
}

fn hear(wishes: &Wishes, orders: &Sender<ToChild>) {
    loop {
        let order = read_frame::<ToChild>(stdin());
        match &order {
            Ok(Some(ToChild::Stop)) => wishes.stop.store(true, Ordering::Relaxed),
            Ok(Some(ToChild::Finish)) => {
                wishes.stop.store(true, Ordering::Relaxed);
                wishes.finish.store(true, Ordering::Relaxed);
            }
            Ok(Some(_)) => {}
            Ok(None) | Err(_) => {
                wishes.orphaned.store(true, Ordering::Relaxed);
                return;
            }
        }
        if let Ok(Some(order)) = order
            && orders.send(order).is_err()
        {
            return;
        }
    }
}
