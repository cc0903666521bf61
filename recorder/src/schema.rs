//! The definitions of the messages, in ROS 2's form: each with all that it needs.

/// A line between two definitions.
macro_rules! rule {
    () => {
        "================================================================================\n"
    };
}

/// `builtin_interfaces/Time`, as part of others.
macro_rules! time {
    () => {
        concat!(
            rule!(),
            "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
        )
    };
}

/// `std_msgs/Header`, as part of others.
macro_rules! header {
    () => {
        concat!(
            rule!(),
            "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
            time!()
        )
    };
}

/// A message type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Schema {
    /// Its name in ROS 2.
    pub name: &'static str,
    /// Its definition with all that it needs.
    pub text: &'static str,
}

pub(crate) const STRING: Schema = Schema {
    name: "std_msgs/msg/String",
    text: "string data\n",
};

pub(crate) const LOG: Schema = Schema {
    name: "rcl_interfaces/msg/Log",
    text: concat!(
        "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n",
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\n",
        "string function\nuint32 line\n",
        time!()
    ),
};

pub(crate) const JOINT_STATE: Schema = Schema {
    name: "sensor_msgs/msg/JointState",
    text: concat!(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n",
        "float64[] effort\n",
        header!()
    ),
};

pub(crate) const POSE_STAMPED: Schema = Schema {
    name: "geometry_msgs/msg/PoseStamped",
    text: concat!(
        "std_msgs/Header header\nPose pose\n",
        rule!(),
        "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n",
        rule!(),
        "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n",
        rule!(),
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
        header!()
    ),
};

pub(crate) const TF: Schema = Schema {
    name: "tf2_msgs/msg/TFMessage",
    text: concat!(
        "geometry_msgs/TransformStamped[] transforms\n",
        rule!(),
        "MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n",
        "Transform transform\n",
        rule!(),
        "MSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n",
        rule!(),
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
        rule!(),
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
        header!()
    ),
};

pub(crate) const SETPOINT: Schema = Schema {
    name: "canter_msgs/msg/Setpoint",
    text: concat!(
        "# What the joints shall do in one servo period: rad or m, per s, per s2.\n",
        "std_msgs/Header header\nuint64 tick\nuint32 command\nfloat64 path_time\n",
        "float64 time_scaling\nfloat64[] position\nfloat64[] velocity\nfloat64[] acceleration\n",
        "# The controlled point in the workstation: x, y, z (m), qw, qx, qy, qz.\n",
        "float64[] tool\n",
        header!()
    ),
};

pub(crate) const STATE: Schema = Schema {
    name: "canter_msgs/msg/State",
    text: concat!(
        "# What the driver measured in answer to the setpoint of the same tick: rad or m.\n",
        "std_msgs/Header header\nuint64 tick\nfloat64[] position\n",
        "# The controlled point in the workstation: x, y, z (m).\nfloat64[] tool\n",
        header!()
    ),
};

pub(crate) const PERIODS: Schema = Schema {
    name: "canter_msgs/msg/Periods",
    text: concat!(
        "# Counts of servo periods since the start of the session.\n",
        "std_msgs/Header header\nuint64 ticks\nuint64 published\nuint64 skipped\n",
        "uint64 driver_missed\nuint64 unrecorded\n",
        header!()
    ),
};
