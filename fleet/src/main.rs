//! The program `canter-fleet`.

use std::process::ExitCode;

fn main() -> ExitCode {
    canter_fleet::main()
}
