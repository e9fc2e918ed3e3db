//! Types whose definition an older ROS 2 bag does not hold, though everybody knows it.

/// The definition of a well-known type, by its name with or without `msg`.
pub(crate) fn definition_of(type_name: &str) -> Option<&'static str> {
    Some(match type_name.replace("/msg/", "/").as_str() {
        "std_msgs/Header" => "builtin_interfaces/Time stamp\nstring frame_id",
        "sensor_msgs/JointState" => {
            "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"
        }
        "control_msgs/JointTrajectoryControllerState" => {
            "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference\n\
             trajectory_msgs/JointTrajectoryPoint feedback\ntrajectory_msgs/JointTrajectoryPoint error\n\
             trajectory_msgs/JointTrajectoryPoint output\nstring[] multi_dof_joint_names\n\
             trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_reference\n\
             trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_feedback\n\
             trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error\n\
             trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_output"
        }
        "trajectory_msgs/JointTrajectoryPoint" => {
            "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n\
             builtin_interfaces/Duration time_from_start"
        }
        "trajectory_msgs/MultiDOFJointTrajectoryPoint" => {
            "geometry_msgs/Transform[] transforms\ngeometry_msgs/Twist[] velocities\n\
             geometry_msgs/Twist[] accelerations\nbuiltin_interfaces/Duration time_from_start"
        }
        "geometry_msgs/Transform" => "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
        "geometry_msgs/Twist" => "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
        "geometry_msgs/Vector3" => "float64 x\nfloat64 y\nfloat64 z",
        "geometry_msgs/Quaternion" => "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
        "std_msgs/Float64" => "float64 data",
        "std_msgs/Float32" => "float32 data",
        "std_msgs/Float64MultiArray" => "std_msgs/MultiArrayLayout layout\nfloat64[] data",
        "std_msgs/Float32MultiArray" => "std_msgs/MultiArrayLayout layout\nfloat32[] data",
        "std_msgs/MultiArrayLayout" => "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset",
        "std_msgs/MultiArrayDimension" => "string label\nuint32 size\nuint32 stride",
        _ => return None,
    })
}
