//! The messages as they are in C.

use core::mem::offset_of;

use ipc::{Hello, HelloAck, Payload, Sensor, Setpoint, State, ToolCommand, ToolFeedback};

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

impl InC for Sensor {
    fn in_c() -> (&'static str, String) {
        ("canter_sensor", String::new())
    }
}

impl InC for Payload {
    fn in_c() -> (&'static str, String) {
        ("canter_payload", String::new())
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

/// A message with these fields. A macro, because a field's offset needs its name.
macro_rules! message {
    ($kind:ty, $name:literal, $wire:literal, $($field:ident)*) => {
        Message::new::<$kind>($name, $wire, vec![$(field(
            stringify!($field),
            offset_of!($kind, $field),
            |message: &$kind| &message.$field,
        )),*])
    };
}

fn tool_command() -> Message {
    message!(
        ToolCommand,
        "canter_tool_command",
        "",
            order action position velocity force tolerance
    )
}

fn tool_feedback() -> Message {
    message!(
        ToolFeedback,
        "canter_tool_feedback",
        "",
            order status position force flags reserved
    )
}

fn sensor() -> Message {
    message!(
        Sensor,
        "canter_sensor",
        "",
            name value
    )
}

fn payload() -> Message {
    message!(
        Payload,
        "canter_payload",
        "",
            number reserved mass centre inertia tool_position tool_rotation
    )
}

fn setpoint() -> Message {
    message!(
        Setpoint,
        "canter_setpoint",
        "canter.Setpoint.2",
            protocol joints session sequence tick published_ns tick_ns state_sequence period_ns
            watchdog_ns command flags valid revision path_time time_scaling digital_outputs
            digital_mask analogue_mask position velocity acceleration effort tools
            analogue_outputs payload reserved
    )
}

fn state() -> Message {
    message!(
        State,
        "canter_state",
        "canter.State.2",
            protocol joints session sequence measured_ns published_ns setpoint_sequence
            setpoint_published_ns setpoint_received_ns driver_state fault fault_joint
            fault_code missed flags sensor_count speed_scaling hardware_ns digital_inputs
            revision position velocity effort commanded tools analogue_inputs sensors text
            reserved
    )
}

fn hello() -> Message {
    message!(
        Hello,
        "canter_hello",
        "canter.Hello.2",
            protocol joints schema model period_ns watchdog_ns clock process name reserved
    )
}

fn hello_ack() -> Message {
    message!(
        HelloAck,
        "canter_hello_ack",
        "canter.HelloAck.2",
            protocol joints verdict features schema session watchdog_ns position commanded
            lower upper velocity acceleration jerk periods_ns delay_ns name reason reserved
    )
}

pub(crate) fn messages() -> [Message; 8] {
    [
        tool_command(),
        tool_feedback(),
        sensor(),
        payload(),
        setpoint(),
        state(),
        hello(),
        hello_ack(),
    ]
}
