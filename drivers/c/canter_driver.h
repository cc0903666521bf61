/* The messages of Canter's driver protocol; see docs/driver-protocol.md.
 * Generated from the Rust types by ipc/tests/c_header: do not edit. */
#ifndef CANTER_DRIVER_H
#define CANTER_DRIVER_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#define CANTER_PROTOCOL 2u
#define CANTER_SCHEMA_CHECKSUM UINT64_C(0x5ea685e67ca2cb2c)
#define CANTER_MAX_JOINTS 16u
#define CANTER_MAX_TOOLS 2u
#define CANTER_MAX_SENSORS 16u
#define CANTER_MAX_ANALOGUE 8u
#define CANTER_FLAG_HOLD 1u
#define CANTER_FLAG_STOPPING 2u
#define CANTER_FLAG_STOP_REQUEST 4u
#define CANTER_FLAG_GOODBYE 8u
#define CANTER_FLAG_EFFORT 16u
#define CANTER_STATE_UNKNOWN 1u
#define CANTER_STATE_NO_VELOCITY 2u
#define CANTER_STATE_NO_EFFORT 4u
#define CANTER_STATE_COMMANDED 8u
#define CANTER_HAS_WALL 1u
#define CANTER_HAS_LOCK_STEP 2u
#define CANTER_HAS_OWN_CLOCK 4u
#define CANTER_IS_REAL 8u
#define CANTER_DISCONNECTED 0u
#define CANTER_SYNCED 1u
#define CANTER_ARMED 2u
#define CANTER_ACTIVE 3u
#define CANTER_STOPPING 4u
#define CANTER_FAULT 5u
#define CANTER_NO_FAULT 0u
#define CANTER_FAULT_WATCHDOG 1u
#define CANTER_FAULT_BAD_SETPOINT 2u
#define CANTER_FAULT_OUT_OF_RANGE 3u
#define CANTER_FAULT_STOP_REQUEST 4u
#define CANTER_FAULT_HARDWARE 5u
#define CANTER_FAULT_STALLED 6u
#define CANTER_FAULT_ENDED 7u
#define CANTER_FAULT_NOT_READY 8u
#define CANTER_WELCOME 0u
#define CANTER_WRONG_PROTOCOL 1u
#define CANTER_WRONG_SCHEMA 2u
#define CANTER_WRONG_JOINTS 3u
#define CANTER_WRONG_MODEL 4u
#define CANTER_WRONG_PERIOD 5u
#define CANTER_WRONG_CLOCK 6u
#define CANTER_BUSY 7u
#define CANTER_NOT_READY 8u
#define CANTER_WAIT 9u
#define CANTER_TOOL_OPEN_IT 1u
#define CANTER_TOOL_CLOSE_IT 2u
#define CANTER_TOOL_MOVE_IT 3u
#define CANTER_TOOL_HOME_IT 4u
#define CANTER_TOOL_UNKNOWN 0u
#define CANTER_TOOL_OPEN 1u
#define CANTER_TOOL_CLOSED 2u
#define CANTER_TOOL_MOVING 3u
#define CANTER_TOOL_FAILED 4u
#define CANTER_TOOL_REACHED 5u
#define CANTER_TOOL_NOT_HOMED 6u
#define CANTER_TOOL_HAS_POSITION 1u
#define CANTER_TOOL_HAS_FORCE 2u
#define CANTER_TOOL_SENSES_OBJECT 4u
#define CANTER_TOOL_OBJECT 8u

typedef struct {
    uint32_t order;
    uint32_t action;
    double position;
    double velocity;
    double force;
    double tolerance;
} canter_tool_command;
_Static_assert(sizeof(canter_tool_command) == 40, "canter_tool_command");

typedef struct {
    uint32_t order;
    uint32_t status;
    double position;
    double force;
    uint32_t flags;
    uint32_t reserved;
} canter_tool_feedback;
_Static_assert(sizeof(canter_tool_feedback) == 32, "canter_tool_feedback");

typedef struct {
    uint8_t name[24];
    double value;
} canter_sensor;
_Static_assert(sizeof(canter_sensor) == 32, "canter_sensor");

typedef struct {
    uint32_t number;
    uint32_t reserved;
    double mass;
    double centre[3];
    double inertia[6];
    double tool_position[3];
    double tool_rotation[4];
} canter_payload;
_Static_assert(sizeof(canter_payload) == 144, "canter_payload");

#define CANTER_SETPOINT_TYPE "canter.Setpoint.2"
typedef struct {
    uint32_t protocol;
    uint32_t joints;
    uint64_t session;
    uint64_t sequence;
    uint64_t tick;
    uint64_t published_ns;
    uint64_t tick_ns;
    uint64_t state_sequence;
    uint64_t period_ns;
    uint64_t watchdog_ns;
    uint32_t command;
    uint32_t flags;
    uint32_t valid;
    uint32_t revision;
    double path_time;
    double time_scaling;
    uint64_t digital_outputs;
    uint64_t digital_mask;
    uint64_t analogue_mask;
    double position[16];
    double velocity[16];
    double acceleration[16];
    double effort[16];
    canter_tool_command tools[2];
    double analogue_outputs[8];
    canter_payload payload;
    uint64_t reserved[4];
} canter_setpoint;
_Static_assert(sizeof(canter_setpoint) == 960, "canter_setpoint");

#define CANTER_STATE_TYPE "canter.State.2"
typedef struct {
    uint32_t protocol;
    uint32_t joints;
    uint64_t session;
    uint64_t sequence;
    uint64_t measured_ns;
    uint64_t published_ns;
    uint64_t setpoint_sequence;
    uint64_t setpoint_published_ns;
    uint64_t setpoint_received_ns;
    uint32_t driver_state;
    uint32_t fault;
    uint32_t fault_joint;
    uint32_t fault_code;
    uint64_t missed;
    uint32_t flags;
    uint32_t sensor_count;
    double speed_scaling;
    uint64_t hardware_ns;
    uint64_t digital_inputs;
    uint64_t revision;
    double position[16];
    double velocity[16];
    double effort[16];
    double commanded[16];
    canter_tool_feedback tools[2];
    double analogue_inputs[8];
    canter_sensor sensors[16];
    uint8_t text[96];
    uint64_t reserved[4];
} canter_state;
_Static_assert(sizeof(canter_state) == 1408, "canter_state");

#define CANTER_HELLO_TYPE "canter.Hello.2"
typedef struct {
    uint32_t protocol;
    uint32_t joints;
    uint64_t schema;
    uint64_t model;
    uint64_t period_ns;
    uint64_t watchdog_ns;
    uint32_t clock;
    uint32_t process;
    uint8_t name[64];
    uint64_t reserved[4];
} canter_hello;
_Static_assert(sizeof(canter_hello) == 144, "canter_hello");

#define CANTER_HELLO_ACK_TYPE "canter.HelloAck.2"
typedef struct {
    uint32_t protocol;
    uint32_t joints;
    uint32_t verdict;
    uint32_t features;
    uint64_t schema;
    uint64_t session;
    uint64_t watchdog_ns;
    double position[16];
    double commanded[16];
    double lower[16];
    double upper[16];
    double velocity[16];
    double acceleration[16];
    double jerk[16];
    uint64_t periods_ns[2];
    uint64_t delay_ns;
    uint8_t name[64];
    uint8_t reason[128];
    uint64_t reserved[4];
} canter_hello_ack;
_Static_assert(sizeof(canter_hello_ack) == 1184, "canter_hello_ack");

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

#endif
