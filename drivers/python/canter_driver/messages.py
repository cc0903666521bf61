"""The messages of the driver protocol, byte for byte as in docs/driver-protocol.md."""

import ctypes
from ctypes import c_double, c_uint8, c_uint32, c_uint64

MAX_JOINTS = 16
MAX_TOOLS = 2
MAX_SENSORS = 16
MAX_ANALOGUE = 8
PROTOCOL = 2

# Driver states, faults, verdicts, tool actions and statuses, clocks and setpoint flags by number.
DISCONNECTED, SYNCED, ARMED, ACTIVE, STOPPING, FAULT = range(6)
NO_FAULT, WATCHDOG, BAD_SETPOINT, OUT_OF_RANGE, STOP_REQUEST, HARDWARE, STALLED, ENDED, NOT_READY_FAULT = range(9)
WELCOME, WRONG_PROTOCOL, WRONG_SCHEMA, WRONG_JOINTS = range(4)
WRONG_MODEL, WRONG_PERIOD, WRONG_CLOCK, BUSY, NOT_READY, WAIT = range(4, 10)
NO_ACTION, OPEN, CLOSE, MOVE, HOME = range(5)
TOOL_UNKNOWN, TOOL_OPEN, TOOL_CLOSED, TOOL_MOVING, TOOL_FAILED = range(5)
TOOL_REACHED, TOOL_NOT_HOMED = range(5, 7)
TOOL_HAS_POSITION, TOOL_HAS_FORCE, TOOL_SENSES_OBJECT, TOOL_OBJECT = 1, 2, 4, 8
WALL, LOCK_STEP = range(2)
FLAG_HOLD, FLAG_STOPPING, FLAG_STOP_REQUEST, FLAG_GOODBYE, FLAG_EFFORT = 1, 2, 4, 8, 16
STATE_UNKNOWN, STATE_NO_VELOCITY, STATE_NO_EFFORT, STATE_COMMANDED = 1, 2, 4, 8
HAS_WALL, HAS_LOCK_STEP, HAS_OWN_CLOCK, IS_REAL = 1, 2, 4, 8

Joints = c_double * MAX_JOINTS


class ToolCommand(ctypes.Structure):
    """An order to one tool; a new `order` number is a new order."""

    _fields_ = [
        ("order", c_uint32),
        ("action", c_uint32),
        ("position", c_double),
        ("velocity", c_double),
        ("force", c_double),
        ("tolerance", c_double),
    ]


class ToolFeedback(ctypes.Structure):
    """Status of one tool."""

    _fields_ = [
        ("order", c_uint32),
        ("status", c_uint32),
        ("position", c_double),
        ("force", c_double),
        ("flags", c_uint32),
        ("reserved", c_uint32),
    ]


class Sensor(ctypes.Structure):
    """A named value of a sensor; NaN where it is not known."""

    _fields_ = [
        ("name", c_uint8 * 24),
        ("value", c_double),
    ]


class Payload(ctypes.Structure):
    """What the arm carries; a new `number` is a new payload."""

    _fields_ = [
        ("number", c_uint32),
        ("reserved", c_uint32),
        ("mass", c_double),
        ("centre", c_double * 3),
        ("inertia", c_double * 6),
        ("tool_position", c_double * 3),
        ("tool_rotation", c_double * 4),
    ]


class Setpoint(ctypes.Structure):
    """The wanted state of the joints, sent once per period."""

    _fields_ = [
        ("protocol", c_uint32),
        ("joints", c_uint32),
        ("session", c_uint64),
        ("sequence", c_uint64),
        ("tick", c_uint64),
        ("published_ns", c_uint64),
        ("tick_ns", c_uint64),
        ("state_sequence", c_uint64),
        ("period_ns", c_uint64),
        ("watchdog_ns", c_uint64),
        ("command", c_uint32),
        ("flags", c_uint32),
        ("valid", c_uint32),
        ("revision", c_uint32),
        ("path_time", c_double),
        ("time_scaling", c_double),
        ("digital_outputs", c_uint64),
        ("digital_mask", c_uint64),
        ("analogue_mask", c_uint64),
        ("position", Joints),
        ("velocity", Joints),
        ("acceleration", Joints),
        ("effort", Joints),
        ("tools", ToolCommand * MAX_TOOLS),
        ("analogue_outputs", c_double * MAX_ANALOGUE),
        ("payload", Payload),
        ("reserved", c_uint64 * 4),
    ]

    @staticmethod
    def type_name():
        return "canter.Setpoint.2"


