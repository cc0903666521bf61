//! The messages for drivers in other languages: `drivers/c/canter_driver.h` is generated from the
//! Rust types (`UPDATE_EXPECT=1` rewrites it), and a C compiler and Python agree on every size and
//! offset.
#![allow(clippy::unwrap_used, reason = "tests")]

use core::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use ipc::{
    DriverFeatures, DriverState, FaultCode, MAX_ANALOGUE, MAX_JOINTS, MAX_SENSORS, MAX_TOOLS,
    PROTOCOL, SetpointFlags, StateFlags, ToolAction, ToolFlags, ToolStatus, Verdict,
};

mod messages;

use messages::{Message, messages};

/// The header's constants: name and value.
#[allow(clippy::too_many_lines, reason = "a table")]
fn constants() -> Vec<(&'static str, u64)> {
    let number = |name, value: u32| (name, u64::from(value));
    vec![
        number("CANTER_PROTOCOL", PROTOCOL),
        ("CANTER_SCHEMA_CHECKSUM", ipc::schema_checksum()),
        ("CANTER_MAX_JOINTS", MAX_JOINTS as u64),
        ("CANTER_MAX_TOOLS", MAX_TOOLS as u64),
        ("CANTER_MAX_SENSORS", MAX_SENSORS as u64),
        ("CANTER_MAX_ANALOGUE", MAX_ANALOGUE as u64),
        number("CANTER_FLAG_HOLD", SetpointFlags::HOLD),
        number("CANTER_FLAG_STOPPING", SetpointFlags::STOPPING),
        number("CANTER_FLAG_STOP_REQUEST", SetpointFlags::STOP_REQUEST),
        number("CANTER_FLAG_GOODBYE", SetpointFlags::GOODBYE),
        number("CANTER_FLAG_EFFORT", SetpointFlags::EFFORT),
        number("CANTER_STATE_UNKNOWN", StateFlags::UNKNOWN),
        number("CANTER_STATE_NO_VELOCITY", StateFlags::NO_VELOCITY),
        number("CANTER_STATE_NO_EFFORT", StateFlags::NO_EFFORT),
        number("CANTER_STATE_COMMANDED", StateFlags::COMMANDED),
        number("CANTER_HAS_WALL", DriverFeatures::WALL),
        number("CANTER_HAS_LOCK_STEP", DriverFeatures::LOCK_STEP),
        number("CANTER_HAS_OWN_CLOCK", DriverFeatures::OWN_CLOCK),
        number("CANTER_IS_REAL", DriverFeatures::REAL),
        number("CANTER_DISCONNECTED", DriverState::Disconnected as u32),
        number("CANTER_SYNCED", DriverState::Synced as u32),
        number("CANTER_ARMED", DriverState::Armed as u32),
        number("CANTER_ACTIVE", DriverState::Active as u32),
        number("CANTER_STOPPING", DriverState::Stopping as u32),
        number("CANTER_FAULT", DriverState::Fault as u32),
        number("CANTER_NO_FAULT", FaultCode::None as u32),
        number("CANTER_FAULT_WATCHDOG", FaultCode::Watchdog as u32),
        number("CANTER_FAULT_BAD_SETPOINT", FaultCode::BadSetpoint as u32),
        number("CANTER_FAULT_OUT_OF_RANGE", FaultCode::OutOfRange as u32),
        number("CANTER_FAULT_STOP_REQUEST", FaultCode::StopRequest as u32),
        number("CANTER_FAULT_HARDWARE", FaultCode::Hardware as u32),
        number("CANTER_FAULT_STALLED", FaultCode::Stalled as u32),
        number("CANTER_FAULT_ENDED", FaultCode::Ended as u32),
        number("CANTER_FAULT_NOT_READY", FaultCode::NotReady as u32),
        number("CANTER_WELCOME", Verdict::Welcome as u32),
        number("CANTER_WRONG_PROTOCOL", Verdict::WrongProtocol as u32),
        number("CANTER_WRONG_SCHEMA", Verdict::WrongSchema as u32),
        number("CANTER_WRONG_JOINTS", Verdict::WrongJoints as u32),
        number("CANTER_WRONG_MODEL", Verdict::WrongModel as u32),
        number("CANTER_WRONG_PERIOD", Verdict::WrongPeriod as u32),
        number("CANTER_WRONG_CLOCK", Verdict::WrongClock as u32),
        number("CANTER_BUSY", Verdict::Busy as u32),
        number("CANTER_NOT_READY", Verdict::NotReady as u32),
        number("CANTER_WAIT", Verdict::Wait as u32),
        number("CANTER_TOOL_OPEN_IT", ToolAction::Open as u32),
        number("CANTER_TOOL_CLOSE_IT", ToolAction::Close as u32),
        number("CANTER_TOOL_MOVE_IT", ToolAction::Move as u32),
        number("CANTER_TOOL_HOME_IT", ToolAction::Home as u32),
        number("CANTER_TOOL_UNKNOWN", ToolStatus::Unknown as u32),
        number("CANTER_TOOL_OPEN", ToolStatus::Open as u32),
        number("CANTER_TOOL_CLOSED", ToolStatus::Closed as u32),
        number("CANTER_TOOL_MOVING", ToolStatus::Moving as u32),
        number("CANTER_TOOL_FAILED", ToolStatus::Failed as u32),
        number("CANTER_TOOL_REACHED", ToolStatus::Reached as u32),
        number("CANTER_TOOL_NOT_HOMED", ToolStatus::NotHomed as u32),
        number("CANTER_TOOL_HAS_POSITION", ToolFlags::POSITION),
        number("CANTER_TOOL_HAS_FORCE", ToolFlags::FORCE),
        number("CANTER_TOOL_SENSES_OBJECT", ToolFlags::SENSES_OBJECT),
        number("CANTER_TOOL_OBJECT", ToolFlags::OBJECT),
    ]
}

