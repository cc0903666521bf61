//! States, setpoints, motion and tools while all is well.

use core::time::Duration;
use std::time::Instant;

use ipc::{DriverState, GRIPPER, StateFlags, ToolAction, ToolStatus};
use scheduling::now_ns;

use crate::player::{NOT_TRIED, PERIOD, Player, Seen};

/// How long the motion to follow takes (s), and how far it goes (rad).
const SWING: (f64, f64) = (1.0, 0.02);

impl Player {
    pub(super) fn rate(&mut self) -> Seen {
        let mut states = 0;
        for _ in 0..500 {
            let setpoint = self.setpoint([0.0; 3]);
            states += self.period(Some(setpoint));
        }
        let seen = format!("{states} states in 500 periods");
        if (400..=550).contains(&states) {
            Ok(seen)
        } else {
            Err(seen)
        }
    }

    pub(super) fn foreign(&mut self) -> Seen {
        for _ in 0..20 {
            let mut setpoint = self.setpoint([0.0; 3]);
            setpoint.session ^= 0xff;
            self.period(Some(setpoint));
        }
        self.expect(&[DriverState::Synced], "")
    }

    pub(super) fn holds(&mut self) -> Seen {
        self.hold(100);
        self.heard()?;
        if self.moved() > 0.005 {
            return Err(format!("it moved by {:.4} rad", self.moved()));
        }
        self.expect(&[DriverState::Active], "")
    }

    /// The joints were measured a moment ago, or the state says that they are unknown.
    pub(super) fn measured(&mut self) -> Seen {
        const MOMENT: u64 = 50_000_000;
        self.hold(100);
        self.heard()?;
        if self.state.flags & StateFlags::UNKNOWN != 0 {
            return Err("it does not know where the arm is".to_owned());
        }
        let (now, at) = (now_ns(), self.state.measured_ns);
        let age = now.abs_diff(at) / 1000;
        if age > MOMENT / 1000 || at > self.state.published_ns {
            return Err(format!(
                "measured {age} us ago, by its own word at {at} of {now} ns"
            ));
        }
        Ok(format!("measured {age} us ago"))
    }

    /// At rest, commanded and measured joints agree.
    pub(super) fn commanded(&mut self) -> Seen {
        self.hold(100);
        self.heard()?;
        let state = &self.state;
        let pairs = state.commanded.iter().zip(&state.position);
        let apart = pairs
            .take(self.joints())
            .map(|(commanded, measured)| (commanded - measured).abs());
        let worst = apart.fold(0.0, f64::max);
        let who = if state.flags & StateFlags::COMMANDED != 0 {
            "by the arm's controller"
        } else {
            "by the driver"
        };
        let seen = format!("{worst:.5} rad from the measured joints, {who}");
        if worst < 0.05 { Ok(seen) } else { Err(seen) }
    }

    /// The first setpoint of a session must be where the arm is commanded.
    pub(super) fn starts_elsewhere(&mut self) -> Seen {
        for _ in 0..50 {
            let setpoint = self.setpoint([0.02, 0.0, 0.0]);
            self.period(Some(setpoint));
        }
        self.heard()?;
        let reason = format!("{}; ", self.state.fault_code().reason());
        if self.moved() > 0.005 {
            return Err(format!("{reason}it moved by {:.4} rad", self.moved()));
        }
        self.expect(&[DriverState::Stopping, DriverState::Fault], &reason)
    }

    pub(super) fn follows(&mut self) -> Seen {
        self.hold(50);
        let (duration, distance) = SWING;
        let mut worst = 0.0_f64;
        let periods = (duration * 1e9) as u64 / PERIOD;
        for period in 0..=periods {
            let u = period as f64 / periods as f64;
            let position = distance * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            let velocity = distance * 30.0 * u * u * (1.0 - u) * (1.0 - u) / duration;
            let acceleration =
                distance * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration * duration);
            let setpoint = self.setpoint([position, velocity, acceleration]);
            self.period(Some(setpoint));
            for joint in 0..self.joints() {
                let error = setpoint.position[joint] - self.state.position[joint];
                worst = worst.max(error.abs());
            }
        }
        let seen = format!("{worst:.5} rad behind at most");
        if worst < distance / 4.0 {
            self.expect(&[DriverState::Active], &format!("{seen}; "))
        } else {
            self.expect(
                &[],
                &format!("{seen}; {}; ", self.state.fault_code().reason()),
            )
        }
    }

    pub(super) fn gripper(&mut self) -> Seen {
        self.hold(50);
        let status = |player: &Self| ToolStatus::from_number(player.state.tools[GRIPPER].status);
        if status(self) == Some(ToolStatus::Unknown) {
            return Ok(format!("{NOT_TRIED}no gripper"));
        }
        let mut seen = String::new();
        let orders = [
            (ToolAction::Close, ToolStatus::Closed),
            (ToolAction::Open, ToolStatus::Open),
        ];
        for (number, (action, wanted)) in (1..).zip(orders) {
            self.order = (number, action);
            let start = Instant::now();
            while status(self) != Some(wanted) || self.state.tools[GRIPPER].order != number {
                self.hold(1);
                if start.elapsed() > Duration::from_secs(5) {
                    return Err(format!("{action:?}: {:?} after 5 s", status(self)));
                }
            }
            seen.push_str(&format!(
                "{action:?} in {} ms; ",
                start.elapsed().as_millis()
            ));
        }
        Ok(seen)
    }
}
