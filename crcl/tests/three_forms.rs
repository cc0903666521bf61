//! Text, XML and JSON: a program comes back from each.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use crcl::{
    AngleUnit, Command, LengthUnit, Pose, PoseAndSet, Program, ReadOptions, Screw, json, text, xml,
};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![-1e6..1e6_f64, Just(0.0), Just(0.1), (-1e-9..1e-9_f64)]
}

fn pose() -> impl Strategy<Value = Pose> {
    (prop::array::uniform3(number()), 0.0..6.3_f64, -1.5..1.5_f64).prop_map(|(point, a, b)| {
        Pose::Axes {
            point,
            z_axis: [a.cos() * b.cos(), a.sin() * b.cos(), b.sin()],
            x_axis: [-a.sin(), a.cos(), 0.0],
        }
    })
}

fn screw() -> impl Strategy<Value = Screw> {
    let point = prop::option::of(prop::array::uniform3(number()));
    let numbers = [-1e6..1e6_f64, -1e6..1e6_f64, 1.0..10.0_f64];
    (numbers, point, prop::option::of(pose())).prop_map(
        |([advance, turn, free], axis_point, start)| Screw {
            advance,
            turn,
            free,
            axis_point,
            start,
        },
    )
}

fn waypoint() -> impl Strategy<Value = PoseAndSet> {
    let size = || prop::option::of(0.0..1e6_f64);
    let sizes = [size(), size(), size(), size(), size()];
    (pose(), sizes, any::<bool>()).prop_map(|(pose, [a, b, c, d, e], relative)| PoseAndSet {
        speed: a,
        relative_acceleration: (relative && b.is_some()).then_some(12.5),
        acceleration: b.filter(|_| !relative),
        rot_speed: c,
        tolerance: d,
        angle_tolerance: e,
        ..PoseAndSet::from(pose)
    })
}

/// Commands that text, JSON and XML can all say.
fn shared_command() -> impl Strategy<Value = Command> {
    let size = || 0.0..1e6_f64;
    prop_oneof![
        "[ -~\t\n\r]{0,20}".prop_map(|text| Command::Message { text }),
        size().prop_map(|seconds| Command::Dwell { seconds }),
        pose().prop_map(|pose| Command::MoveTo { pose }),
        pose().prop_map(|pose| Command::MoveStraightTo { pose }),
        prop::collection::vec(pose(), 2..5).prop_map(|poses| Command::MoveSmoothlyTo { poses }),
        prop::sample::select(vec![
            Command::OpenGripper,
            Command::CloseGripper,
            Command::SetEndEffector { setting: 0.375 },
            Command::OpenToolChanger,
            Command::CloseToolChanger,
            Command::StopMotion { emergency: 0 },
            Command::StopMotion { emergency: 1 },
            Command::SetLengthUnits {
                unit: LengthUnit::Inch
            },
            Command::SetLengthUnits {
                unit: LengthUnit::Meter
            },
            Command::SetAngleUnits {
                unit: AngleUnit::Radian
            },
        ]),
        screw().prop_map(|screw| Command::MoveScrew { screw }),
        prop::collection::vec(waypoint(), 2..5)
            .prop_filter("settings", |all| all
                .iter()
                .any(|each| each.speed.is_some()))
            .prop_map(|waypoints| Command::MoveThroughWaypoints { waypoints }),
        size().prop_map(|value| Command::SetAbsoluteSpeed { value }),
        size().prop_map(|value| Command::SetAbsoluteAcceleration { value }),
        (0..=10_000_u32).prop_map(|n| Command::SetRelativeSpeed {
            percent: f64::from(n) / 100.0
        }),
        (0..=10_000_u32).prop_map(|n| Command::SetRelativeAcceleration {
            percent: f64::from(n) / 100.0
        }),
        size().prop_map(|tolerance| Command::SetEndPointTolerance { tolerance }),
        size().prop_map(|tolerance| Command::SetEndAngleTolerance { tolerance }),
        size().prop_map(|tolerance| Command::SetIntermediatePointTolerance { tolerance }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 500,
        rng_seed: RngSeed::Fixed(64444),
        ..ProptestConfig::default()
    })]

    /// Text to XML to JSON to text: the same commands.
    #[test]
    fn a_program_goes_round_all_three_forms(
        middle in prop::collection::vec(shared_command(), 0..12),
        reason in 0..5_i64,
    ) {
        let ends = [Command::InitCanon, Command::EndCanon { reason }];
        let [first, last] = ends;
        let commands: Vec<_> = [vec![first], middle, vec![last]].concat();
        let program: Program = commands.iter().cloned().collect();
        let options = ReadOptions::default();
        let from_text = text::read(&text::write(&program), &options);
        let written = xml::write(&from_text.program).unwrap();
        let from_xml = xml::read(&written, &options);
        prop_assert!(!from_xml.has_errors(), "{:?}\n{}", from_xml.findings, written);
        let from_json = json::read(&json::write(&from_xml.program), &options);
        let again: Vec<_> = from_json.program.iter().cloned().collect();
        prop_assert_eq!(again, commands);
    }
}
