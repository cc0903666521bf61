//! Benchmarks of Canter compared with other libraries.
