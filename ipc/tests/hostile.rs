//! Everything that is read from shared memory is checked.

use ipc::{Clock, Hello, HelloAck, MAX_JOINTS, MessageError, Setpoint, State, Verdict};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn config() -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(6),
        cases: 4096,
        ..ProptestConfig::default()
    }
}

/// A number as a hostile peer would choose it: any bits, often special.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        Just(f64::NAN),
        Just(f64::INFINITY),
        -3.0..3.0_f64,
    ]
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_state_is_accepted_only_whole(
        head in prop::array::uniform4(0_u32..12),
        values in prop::collection::vec(number(), 3 * 6),
        joints in 0_usize..=20,
        tool in any::<u32>(),
    ) {
        let mut state = State {
            protocol: head[0],
            joints: head[1],
            driver_state: head[2],
            fault: head[3],
            ..State::default()
        };
        state.position[..6].copy_from_slice(&values[..6]);
        state.velocity[..6].copy_from_slice(&values[6..12]);
        state.effort[..6].copy_from_slice(&values[12..]);
        state.tools[0].status = tool % 8;
        if state.check(joints).is_ok() {
            prop_assert_eq!(state.protocol, ipc::PROTOCOL);
            prop_assert_eq!(state.joints as usize, joints);
            prop_assert!(joints <= MAX_JOINTS);
            prop_assert!(state.position.iter().take(joints).all(|value| value.is_finite()));
            prop_assert!(ipc::DriverState::from_number(state.driver_state).is_some());
            prop_assert!(ipc::ToolStatus::from_number(state.tools[0].status).is_some());
        }
    }
}

#[test]
fn good_messages_are_accepted() {
    let state = State {
        joints: 6,
        ..State::default()
    };
    assert_eq!(state.check(6), Ok(()));
    let setpoint = Setpoint {
        joints: 6,
        period_ns: 1_000_000,
        watchdog_ns: 50_000_000,
        ..Setpoint::default()
    };
    assert_eq!(setpoint.check(6), Ok(()));
    assert_eq!(
        Hello::new(6, 1_000_000, 50_000_000, Clock::Wall).check(6),
        Ok(())
    );
}

#[test]
fn each_fault_is_named() {
    let good = State {
        joints: 6,
        ..State::default()
    };
    let mut bad = good;
    bad.velocity[3] = f64::NAN;
    let Err(MessageError::NotFinite {
        quantity: "velocity",
        joint: 3,
        ..
    }) = bad.check(6)
    else {
        panic!("{:?}", bad.check(6));
    };
    assert!(matches!(
        State {
            driver_state: 77,
            ..good
        }
        .check(6),
        Err(MessageError::Choice {
            field: "driver state",
            value: 77
        })
    ));
    assert!(matches!(
        good.check(7),
        Err(MessageError::Joints {
            expected: 7,
            found: 6
        })
    ));
    let zero = HelloAck::refusal(6, Verdict::Welcome, "");
    assert!(matches!(
        zero.check(6),
        Err(MessageError::Range {
            field: "session",
            ..
        })
    ));
    let hello = Hello {
        schema: 1,
        ..Hello::new(6, 1_000_000, 50_000_000, Clock::Wall)
    };
    assert!(matches!(
        hello.check(6),
        Err(MessageError::Schema { found: 1, .. })
    ));
}

#[test]
fn texts_are_cut_and_cleaned() {
    assert_eq!(ipc::text_of(&ipc::bytes_of::<4>("abcdef")), "abcd");
    assert_eq!(ipc::text_of(&ipc::bytes_of::<4>("äöü")), "äö");
    assert_eq!(ipc::text_of(&[b'a', 7, 0xff, b'b', 0, b'c']), "a??b");
}
