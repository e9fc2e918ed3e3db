//! The shared library: where it is looked for, and the functions of it that are used.
#![allow(unsafe_code)] // the functions of a C library
#![allow(non_snake_case)] // which keep their names

use crate::MujocoError;
use etcetera::BaseStrategy;
use libloading::Library;
use std::ffi::{c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The version of MuJoCo that this crate is written for.
pub const VERSION: &str = "3.17.0";

/// What `mj_version` says of [`VERSION`].
const VERSION_NUMBER: c_int = 3_017_000;

/// The environment variable that names the library's file.
pub const LIBRARY_VARIABLE: &str = "PHIW_MUJOCO_LIBRARY";

/// The library's file name on this platform, as in MuJoCo's wheels.
pub const LIBRARY_FILE_NAME: &str = if cfg!(windows) {
    "mujoco.dll"
} else if cfg!(target_os = "macos") {
    "libmujoco.3.17.0.dylib"
} else {
    "libmujoco.so.3.17.0"
};

/// Where `cargo xtask mujoco` puts the library: `phiw/mujoco-3.17.0` in the user's cache folder.
///
/// The cache folder is `$XDG_CACHE_HOME` or `~/.cache` on Linux, `~/Library/Caches` on macOS,
/// `%LOCALAPPDATA%` on Windows. `None` where the user has no home.
pub fn library_cache_path() -> Option<PathBuf> {
    let caches = etcetera::base_strategy::choose_native_strategy().ok()?.cache_dir();
    Some(caches.join("phiw").join(format!("mujoco-{VERSION}")).join(LIBRARY_FILE_NAME))
}

/// Loads MuJoCo, if it is not yet loaded, and says from where.
///
/// The places: the file that the variable [`LIBRARY_VARIABLE`] names and, if it is not set,
/// [`library_cache_path`], then what the system's loader knows.
///
/// # Errors
/// [`MujocoError::NotFound`] if it is in none of the places, [`MujocoError::Unusable`] if it is of another
/// version or can not be loaded.
pub fn find_library() -> Result<PathBuf, MujocoError> {
    Ok(functions()?.path.clone())
}

/// A model of MuJoCo's, seen from outside.
#[repr(C)]
pub(crate) struct Model([u8; 0]);
/// A simulation's state and scratch, seen from outside.
#[repr(C)]
pub(crate) struct Data([u8; 0]);
/// A model before it is compiled, seen from outside.
#[repr(C)]
pub(crate) struct Spec([u8; 0]);
/// The head of a log message, as far as it is read.
#[repr(C)]
pub(crate) struct LogMessage {
    level: c_int,
    topic: c_int,
    subject: [c_char; 1024],
}

/// Velocity or acceleration of an object: its type, its number, room for six numbers with the angular half
/// first, and whether they are along the object's own axes.
pub(crate) type ObjectMotion = unsafe extern "C" fn(*const Model, *const Data, c_int, c_int, *mut f64, c_int);

type LogHandler = unsafe extern "C" fn(*const LogMessage);

/// Declares the functions, with the signatures of `mujoco.h`, and how they are looked up.
macro_rules! functions {
    ($($name:ident: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions of the loaded library, which is never unloaded.
        pub(crate) struct Functions {
            path: PathBuf,
            $(pub $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            /// Keeps the code behind the functions.
            _library: Library,
        }

        impl Functions {
            fn look_up(library: Library, path: PathBuf) -> Result<Self, String> {
                Ok(Functions {
                    // SAFETY: the version has been checked, and these are the signatures in that version's
                    // headers.
                    $($name: *unsafe { library.get(concat!(stringify!($name), "\0")) }
                        .map_err(whole_message)?,)*
                    path,
                    _library: library,
                })
            }
        }
    };
}

functions! {
    mj_parseXMLString: fn(*const c_char, *const c_void, *mut c_char, c_int) -> *mut Spec;
    mj_compile: fn(*mut Spec, *const c_void) -> *mut Model;
    mjs_getError: fn(*mut Spec) -> *const c_char;
    mj_deleteSpec: fn(*mut Spec);
    mj_deleteModel: fn(*mut Model);
    mj_makeData: fn(*const Model) -> *mut Data;
    mj_deleteData: fn(*mut Data);
    mj_setConst: fn(*mut Model, *mut Data);
    mj_inverse: fn(*const Model, *mut Data);
    mj_forward: fn(*const Model, *mut Data);
    mj_step: fn(*const Model, *mut Data);
    mj_RungeKutta: fn(*const Model, *mut Data, c_int);
    mj_implicit: fn(*const Model, *mut Data);
    mj_rnePostConstraint: fn(*const Model, *mut Data);
    mj_objectVelocity: fn(*const Model, *const Data, c_int, c_int, *mut f64, c_int);
    mj_objectAcceleration: fn(*const Model, *const Data, c_int, c_int, *mut f64, c_int);
    mj_jacBody: fn(*const Model, *const Data, *mut f64, *mut f64, c_int);
    mj_contactForce: fn(*const Model, *const Data, c_int, *mut f64);
    mju_setLogHandler: fn(Option<LogHandler>) -> Option<LogHandler>;
}

/// The functions of the library, loaded once in the life of the process.
pub(crate) fn functions() -> Result<&'static Functions, MujocoError> {
    static FUNCTIONS: OnceLock<Functions> = OnceLock::new();
    if let Some(functions) = FUNCTIONS.get() {
        return Ok(functions);
    }
    let functions = find()?;
    // SAFETY: the handler has the signature that the header asks for and does not unwind.
    unsafe { (functions.mju_setLogHandler)(Some(log)) };
    Ok(FUNCTIONS.get_or_init(|| functions))
}

/// Keeps MuJoCo from writing warnings to the terminal and a log into the present folder: this crate looks at
/// the counts of warnings and reports errors of its own. An error ends the process, so its message is
/// printed first.
unsafe extern "C" fn log(message: *const LogMessage) {
    const ERROR: c_int = 3;
    // SAFETY: MuJoCo calls this with a message that lives as long as the call; its subject ends with a zero.
    let message = unsafe { &*message };
    if message.level >= ERROR {
        let subject = unsafe { std::ffi::CStr::from_ptr(message.subject.as_ptr()) };
        // Not `eprintln!`, which panics where there is no terminal, and nothing may unwind through C.
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("MuJoCo gives up: {}\n", subject.to_string_lossy()),
        );
    }
}

fn find() -> Result<Functions, MujocoError> {
    if let Some(chosen) = std::env::var_os(LIBRARY_VARIABLE) {
        let path = PathBuf::from(chosen);
        return load(&path).map_err(|reason| MujocoError::Unusable { path, reason });
    }
    let mut tried = format!("\n  {LIBRARY_VARIABLE}: not set");
    match library_cache_path() {
        None => tried.push_str("\n  the user's cache folder: there is none"),
        Some(path) if path.exists() => {
            return load(&path).map_err(|reason| MujocoError::Unusable { path, reason });
        }
        Some(path) => tried.push_str(&format!("\n  {}: not there", path.display())),
    }
    match load(Path::new(LIBRARY_FILE_NAME)) {
        Ok(functions) => Ok(functions),
        Err(reason) => {
            tried.push_str(&format!("\n  {LIBRARY_FILE_NAME}, by the system's loader: {reason}"));
            Err(MujocoError::NotFound { tried })
        }
    }
}

/// Loads this file, if it is MuJoCo of the right version.
fn load(path: &Path) -> Result<Functions, String> {
    // SAFETY: loading runs the library's initialisers. The file is one that the user named, that `cargo xtask
    // mujoco` checked, or that the system's loader knows under MuJoCo's name.
    let library = unsafe { Library::new(path) }.map_err(whole_message)?;
    let version: c_int = {
        // SAFETY: this function has had this signature in all versions of MuJoCo.
        let mj_version = unsafe { library.get::<unsafe extern "C" fn() -> c_int>("mj_version\0") }
            .map_err(|_| "it is not MuJoCo (there is no mj_version in it)".to_owned())?;
        // SAFETY: as above; it reads a constant.
        unsafe { mj_version() }
    };
    if version != VERSION_NUMBER {
        return Err(format!("its version number is {version}, but {VERSION_NUMBER} ({VERSION}) is needed"));
    }
    Functions::look_up(library, path.to_owned())
}

/// An error of the loader with what the system says.
fn whole_message(error: libloading::Error) -> String {
    match std::error::Error::source(&error) {
        None => error.to_string(),
        Some(source) => format!("{error}: {source}"),
    }
}

#[cfg(test)]
mod tests {
    use super::load;
    use std::path::Path;

    fn check(path: &str, expected: &str) {
        let reason = load(Path::new(path)).err().unwrap();
        assert!(reason.contains(expected), "{path}: {reason}");
    }

    #[test]
    fn what_is_not_mujoco_is_refused() {
        check(concat!(env!("CARGO_MANIFEST_DIR"), "/absent"), "absent");
        check(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"), "Cargo.toml");
        if cfg!(target_os = "linux") {
            check("libm.so.6", "not MuJoCo");
        }
    }
}
