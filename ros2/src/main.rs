//! The program `canter-ros2`; `canter serve ros2` starts it.

use std::process::ExitCode;

fn main() -> ExitCode {
    canter_ros2::main()
}
