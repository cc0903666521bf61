//! What runs once in every control period: no heap, no lock, no failure.
#![no_std]
#![forbid(unsafe_code)]
