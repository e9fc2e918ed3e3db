//! What can be wrong with a C3D file.

/// Why a file can not be read as C3D.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum C3dError {
    /// The second byte is not the mark of the format.
    #[error("not a C3D file: its second byte is {found:#04x}, not 0x50; export the recording as C3D")]
    NotC3d {
        /// What is there instead.
        found: u8,
    },
    /// The file ends too early.
    #[error(
        "{what} needs bytes {from}..{to}, but the file ends at byte {length}: it is cut off; copy or export it again"
    )]
    Truncated {
        /// What does not fit.
        what: &'static str,
        /// Its first byte.
        from: usize,
        /// The byte after its last.
        to: usize,
        /// Length of the file.
        length: usize,
    },
    /// The parameter section contradicts itself.
    #[error("parameter section, byte {at}: {what}; export the recording again")]
    ParameterSection {
        /// Byte in the file.
        at: usize,
        /// What is wrong there.
        what: String,
    },
    /// A parameter has a value that can not be.
    #[error("parameter {name}: {what}")]
    Parameter {
        /// GROUP:NAME.
        name: &'static str,
        /// What is wrong, and the mend.
        what: String,
    },
    /// The processor type is none of the three.
    #[error("processor type {found} at byte {at}: a C3D file has 84 (Intel), 85 (DEC) or 86 (SGI)")]
    Processor {
        /// What is there.
        found: u8,
        /// Where.
        at: usize,
    },
    /// No points, or no frames.
    #[error("the file holds no {what}: there is nothing to retarget in it")]
    Empty {
        /// `points` or `frames`.
        what: &'static str,
    },
    /// The frame rate is not a positive number.
    #[error(
        "the point rate is {rate_hz} Hz (header and POINT:RATE), no camera's (1 Hz to 100 kHz): set POINT:RATE to the camera rate"
    )]
    Rate {
        /// What the file says.
        rate_hz: f64,
    },
    /// The unit of length is not one that is known.
    #[error(
        "POINT:UNITS is `{units}`: known are m, dm, cm, mm, in and ft; name the unit in the map, `units = \"mm\"`"
    )]
    Units {
        /// What the file says.
        units: String,
    },
}