fn header() -> String {
    let mut text = String::from(
        "/* The messages of Canter's driver protocol; see docs/driver-protocol.md.\n \
         * Generated from the Rust types by ipc/tests/c_header: do not edit. */\n\
         #ifndef CANTER_DRIVER_H\n#define CANTER_DRIVER_H\n\n\
         #include <math.h>\n#include <stddef.h>\n#include <stdint.h>\n\n",
    );
    for (name, value) in constants() {
        if value > u64::from(u32::MAX) {
            writeln!(text, "#define {name} UINT64_C({value:#018x})").unwrap();
        } else {
            writeln!(text, "#define {name} {value}u").unwrap();
        }
    }
    for message in messages() {
        if !message.wire.is_empty() {
            let constant = message.name.to_uppercase();
            write!(text, "\n#define {constant}_TYPE \"{}\"", message.wire).unwrap();
        }
        text.push_str("\ntypedef struct {\n");
        for field in &message.fields {
            let (kind, length) = &field.kind;
            writeln!(text, "    {kind} {}{length};", field.name).unwrap();
        }
        let (name, size) = (message.name, message.size);
        writeln!(text, "}} {name};").unwrap();
        writeln!(
            text,
            "_Static_assert(sizeof({name}) == {size}, \"{name}\");"
        )
        .unwrap();
    }
    text.push_str(END_SPEED);
    text.push_str("\n#endif\n");
    text
}

/// The speed near the ends of a range, for drivers in C: no message has it.
const END_SPEED: &str = "
/* The largest speed (rad/s) of a joint at `position` (rad) in the direction of `velocity`, for an arm that
 * allows less speed near the ends of a range: towards an end at the distance x it is
 * sqrt(2 deceleration x) - offset, at most `top`, at least 0. `ends` are the lower and the upper end
 * (rad); they may lie beyond the range. As [joints.near_ends] in robot.toml. Link with -lm. */
static inline double canter_end_speed(double top, const double ends[2], double deceleration, double offset,
                                      double position, double velocity) {
    double room = velocity < 0.0 ? position - ends[0] : ends[1] - position;
    double speed = sqrt(2.0 * deceleration * (room > 0.0 ? room : 0.0)) - offset;
    speed = speed > 0.0 ? speed : 0.0;
    return speed < top ? speed : top;
}
";

fn drivers() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../drivers")
}

/// What every language must say: `message.field offset size`, a line each.
fn layout(name: impl Fn(&Message) -> String) -> String {
    let mut text = String::new();
    for message in messages() {
        for field in &message.fields {
            let message = name(&message);
            let (field, offset, size) = (field.name, field.offset, field.size);
            writeln!(text, "{message}.{field} {offset} {size}").unwrap();
        }
    }
    text
}

#[test]
fn the_header_is_that_of_the_types() {
    let path = drivers().join("c/canter_driver.h");
    let text = header();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap();
    assert!(
        found == text,
        "{} is not that of the types; UPDATE_EXPECT=1 rewrites it",
        path.display()
    );
}

