//! The texts in URScript that are sent to the robot.

use core::fmt::Write as _;

use driver_kit::Outputs;
use ipc::Payload;

use crate::rtde::Version;

/// The program that hands the joints over.
const PROGRAM: &str = include_str!("../program/canter.script");

/// The first version that knows `set_target_payload`, of e-Series and of CB3.
const TARGET_PAYLOAD: [(u32, u32); 2] = [(5, 10), (3, 15)];

/// How many standard, configurable and tool outputs there are.
const OUTPUTS: [(&str, u32); 3] = [("standard", 8), ("configurable", 8), ("tool", 2)];

/// Full scale of an analogue output (V).
const FULL_SCALE: f64 = 10.0;

/// What the program must know.
#[derive(Clone, Debug, PartialEq)]
pub struct Program<'a> {
    /// Address of this machine, as the robot sees it.
    pub host: &'a str,
    /// Port on which this machine waits for the program.
    pub port: u16,
    /// `lookahead_time` of `servoj` (s), 0.03 to 0.2.
    pub lookahead: f64,
    /// `gain` of `servoj`, 100 to 2000.
    pub gain: f64,
}

impl Program<'_> {
    /// Its text.
    ///
    /// ```
    /// let program = driver_ur::Program {
    ///     host: "192.168.1.10", port: 50001, lookahead: 0.03, gain: 2000.0,
    /// };
    /// assert!(program.text().contains("socket_open(\"192.168.1.10\", 50001, \"canter\")"));
    /// ```
    pub fn text(&self) -> String {
        PROGRAM
            .replace("@HOST@", self.host)
            .replace("@PORT@", &self.port.to_string())
            .replace("@LOOKAHEAD@", &format!("{:?}", self.lookahead))
            .replace("@GAIN@", &format!("{:?}", self.gain))
    }
}

/// A program that runs beside the other one and takes no time: tells the robot what it carries.
pub(crate) fn payload(payload: &Payload, version: Version) -> String {
    let mut text = String::from("sec canter_payload():\n");
    let list = |values: &[f64]| {
        let words: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
        words.join(", ")
    };
    let (mass, centre) = (payload.mass, list(&payload.centre));
    let first = TARGET_PAYLOAD
        .iter()
        .find(|(major, _)| *major == version.major);
    // Writing to a text cannot fail.
    let _ = if first.is_some_and(|(_, minor)| version.minor >= *minor) {
        let inertia = list(&payload.inertia);
        writeln!(
            text,
            "  set_target_payload({mass:?}, [{centre}], [{inertia}])"
        )
    } else {
        writeln!(text, "  set_payload({mass:?}, [{centre}])")
    };
    let [x, y, z] = payload.tool_position;
    let [rx, ry, rz] = rotation_vector(payload.tool_rotation);
    let pose = list(&[x, y, z, rx, ry, rz]);
    let _ = writeln!(text, "  set_tcp(p[{pose}])");
    text.push_str("end\n");
    text
}

/// The rotation vector of a unit quaternion w, x, y, z (rad).
fn rotation_vector([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let sine = (x * x + y * y + z * z).sqrt();
    if sine < 1e-12 {
        return [0.0; 3];
    }
    // The shorter way round.
    let sign = if w < 0.0 { -1.0 } else { 1.0 };
    let share = sign * 2.0 * sine.atan2(w.abs()) / sine;
    [x * share, y * share, z * share]
}

/// A program that sets outputs.
pub(crate) fn outputs(outputs: &Outputs) -> String {
    let mut text = String::from("sec canter_outputs():\n");
    let mut bit = 0_u32;
    for (name, count) in OUTPUTS {
        for number in 0..count {
            if outputs.digital_mask >> bit & 1 == 1 {
                let on = match outputs.digital >> bit & 1 {
                    1 => "True",
                    _ => "False",
                };
                let _ = writeln!(text, "  set_{name}_digital_out({number}, {on})");
            }
            bit += 1;
        }
    }
    for number in 0..2 {
        if outputs.analogue_mask >> number & 1 == 1 {
            let share = (outputs.analogue[number] / FULL_SCALE).clamp(0.0, 1.0);
            let _ = writeln!(text, "  set_standard_analog_output_domain({number}, 1)");
            let _ = writeln!(text, "  set_standard_analog_out({number}, {share:?})");
        }
    }
    text.push_str("end\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(major: u32, minor: u32) -> Version {
        Version {
            major,
            minor,
            bugfix: 0,
        }
    }

    #[test]
    fn payload_and_tool_are_told_in_the_words_of_the_version() {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        let carried = Payload {
            number: 1,
            mass: 1.5,
            centre: [0.0, 0.0, 0.05],
            inertia: [0.1, 0.2, 0.3, 0.0, 0.0, 0.0],
            tool_position: [0.0, 0.0, 0.12],
            tool_rotation: [-half, 0.0, 0.0, -half],
            ..Payload::default()
        };
        let new = payload(&carried, version(5, 11));
        let old = payload(&carried, version(5, 9));
        assert!(new.contains("set_target_payload(1.5, [0.0, 0.0, 0.05], [0.1, 0.2, 0.3,"));
        assert!(old.contains("set_payload(1.5, [0.0, 0.0, 0.05])"));
        let turn = core::f64::consts::FRAC_PI_2;
        let pose = format!("set_tcp(p[0.0, 0.0, 0.12, 0.0, 0.0, {turn:?}])");
        assert!(
            new.contains(&pose) || new.contains("1.570796326794896"),
            "{new}"
        );
    }

    #[test]
    fn only_outputs_of_the_mask_are_set() {
        let mut wanted = Outputs {
            digital: 0b1_0000_0001,
            digital_mask: 0b1_0000_0011,
            analogue_mask: 0b10,
            ..Outputs::default()
        };
        wanted.analogue[1] = 5.0;
        let text = outputs(&wanted);
        assert_eq!(
            text,
            "sec canter_outputs():\n  set_standard_digital_out(0, True)\n  \
             set_standard_digital_out(1, False)\n  set_configurable_digital_out(0, True)\n  \
             set_standard_analog_output_domain(1, 1)\n  set_standard_analog_out(1, 0.5)\nend\n"
        );
    }
}
