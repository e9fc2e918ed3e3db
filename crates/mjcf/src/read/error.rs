//! Why an MJCF file is not read.

use phiw_dynamics::urdf::UrdfError;

/// Why a text is not read as the robot of an MJCF file.
#[derive(Debug, thiserror::Error)]
pub enum MjcfReadError {
    /// It is too large, too deep, or has too many elements.
    #[error(transparent)]
    TooMuch(#[from] UrdfError),
    /// It is no XML.
    #[error("line {line}: {why}")]
    Malformed {
        /// Line of the text, from 1.
        line: u32,
        /// What the parser says.
        why: String,
    },
    /// It is XML of another kind.
    #[error("the root element is <{found}>, not <mujoco>")]
    NoMjcf {
        /// Name of the root element.
        found: String,
    },
    /// A number, or one of a list, that is none; or a list of the wrong length.
    #[error("line {line}: <{element}> has {attribute}=\"{value}\", expected {expected}")]
    Number {
        /// Line of the text, from 1.
        line: u32,
        /// Name of the element.
        element: String,
        /// Name of the attribute.
        attribute: &'static str,
        /// Its value.
        value: String,
        /// What it should have been.
        expected: String,
    },
    /// An attribute without which the element means nothing.
    #[error("line {line}: <{element}> has no {attribute}")]
    Missing {
        /// Line of the text, from 1.
        line: u32,
        /// Name of the element.
        element: String,
        /// Name of the attribute.
        attribute: &'static str,
    },
    /// Something that is not read.
    #[error("line {line}: {what}")]
    NotRead {
        /// Line of the text, from 1.
        line: u32,
        /// What, and what to do.
        what: String,
    },
    /// Two bodies or two joints of one name, or a class that is nowhere.
    #[error("line {line}: {what}")]
    Name {
        /// Line of the text, from 1.
        line: u32,
        /// Which, and what is wrong.
        what: String,
    },
    /// What is wrong in a file that is included.
    #[error("included `{file}`: {source}")]
    Included {
        /// The file, as it is named.
        file: String,
        /// What is wrong.
        source: Box<MjcfReadError>,
    },
    /// What is wrong once all included files are written in.
    #[error("with its included files written in, {source}")]
    WithIncludes {
        /// What is wrong.
        source: Box<MjcfReadError>,
    },
    /// No body has a joint.
    #[error("no body has a joint: nothing moves that could be identified")]
    NothingMoves,
}