class State(ctypes.Structure):
    """The measured state of the joints, sent once per period."""

    _fields_ = [
        ("protocol", c_uint32),
        ("joints", c_uint32),
        ("session", c_uint64),
        ("sequence", c_uint64),
        ("measured_ns", c_uint64),
        ("published_ns", c_uint64),
        ("setpoint_sequence", c_uint64),
        ("setpoint_published_ns", c_uint64),
        ("setpoint_received_ns", c_uint64),
        ("driver_state", c_uint32),
        ("fault", c_uint32),
        ("fault_joint", c_uint32),
        ("fault_code", c_uint32),
        ("missed", c_uint64),
        ("flags", c_uint32),
        ("sensor_count", c_uint32),
        ("speed_scaling", c_double),
        ("hardware_ns", c_uint64),
        ("digital_inputs", c_uint64),
        ("revision", c_uint64),
        ("position", Joints),
        ("velocity", Joints),
        ("effort", Joints),
        ("commanded", Joints),
        ("tools", ToolFeedback * MAX_TOOLS),
        ("analogue_inputs", c_double * MAX_ANALOGUE),
        ("sensors", Sensor * MAX_SENSORS),
        ("text", c_uint8 * 96),
        ("reserved", c_uint64 * 4),
    ]

    @staticmethod
    def type_name():
        return "canter.State.2"


class Hello(ctypes.Structure):
    """The engine's request for a session."""

    _fields_ = [
        ("protocol", c_uint32),
        ("joints", c_uint32),
        ("schema", c_uint64),
        ("model", c_uint64),
        ("period_ns", c_uint64),
        ("watchdog_ns", c_uint64),
        ("clock", c_uint32),
        ("process", c_uint32),
        ("name", c_uint8 * 64),
        ("reserved", c_uint64 * 4),
    ]

    @staticmethod
    def type_name():
        return "canter.Hello.2"


class HelloAck(ctypes.Structure):
    """The driver's answer."""

    _fields_ = [
        ("protocol", c_uint32),
        ("joints", c_uint32),
        ("verdict", c_uint32),
        ("features", c_uint32),
        ("schema", c_uint64),
        ("session", c_uint64),
        ("watchdog_ns", c_uint64),
        ("position", Joints),
        ("commanded", Joints),
        ("lower", Joints),
        ("upper", Joints),
        ("velocity", Joints),
        ("acceleration", Joints),
        ("jerk", Joints),
        ("periods_ns", c_uint64 * 2),
        ("delay_ns", c_uint64),
        ("name", c_uint8 * 64),
        ("reason", c_uint8 * 128),
        ("reserved", c_uint64 * 4),
    ]

    @staticmethod
    def type_name():
        return "canter.HelloAck.2"


def schema_checksum():
    """The checksum of the layout in this file (FNV-1a over sizes, offsets and
    the number of fault codes)."""
    numbers = [
        PROTOCOL,
        MAX_JOINTS,
        MAX_TOOLS,
        MAX_SENSORS,
        MAX_ANALOGUE,
        ctypes.sizeof(Setpoint),
        Setpoint.position.offset,
        Setpoint.tools.offset,
        Setpoint.digital_outputs.offset,
        Setpoint.payload.offset,
        ctypes.sizeof(State),
        State.position.offset,
        State.tools.offset,
        State.digital_inputs.offset,
        State.sensors.offset,
        State.text.offset,
        ctypes.sizeof(Hello),
        ctypes.sizeof(HelloAck),
        NOT_READY_FAULT + 1,
    ]
    value = 0xCBF29CE484222325
    for number in numbers:
        value = ((value ^ number) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    return value
