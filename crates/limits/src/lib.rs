#![doc = include_str!("../README.md")]

/// How much an input may ask for. What exceeds a limit is refused before the work begins, with a message that
/// names the limit.
///
/// The defaults lie far above what real robots need and far below what would exhaust a machine of 1 GB.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// Bytes of a URDF. The largest that are published have about 2 MB; a tree of the parsed text takes some
    /// ten times its size.
    pub urdf_bytes: u64,
    /// Elements inside each other in a URDF; six are enough for what the format defines.
    pub xml_depth: usize,
    /// Elements of a URDF.
    pub xml_elements: usize,
    /// Attributes of one element; the format defines eight at most, and checking that they differ costs their
    /// square.
    pub xml_attributes: usize,
    /// Bytes that the entities of a URDF may expand to in all.
    pub xml_expanded_bytes: u64,
    /// Joints of a robot that move by themselves. A humanoid with hands has about 70.
    pub moving_joints: usize,
    /// Bytes of one line of a log; 10 000 columns of 25 characters.
    pub log_line_bytes: usize,
    /// Columns of a log.
    pub log_columns: usize,
    /// Bytes of one message of a recording, unpacked: a picture of 8k x 4k pixels.
    pub message_bytes: usize,
    /// Bytes of a marker recording, which is held in memory.
    pub recording_bytes: u64,
    /// Control points of the splines of one recording: 20 minutes at one every 0.2 s. A robot of 18 joints
    /// takes 0.13 MB for each.
    pub control_points: usize,
    /// Bytes of a TOML file: marker map, support.
    pub toml_bytes: u64,
    /// Bytes of a mesh, of which only the extent is read.
    pub mesh_bytes: u64,
    /// Bytes of a `model.json`.
    pub model_bytes: u64,
    /// Bytes of a plan of `phiw plan`. A log takes some 10 kB, the first one some 100 kB for its spectra.
    pub plan_bytes: u64,
    /// Bytes of a file of factors of `phiw reduce`: for each log about six cut-offs beside what a fit takes,
    /// where `factor_bytes` holds.
    pub factor_file_bytes: u64,
    /// Bytes of all triangular factors of one pass together; they are held in memory at once.
    pub factor_bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            urdf_bytes: 16 << 20,
            xml_depth: 64,
            xml_elements: 200_000,
            xml_attributes: 64,
            xml_expanded_bytes: 16 << 20,
            moving_joints: 200,
            log_line_bytes: 256 << 10,
            log_columns: 10_000,
            message_bytes: 128 << 20,
            recording_bytes: 256 << 20,
            control_points: 6_000,
            toml_bytes: 1 << 20,
            mesh_bytes: 256 << 20,
            model_bytes: 64 << 20,
            plan_bytes: 256 << 20,
            factor_file_bytes: 8 << 30,
            factor_bytes: 2 << 30,
        }
    }
}
