//! The chosen motion as the robot gets it: positions, velocities, accelerations, and the torque that the
//! estimate predicts.

use phiw_curriculum::motion::Motion;
use phiw_dynamics::Tree;
use phiw_telemetry::{LogColumns, LogWriter};

/// The file: a log with `q`, `tau`, `qd` and `qdd` of all joints; `torque` is `[sample × joint]` \[N·m, N\].
pub fn csv(motion: &Motion, torque: &[f64], tree: &Tree) -> String {
    let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
    let columns = LogColumns { torque: true, velocity: true, acceleration: true, ..LogColumns::default() };
    let write = || {
        let mut writer = LogWriter::new(Vec::new(), &joints, columns)?;
        for (sample, torque) in torque.chunks_exact(joints.len()).enumerate() {
            let [q, v, a] = motion.sample(sample);
            writer.write(sample as f64 * motion.period_s(), &[q, torque, v, a])?;
        }
        writer.finish()
    };
    // Writing to memory does not fail, and names and numbers are text.
    write().ok().and_then(|bytes: Vec<u8>| String::from_utf8(bytes).ok()).unwrap_or_default()
}
