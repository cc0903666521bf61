//! The bytes are those that `rosbags` makes of ROS's definitions: see `ros2/tests/golden.py`.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::fs;
use std::path::Path;

use ros2_client::dds::rustdds::RepresentationIdentifier;
use ros2_client::dds::rustdds::serialization::{
    deserialize_from_cdr_with_rep_id, to_writer_with_rep_id,
};
use serde::de::DeserializeOwned;

use canter_ros2::messages::*;
use ros2_client::builtin_interfaces::Time;
use serde::Serialize;

/// The golden message, without the four bytes that name the encoding.
fn golden(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/{name}.hex"));
    let text = fs::read_to_string(&path).unwrap();
    let digits: Vec<char> = text.trim().chars().collect();
    let byte = |pair: &[char]| u8::from_str_radix(&pair.iter().collect::<String>(), 16).unwrap();
    let bytes: Vec<u8> = digits.chunks(2).map(byte).collect();
    assert_eq!(bytes[..4], [0, 1, 0, 0], "{name} is not little endian");
    bytes[4..].to_vec()
}

fn written(message: &impl Serialize) -> Vec<u8> {
    let mut bytes = Vec::new();
    to_writer_with_rep_id(&mut bytes, message, RepresentationIdentifier::CDR_LE).unwrap();
    bytes
}

/// `rosbags` fills the last word.
fn same(ours: &[u8], golden: &[u8]) -> bool {
    let (head, rest) = golden.split_at(ours.len().min(golden.len()));
    ours == head && rest.len() < 4 && rest.iter().all(|byte| *byte == 0)
}

fn read<T: DeserializeOwned>(bytes: &[u8]) -> T {
    deserialize_from_cdr_with_rep_id(bytes, RepresentationIdentifier::CDR_LE)
        .unwrap()
        .0
}

fn header() -> Header {
    Header {
        stamp: Time::from_nanos(1_700_000_000_123_456_789),
        frame_id: String::new(),
    }
}

fn names() -> Vec<String> {
    vec!["shoulder".to_owned(), "elbow_joint".to_owned()]
}

fn point(first: f64, seconds: f64) -> Point {
    Point {
        positions: vec![first, 0.25],
        velocities: vec![0.5, -0.5],
        time_from_start: Span::of(seconds),
        ..Point::default()
    }
}

fn goal() -> Goal {
    let tolerance = Tolerance {
        name: "elbow_joint".to_owned(),
        position: 0.1,
        velocity: -1.0,
        acceleration: 0.0,
    };
    Goal {
        trajectory: Trajectory {
            header: header(),
            joint_names: names(),
            points: vec![point(0.125, 0.0), point(-1.5, 2.5)],
        },
        multi_dof_trajectory: MultiTrajectory {
            header: header(),
            joint_names: Vec::new(),
            points: Vec::new(),
        },
        path_tolerance: vec![tolerance.clone()],
        component_path_tolerance: vec![ComponentTolerance {
            joint_name: "base".to_owned(),
            component: 3,
            position: 0.5,
            ..ComponentTolerance::default()
        }],
        goal_tolerance: vec![tolerance.clone(), tolerance],
        component_goal_tolerance: Vec::new(),
        goal_time_tolerance: Span { sec: 1, nanosec: 0 },
    }
}

fn feedback(index: Option<i32>) -> Feedback {
    Feedback {
        header: header(),
        joint_names: names(),
        desired: point(0.5, 0.75),
        actual: point(0.25, 0.75),
        error: point(0.25, 0.75),
        index,
    }
}

/// Every message that is sent has the bytes of ROS, of each distribution.
#[test]
fn what_is_written_are_the_bytes_of_ros() {
    let state = JointState {
        header: header(),
        name: names(),
        position: vec![0.5, -0.25],
        velocity: vec![1.0, 2.0],
        effort: Vec::new(),
    };
    let outcome = Outcome {
        error_code: -4,
        error_string: "no".to_owned(),
    };
    let answer = TriggerResponse {
        success: true,
        message: "rest".to_owned(),
    };
    let text = Text {
        data: "<robot/>".to_owned(),
    };
    for (distribution, index) in [("humble", None), ("jazzy", None), ("kilted", Some(3))] {
        for (name, bytes) in [
            ("goal", written(&goal())),
            ("feedback", written(&feedback(index))),
            ("result", written(&outcome)),
            ("joint_state", written(&state)),
            ("string", written(&text)),
            ("trigger", written(&answer)),
        ] {
            let golden = golden(&format!("{distribution}_{name}"));
            assert!(
                same(&bytes, &golden),
                "{distribution} {name}: {bytes:02x?}, not {golden:02x?}"
            );
        }
    }
    // The check fires.
    let jazzy = golden("jazzy_feedback");
    assert!(!same(&written(&feedback(Some(3))), &jazzy));
}

/// A goal is read back as it was, of each distribution.
#[test]
fn what_is_read_is_what_ros_wrote() {
    for distribution in ["humble", "jazzy", "kilted"] {
        let bytes = golden(&format!("{distribution}_goal"));
        assert_eq!(read::<Goal>(&bytes), goal());
        let state: JointState = read(&golden(&format!("{distribution}_joint_state")));
        assert_eq!(state.name, names());
    }
}

/// Broken bytes are an error and never end the process.
#[test]
fn broken_bytes_are_an_error() {
    let whole = golden("jazzy_goal");
    for length in 0..whole.len() - 4 {
        let read = deserialize_from_cdr_with_rep_id::<Goal>(
            &whole[..length],
            RepresentationIdentifier::CDR_LE,
        );
        assert!(read.is_err(), "{length} bytes");
    }
    for place in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[place] ^= 0xff;
        let _ = deserialize_from_cdr_with_rep_id::<Goal>(&bytes, RepresentationIdentifier::CDR_LE);
    }
}

#[test]
fn spans_of_time() {
    assert_eq!(
        Span::of(2.5),
        Span {
            sec: 2,
            nanosec: 500_000_000
        }
    );
    assert_eq!(Span::of(0.999_999_999_9), Span { sec: 1, nanosec: 0 });
    assert_eq!(
        Span::of(-0.25),
        Span {
            sec: -1,
            nanosec: 750_000_000
        }
    );
    assert!((Span::of(-0.25).seconds() + 0.25).abs() < 1e-12);
}
