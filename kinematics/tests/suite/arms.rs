//! The shipped robots and reproducible random numbers for the tests.

use kinematics::{Chain, Model, urdf};
use nalgebra::SVector;
use std::path::PathBuf;

/// Text of a shipped URDF.
pub(crate) fn text(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../robots")
        .join(name)
        .join("robot.urdf");
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

pub(crate) fn model(name: &str) -> Model {
    urdf::read(&text(name), None).unwrap_or_else(|error| panic!("{name}: {error}"))
}

pub(crate) fn chain<const N: usize>(name: &str) -> Chain<N> {
    model(name)
        .chain()
        .unwrap_or_else(|error| panic!("{name}: {error}"))
}

pub(crate) const SIX: [&str; 9] = [
    "ur5e",
    "ur10e",
    "irb120",
    "irb1200_5_90",
    "irb1200_7_70",
    "lrmate200id",
    "tx2_60",
    "xarm6",
    "gantry",
];
pub(crate) const SEVEN: [&str; 5] = ["panda", "fr3", "iiwa7", "iiwa14", "xarm7"];

/// How often to try: `usual`, unless `CANTER_POSES` asks for another number.
pub(crate) fn cases(usual: u32) -> u32 {
    std::env::var("CANTER_POSES")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(usual)
}

/// SplitMix64: small, and the same numbers everywhere.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Joint positions inside the limits; continuous joints within a turn.
    pub(crate) fn joints<const N: usize>(&mut self, chain: &Chain<N>) -> SVector<f64, N> {
        SVector::from_fn(|i, _| {
            self.between(
                chain.lower()[i].max(-std::f64::consts::PI * 2.0),
                chain.upper()[i].min(std::f64::consts::PI * 2.0),
            )
        })
    }
}
