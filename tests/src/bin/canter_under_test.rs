//! `canter` under another name: cargo gives a package's tests the paths of that package's binaries
//! only, and the system tests are not in the package of the command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
