//! The built-in simulated servo driver.
