//! The messages as they are in C.

use core::mem::offset_of;

use ipc::{Hello, HelloAck, Setpoint, State, ToolCommand, ToolFeedback};

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
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) offset: usize,
    pub(crate) size: usize,
    pub(crate) kind: (&'static str, String),
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
pub(crate) struct Message {
    pub(crate) name: &'static str,
    pub(crate) wire: &'static str,
    pub(crate) size: usize,
    pub(crate) fields: Vec<Field>,
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

pub(crate) fn messages() -> [Message; 6] {
    [
        tool_command(),
        tool_feedback(),
        setpoint(),
        state(),
        hello(),
        hello_ack(),
    ]
}
