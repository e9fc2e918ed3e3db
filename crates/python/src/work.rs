//! Long work beside Python: the interpreter goes on listening for Ctrl-C and tells how far the work is.

use phiw::Error;
use phiw::console::Console;
use phiw::threads;
use phiw_identification::Interruption;
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, Once, PoisonError};
use std::time::Duration;

create_exception!(
    phiw,
    InputError,
    PyValueError,
    "An input is wrong; the message says where, and how to mend it."
);
create_exception!(phiw, PhiwError, PyRuntimeError, "Something else than an input went wrong.");

/// How often signals are looked at and progress is told: a person takes it for at once.
const TICK: Duration = Duration::from_millis(50);

/// What is being done, how much of it is done, and how much there is.
type Told = Arc<Mutex<Option<(String, u64, u64)>>>;

/// Does `work` on threads of its own, without Python's lock, and gives what it gives.
///
/// `progress` is called now and then, on Python's thread. A signal (Ctrl-C) or an error of `progress` is
/// raised at once; `interruption` then has the work end at its next block, while Python goes on.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    interruption: &Interruption,
    work: impl FnOnce(&Console) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    GUARDED_FAULTS.call_once(say_nothing_of_guarded_faults);
    let told = Told::default();
    let (listener, called_off) = (told.clone(), interruption.clone());
    let (sender, receiver) = channel();
    std::thread::Builder::new()
        .name("phiw".to_owned())
        .spawn(move || {
            let listener = move |what: &str, done: u64, total: u64| {
                let mut told = listener.lock().unwrap_or_else(PoisonError::into_inner);
                *told = Some((what.to_owned(), done, total));
            };
            let console = Console::told_to(Box::new(listener), called_off);
            // Whoever asked may have gone away.
            let _ = sender.send(threads::with(|| work(&console)));
        })
        .map_err(|error| PhiwError::new_err(format!("no thread can be started: {error}")))?;
    let receiver = Mutex::new(receiver);
    loop {
        let wait = || receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(TICK);
        let done = py.detach(wait);
        // What was last told is told before the end, too.
        if let Err(raised) = py.check_signals().and_then(|()| tell(progress, &told)) {
            interruption.call_off();
            return Err(raised);
        }
        match done {
            Ok(result) => return result.map_err(raised),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PhiwError::new_err("phiw itself is at fault, please report it"));
            }
        }
    }
}

/// Whether [`say_nothing_of_guarded_faults`] has been called.
static GUARDED_FAULTS: Once = Once::new();

/// A reader that fails on a damaged file where it should not is caught, and the file refused: that is no news
/// for standard error.
fn say_nothing_of_guarded_faults() {
    let others = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |fault| {
        if !phiw_telemetry::is_guarded() {
            others(fault);
        }
    }));
}

/// Tells what there is new.
fn tell(progress: Option<&Bound<'_, PyAny>>, told: &Told) -> PyResult<()> {
    let new = told.lock().unwrap_or_else(PoisonError::into_inner).take();
    match (progress, new) {
        (Some(progress), Some(new)) => progress.call1(new).map(drop),
        _ => Ok(()),
    }
}

/// The exception of an error.
pub fn raised(error: Error) -> PyErr {
    let message = error.to_string();
    match error.exit_status() {
        _ if error.is_interruption() => PyKeyboardInterrupt::new_err(message),
        2 => InputError::new_err(message),
        _ => PhiwError::new_err(message),
    }
}
