//! `canter-fleet` under another name: cargo gives a package's tests the paths of that package's
//! binaries only.

use std::process::ExitCode;

fn main() -> ExitCode {
    canter_fleet::main()
}
