//! The `canter` command.

fn main() {}
