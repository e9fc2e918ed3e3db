//! `cargo xtask mujoco`: fetches MuJoCo's library from PyPI, pinned and checked, into the user's cache
//! folder.

use anyhow::{Context, bail, ensure};
use phiw_sim_mujoco::{LIBRARY_FILE_NAME, MujocoError, VERSION, find_library, library_cache_path};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Command line of `cargo xtask mujoco`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The Python whose pip fetches the library; any version will do.
    #[arg(long, default_value = PYTHON)]
    python: String,
}

const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// A file of MuJoCo's release on PyPI. The library is the same in the wheels for all versions of Python.
struct Wheel {
    system: &'static str,
    architecture: &'static str,
    /// What pip calls the platform.
    platform: &'static str,
    sha256: &'static str,
}

const WHEELS: [Wheel; 4] = [
    Wheel {
        system: "linux",
        architecture: "x86_64",
        platform: "manylinux_2_28_x86_64",
        sha256: "42371356efe53a5f5f73ed03fcb967bdf04048017f80e2fca01e71a360e42da2",
    },
    Wheel {
        system: "linux",
        architecture: "aarch64",
        platform: "manylinux_2_28_aarch64",
        sha256: "525e09a00ecd964f06582773d9eeb03bb0e5a1675edf296a6868024759b3b235",
    },
    Wheel {
        system: "macos",
        architecture: "aarch64",
        platform: "macosx_11_0_arm64",
        sha256: "c677ab789299db70ca3fffe96b44a424bdad516cc87cc2a83898140923c2e91e",
    },
    Wheel {
        system: "windows",
        architecture: "x86_64",
        platform: "win_amd64",
        sha256: "17ab707e86b0a5da13582a5335d3ea585a5ac4cce2e814e15b203530d1bf16e3",
    },
];

/// Fetches the library unless it is there, and says where it is.
///
/// # Errors
/// There is no wheel for this platform, pip can not fetch it, it is not the pinned one, or the library in it
/// does not load.
pub fn command(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let path = fetch(&arguments.python)?;
    println!("MuJoCo {VERSION} is in {}", path.display());
    Ok(ExitCode::SUCCESS)
}

/// Fetches the library where it is `wanted` and absent, for a task that can go on without it.
pub fn fetch_if(wanted: bool) {
    if let Some(Err(error)) = wanted.then(|| fetch(PYTHON)) {
        println!("going on without MuJoCo, its tests skip themselves: {error:#}");
    }
}

/// The library, fetched unless it is there.
fn fetch(python: &str) -> anyhow::Result<PathBuf> {
    let cached = library_cache_path();
    match find_library() {
        Err(MujocoError::NotFound { .. }) => (),
        Err(MujocoError::Unusable { path, .. }) if Some(&path) == cached.as_ref() => (),
        found => return Ok(found?),
    }
    let path = cached.context("there is no cache folder, as the user has no home")?;
    let wheel = WHEELS
        .iter()
        .find(|wheel| wheel.system == std::env::consts::OS && wheel.architecture == std::env::consts::ARCH)
        .context(
            "MuJoCo has no wheel for this platform: build its library and name it with PHIW_MUJOCO_LIBRARY",
        )?;
    println!("fetching MuJoCo {VERSION} for {}", wheel.platform);
    let folder = tempfile::tempdir()?;
    let file = download(python, wheel, folder.path())?;
    check(wheel, &file)?;
    unpack(&file, &path)?;
    find_library().or_else(|error| {
        // A library that does not load here must not be found by the tests, which would fail.
        std::fs::remove_file(&path)?;
        Err(error.into())
    })
}

/// Downloads the wheel into the folder: 27 MB.
fn download(python: &str, wheel: &Wheel, folder: &Path) -> anyhow::Result<PathBuf> {
    // The version of Python is that of the pinned wheel, whatever the local one is.
    let options =
        ["-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--retries", "1", "--no-deps"];
    let output = Command::new(python)
        .args(options)
        .args(["--only-binary=:all:", "--implementation", "cp", "--python-version", "3.12"])
        .args(["--platform", wheel.platform])
        .arg("--dest")
        .arg(folder)
        .arg(format!("mujoco=={VERSION}"))
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("{python} cannot be started: install Python, or name one with --python"))?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        let last =
            message.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it does not say why");
        bail!("pip cannot download mujoco=={VERSION} (is there a network?): {last}");
    }
    let mut files = std::fs::read_dir(folder)?;
    Ok(files.next().context("pip has downloaded nothing")??.path())
}

fn check(wheel: &Wheel, file: &Path) -> anyhow::Result<()> {
    let digest = Sha256::digest(std::fs::read(file)?);
    let found: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    ensure!(
        found == wheel.sha256,
        "the wheel of mujoco=={VERSION} is not the one that is known: its sha256 is {found}, but should be {}",
        wheel.sha256
    );
    Ok(())
}

/// Puts the library in the wheel, a zip file, into its place: as a whole, or not at all.
fn unpack(wheel: &Path, path: &Path) -> anyhow::Result<()> {
    let mut wheel = zip::ZipArchive::new(File::open(wheel)?).context("the wheel is not a zip file")?;
    let name = format!("mujoco/{LIBRARY_FILE_NAME}");
    let mut library = Vec::new();
    wheel.by_name(&name).with_context(|| format!("{name} is not in the wheel"))?.read_to_end(&mut library)?;
    let folder = path.parent().context("the library's path has no folder")?;
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    file.write_all(&library)?;
    file.persist(path).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(())
}