/// Prints speeds near an end at 3 rad, with 2 rad/s2 and 0.2 rad/s: 0.04 rad before it, away from it,
/// behind it, and the same before the other end.
const SPEEDS: &str = "    const double ends[2] = {-3.0, 3.0};
    const double at[4][2] = {{2.96, 1.0}, {2.96, -1.0}, {3.01, 1.0}, {-2.96, -1.0}};
    for (int i = 0; i < 4; i++)
        printf(\"%.3f%s\", canter_end_speed(2.0, ends, 2.0, 0.2, at[i][0], at[i][1]), i < 3 ? \" \" : \"\\n\");
";

#[test]
fn a_c_compiler_agrees() {
    let folder = std::env::temp_dir().join(format!("canter-header-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    // The one that belongs to the types, whatever the file says: that is the other test's.
    std::fs::write(folder.join("canter_driver.h"), header()).unwrap();
    let mut source = String::from(
        "#include \"canter_driver.h\"\n#include <stdio.h>\n\
         #define SHOW(m, f) printf(#m \".\" #f \" %zu %zu\\n\", offsetof(m, f), sizeof(((m *)0)->f))\n\
         int main(void) {\n",
    );
    for message in messages() {
        for field in &message.fields {
            writeln!(source, "    SHOW({}, {});", message.name, field.name).unwrap();
        }
    }
    source.push_str(SPEEDS);
    source.push_str("    return 0;\n}\n");
    let (file, program) = (folder.join("layout.c"), folder.join("layout"));
    std::fs::write(&file, source).unwrap();
    let compiled = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror"])
        .arg(&file)
        .arg("-o")
        .arg(&program)
        .arg("-lm")
        .output();
    match compiled {
        Err(error) => println!("skipped: no C compiler ({error})"),
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{said}");
            let shown = Command::new(&program).output().unwrap();
            let shown = String::from_utf8(shown.stdout).unwrap();
            let speeds = "0.200 2.000 0.000 0.200\n";
            assert_eq!(shown, layout(|message| message.name.to_owned()) + speeds);
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Python and Rust choose the same directory and prefix, whatever is set.
#[test]
fn python_chooses_the_same_domain() {
    const PROGRAM: &str = "import domain
place = domain.directory()
print(place, domain.prefix(place))";
    let folder = tempfile::tempdir().unwrap();
    let runtime = folder.path().join("runtime");
    let named = folder.path().join("named");
    ipc::Domain::open(&runtime).unwrap();
    let cases = [
        vec![],
        vec![("XDG_RUNTIME_DIR", &runtime)],
        vec![("XDG_RUNTIME_DIR", &runtime), ("CANTER_DOMAIN", &named)],
    ];
    for set in cases {
        let mut python = Command::new("python3");
        python.args(["-B", "-c", PROGRAM]);
        python.current_dir(drivers().join("python/canter_driver"));
        python
            .env_remove("XDG_RUNTIME_DIR")
            .env_remove("CANTER_DOMAIN");
        python.envs(set.iter().copied());
        let output = match python.output() {
            Err(error) => return println!("ignored: no python3 ({error})"),
            Ok(output) => output,
        };
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        let domain = ipc::Domain::choose(None, |name| {
            let found = set.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| value.as_os_str().to_owned())
        });
        let domain = domain.unwrap();
        let wanted = format!("{} {}\n", domain.directory().display(), domain.prefix());
        assert_eq!(String::from_utf8(output.stdout).unwrap(), wanted);
    }
}

/// The Python messages need nothing but Python itself.
#[test]
fn python_agrees() {
    const PROGRAM: &str = "import messages as m
for name in 'ToolCommand ToolFeedback Sensor Payload Setpoint State Hello HelloAck'.split():
    message = getattr(m, name)
    for field, _ in message._fields_:
        place = getattr(message, field)
        print(f'{name}.{field} {place.offset} {place.size}')
print(m.schema_checksum())";
    let ran = Command::new("python3")
        .args(["-B", "-c", PROGRAM])
        .current_dir(drivers().join("python/canter_driver"))
        .output();
    let output = match ran {
        Err(error) => return println!("skipped: no python3 ({error})"),
        Ok(output) => output,
    };
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let names = |message: &Message| {
        let words = message.name.trim_start_matches("canter_").split('_');
        let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
        words.map(capital).collect::<String>()
    };
    let wanted = format!("{}{}\n", layout(names), ipc::schema_checksum());
    assert_eq!(String::from_utf8(output.stdout).unwrap(), wanted);
}
