#!/usr/bin/env bash
# All checks; run it before you push. `./check.sh tests` runs the tests alone, as CI does.
# It needs nothing but Rust and a C and C++ compiler.
# With cargo-nextest installed the tests run in parallel processes, without it as usual.
set -euo pipefail
cd "$(dirname "$0")"

# What cargo keeps for the next build of the same tree takes gigabytes and time; a run of all checks needs none of it.
export CARGO_INCREMENTAL=${CARGO_INCREMENTAL:-0}

step() { printf '\n== %s\n' "$*"; "$@"; }

if [ "${1-}" != tests ]; then
    step cargo fmt --all --check
    step cargo clippy --workspace --all-targets --locked -- -D warnings
    RUSTDOCFLAGS="-D warnings" step cargo doc --workspace --no-deps --locked
fi
# There is no test in `benches`, and what its benchmarks are compared with takes a minute to build.
if cargo nextest --version >/dev/null 2>&1; then
    step cargo nextest run --workspace --exclude benches --locked --no-fail-fast
    step cargo test --workspace --exclude benches --doc --locked
else
    step cargo test --workspace --exclude benches --locked --no-fail-fast
fi
if [ "${1-}" = tests ]; then
    exit
fi
if command -v cargo-deny >/dev/null 2>&1; then
    step cargo deny --offline check bans licenses sources
fi
printf '\nall checks passed\n'
