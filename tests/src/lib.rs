//! Whole-system tests: fixtures, laws, goldens, fault tests.
