//! The messages for drivers in other languages: `drivers/c/canter_driver.h` is generated from the
//! Rust types (`UPDATE_EXPECT=1` rewrites it), and a C compiler and Python agree on every size and
//! offset.
#![allow(clippy::unwrap_used, reason = "tests")]

use core::fmt::Write as _;
use core::mem::offset_of;
use std::path::{Path, PathBuf};
use std::process::Command;

use ipc::{
    DriverState, FaultCode, Hello, HelloAck, MAX_JOINTS, MAX_TOOLS, PROTOCOL, Setpoint,
    SetpointFlags, State, ToolAction, ToolCommand, ToolFeedback, ToolStatus, Verdict,
};

/// A type of a message field in C: the type's name, and the length of an array.
trait InC {
    fn in_c() -> (&'static str, String);
}

impl InC for u8 {
    fn in_c() -> (&'static str, String) {
        ("uint8_t", String::new())
    }
}

impl InC for u32 {
    fn in_c() -> (&'static str, String) {
        ("uint32_t", String::new())
    }
}

impl InC for u64 {
    fn in_c() -> (&'static str, String) {
        ("uint64_t", String::new())
    }
}

impl InC for f64 {
    fn in_c() -> (&'static str, String) {
        ("double", String::new())
    }
}

impl InC for ToolCommand {
    fn in_c() -> (&'static str, String) {
        ("canter_tool_command", String::new())
    }
}

impl InC for ToolFeedback {
    fn in_c() -> (&'static str, String) {
        ("canter_tool_feedback", String::new())
    }
}

impl<T: InC, const N: usize> InC for [T; N] {
    fn in_c() -> (&'static str, String) {
        (T::in_c().0, format!("[{N}]"))
    }
}

/// A field of a message: its name, offset, size, and type in C.
struct Field {
    name: &'static str,
    offset: usize,
    size: usize,
    kind: (&'static str, String),
}

fn field<M, T: InC>(name: &'static str, offset: usize, _of: fn(&M) -> &T) -> Field {
    Field {
        name,
        offset,
        size: size_of::<T>(),
        kind: T::in_c(),
    }
}

/// A message: its name in C, the name of its type on the wire, its size and all its fields.
struct Message {
    name: &'static str,
    wire: &'static str,
    size: usize,
    fields: Vec<Field>,
}

impl Message {
    fn new<M>(name: &'static str, wire: &'static str, fields: Vec<Field>) -> Self {
        let size = size_of::<M>();
        // Nothing between the fields, nothing after them: none was forgotten.
        let end = fields.iter().fold(0, |at, field| {
            assert_eq!(field.offset, at, "{name}.{}", field.name);
            at + field.size
        });
        assert_eq!(end, size, "{name}");
        Self {
            name,
            wire,
            size,
            fields,
        }
    }
}

fn tool_command() -> Message {
    type M = ToolCommand;
    Message::new::<M>(
        "canter_tool_command",
        "",
        vec![
            field("order", offset_of!(M, order), |m: &M| &m.order),
            field("action", offset_of!(M, action), |m: &M| &m.action),
            field("position", offset_of!(M, position), |m: &M| &m.position),
            field("velocity", offset_of!(M, velocity), |m: &M| &m.velocity),
            field("force", offset_of!(M, force), |m: &M| &m.force),
        ],
    )
}

fn tool_feedback() -> Message {
    type M = ToolFeedback;
    Message::new::<M>(
        "canter_tool_feedback",
        "",
        vec![
            field("order", offset_of!(M, order), |m: &M| &m.order),
            field("status", offset_of!(M, status), |m: &M| &m.status),
            field("position", offset_of!(M, position), |m: &M| &m.position),
            field("force", offset_of!(M, force), |m: &M| &m.force),
            field("reserved", offset_of!(M, reserved), |m: &M| &m.reserved),
        ],
    )
}

fn setpoint() -> Message {
    type M = Setpoint;
    Message::new::<M>(
        "canter_setpoint",
        "canter.Setpoint.1",
        vec![
            field("protocol", offset_of!(M, protocol), |m: &M| &m.protocol),
            field("joints", offset_of!(M, joints), |m: &M| &m.joints),
            field("session", offset_of!(M, session), |m: &M| &m.session),
            field("sequence", offset_of!(M, sequence), |m: &M| &m.sequence),
            field("tick", offset_of!(M, tick), |m: &M| &m.tick),
            field("published_ns", offset_of!(M, published_ns), |m: &M| {
                &m.published_ns
            }),
            field("tick_ns", offset_of!(M, tick_ns), |m: &M| &m.tick_ns),
            field("period_ns", offset_of!(M, period_ns), |m: &M| &m.period_ns),
            field("watchdog_ns", offset_of!(M, watchdog_ns), |m: &M| {
                &m.watchdog_ns
            }),
            field("state_sequence", offset_of!(M, state_sequence), |m: &M| {
                &m.state_sequence
            }),
            field("command", offset_of!(M, command), |m: &M| &m.command),
            field("flags", offset_of!(M, flags), |m: &M| &m.flags),
            field("valid", offset_of!(M, valid), |m: &M| &m.valid),
            field("reserved_word", offset_of!(M, reserved_word), |m: &M| {
                &m.reserved_word
            }),
            field("path_time", offset_of!(M, path_time), |m: &M| &m.path_time),
            field("time_scaling", offset_of!(M, time_scaling), |m: &M| {
                &m.time_scaling
            }),
            field("position", offset_of!(M, position), |m: &M| &m.position),
            field("velocity", offset_of!(M, velocity), |m: &M| &m.velocity),
            field("acceleration", offset_of!(M, acceleration), |m: &M| {
                &m.acceleration
            }),
            field("effort", offset_of!(M, effort), |m: &M| &m.effort),
            field("tools", offset_of!(M, tools), |m: &M| &m.tools),
            field(
                "digital_outputs",
                offset_of!(M, digital_outputs),
                |m: &M| &m.digital_outputs,
            ),
            field("reserved", offset_of!(M, reserved), |m: &M| &m.reserved),
        ],
    )
}

fn state() -> Message {
    type M = State;
    Message::new::<M>(
        "canter_state",
        "canter.State.1",
        vec![
            field("protocol", offset_of!(M, protocol), |m: &M| &m.protocol),
            field("joints", offset_of!(M, joints), |m: &M| &m.joints),
            field("session", offset_of!(M, session), |m: &M| &m.session),
            field("sequence", offset_of!(M, sequence), |m: &M| &m.sequence),
            field("measured_ns", offset_of!(M, measured_ns), |m: &M| {
                &m.measured_ns
            }),
            field("published_ns", offset_of!(M, published_ns), |m: &M| {
                &m.published_ns
            }),
            field(
                "setpoint_sequence",
                offset_of!(M, setpoint_sequence),
                |m: &M| &m.setpoint_sequence,
            ),
            field(
                "setpoint_published_ns",
                offset_of!(M, setpoint_published_ns),
                |m: &M| &m.setpoint_published_ns,
            ),
            field(
                "setpoint_received_ns",
                offset_of!(M, setpoint_received_ns),
                |m: &M| &m.setpoint_received_ns,
            ),
            field("driver_state", offset_of!(M, driver_state), |m: &M| {
                &m.driver_state
            }),
            field("fault", offset_of!(M, fault), |m: &M| &m.fault),
            field("fault_joint", offset_of!(M, fault_joint), |m: &M| {
                &m.fault_joint
            }),
            field("reserved_word", offset_of!(M, reserved_word), |m: &M| {
                &m.reserved_word
            }),
            field("missed", offset_of!(M, missed), |m: &M| &m.missed),
            field("position", offset_of!(M, position), |m: &M| &m.position),
            field("velocity", offset_of!(M, velocity), |m: &M| &m.velocity),
            field("effort", offset_of!(M, effort), |m: &M| &m.effort),
            field("tools", offset_of!(M, tools), |m: &M| &m.tools),
            field("digital_inputs", offset_of!(M, digital_inputs), |m: &M| {
                &m.digital_inputs
            }),
            field("hardware_ns", offset_of!(M, hardware_ns), |m: &M| {
                &m.hardware_ns
            }),
            field("reserved", offset_of!(M, reserved), |m: &M| &m.reserved),
        ],
    )
}

fn hello() -> Message {
    type M = Hello;
    Message::new::<M>(
        "canter_hello",
        "canter.Hello.1",
        vec![
            field("protocol", offset_of!(M, protocol), |m: &M| &m.protocol),
            field("joints", offset_of!(M, joints), |m: &M| &m.joints),
            field("schema", offset_of!(M, schema), |m: &M| &m.schema),
            field("model", offset_of!(M, model), |m: &M| &m.model),
            field("period_ns", offset_of!(M, period_ns), |m: &M| &m.period_ns),
            field("watchdog_ns", offset_of!(M, watchdog_ns), |m: &M| {
                &m.watchdog_ns
            }),
            field("clock", offset_of!(M, clock), |m: &M| &m.clock),
            field("process", offset_of!(M, process), |m: &M| &m.process),
            field("name", offset_of!(M, name), |m: &M| &m.name),
            field("reserved", offset_of!(M, reserved), |m: &M| &m.reserved),
        ],
    )
}

fn hello_ack() -> Message {
    type M = HelloAck;
    Message::new::<M>(
        "canter_hello_ack",
        "canter.HelloAck.1",
        vec![
            field("protocol", offset_of!(M, protocol), |m: &M| &m.protocol),
            field("joints", offset_of!(M, joints), |m: &M| &m.joints),
            field("verdict", offset_of!(M, verdict), |m: &M| &m.verdict),
            field("reserved_word", offset_of!(M, reserved_word), |m: &M| {
                &m.reserved_word
            }),
            field("schema", offset_of!(M, schema), |m: &M| &m.schema),
            field("session", offset_of!(M, session), |m: &M| &m.session),
            field("watchdog_ns", offset_of!(M, watchdog_ns), |m: &M| {
                &m.watchdog_ns
            }),
            field("position", offset_of!(M, position), |m: &M| &m.position),
            field("lower", offset_of!(M, lower), |m: &M| &m.lower),
            field("upper", offset_of!(M, upper), |m: &M| &m.upper),
            field("velocity", offset_of!(M, velocity), |m: &M| &m.velocity),
            field("name", offset_of!(M, name), |m: &M| &m.name),
            field("reason", offset_of!(M, reason), |m: &M| &m.reason),
            field("reserved", offset_of!(M, reserved), |m: &M| &m.reserved),
        ],
    )
}

fn messages() -> [Message; 6] {
    [
        tool_command(),
        tool_feedback(),
        setpoint(),
        state(),
        hello(),
        hello_ack(),
    ]
}

/// The header's constants: name and value.
fn constants() -> Vec<(&'static str, u64)> {
    let number = |name, value: u32| (name, u64::from(value));
    vec![
        number("CANTER_PROTOCOL", PROTOCOL),
        ("CANTER_SCHEMA_CHECKSUM", ipc::schema_checksum()),
        ("CANTER_MAX_JOINTS", MAX_JOINTS as u64),
        ("CANTER_MAX_TOOLS", MAX_TOOLS as u64),
        number("CANTER_FLAG_HOLD", SetpointFlags::HOLD),
        number("CANTER_FLAG_STOPPING", SetpointFlags::STOPPING),
        number("CANTER_FLAG_STOP_REQUEST", SetpointFlags::STOP_REQUEST),
        number("CANTER_FLAG_GOODBYE", SetpointFlags::GOODBYE),
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
        number("CANTER_WELCOME", Verdict::Welcome as u32),
        number("CANTER_WRONG_PROTOCOL", Verdict::WrongProtocol as u32),
        number("CANTER_WRONG_SCHEMA", Verdict::WrongSchema as u32),
        number("CANTER_WRONG_JOINTS", Verdict::WrongJoints as u32),
        number("CANTER_WRONG_MODEL", Verdict::WrongModel as u32),
        number("CANTER_WRONG_PERIOD", Verdict::WrongPeriod as u32),
        number("CANTER_WRONG_CLOCK", Verdict::WrongClock as u32),
        number("CANTER_BUSY", Verdict::Busy as u32),
        number("CANTER_NOT_READY", Verdict::NotReady as u32),
        number("CANTER_TOOL_OPEN_IT", ToolAction::Open as u32),
        number("CANTER_TOOL_CLOSE_IT", ToolAction::Close as u32),
        number("CANTER_TOOL_UNKNOWN", ToolStatus::Unknown as u32),
        number("CANTER_TOOL_OPEN", ToolStatus::Open as u32),
        number("CANTER_TOOL_CLOSED", ToolStatus::Closed as u32),
        number("CANTER_TOOL_MOVING", ToolStatus::Moving as u32),
        number("CANTER_TOOL_FAILED", ToolStatus::Failed as u32),
    ]
}

fn header() -> String {
    let mut text = String::from(
        "/* The messages of Canter's driver protocol; see docs/driver-protocol.md.\n \
         * Generated from the Rust types by ipc/tests/c_header.rs: do not edit. */\n\
         #ifndef CANTER_DRIVER_H\n#define CANTER_DRIVER_H\n\n\
         #include <stddef.h>\n#include <stdint.h>\n\n",
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
    text.push_str("\n#endif\n");
    text
}

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
    source.push_str("    return 0;\n}\n");
    let (file, program) = (folder.join("layout.c"), folder.join("layout"));
    std::fs::write(&file, source).unwrap();
    let compiled = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror"])
        .arg(&file)
        .arg("-o")
        .arg(&program)
        .output();
    match compiled {
        Err(error) => println!("skipped: no C compiler ({error})"),
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{said}");
            let shown = Command::new(&program).output().unwrap();
            let shown = String::from_utf8(shown.stdout).unwrap();
            assert_eq!(shown, layout(|message| message.name.to_owned()));
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
for name in 'ToolCommand ToolFeedback Setpoint State Hello HelloAck'.split():
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
