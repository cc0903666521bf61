/* The plan interpreter for callers in C and C++.
 *
 *   cargo build --release -p plan --example interpreter
 *   cc controller.c -I plan/include target/release/examples/libinterpreter.a -lpthread -ldl -lm
 *
 * One interpreter per process. Every function returns 0 for success, or one of the codes.
 */
#ifndef CANTER_INTERPRETER_H
#define CANTER_INTERPRETER_H

#ifdef __cplusplus
extern "C" {
#endif

enum {
  CANTER_OK = 0,
  CANTER_END_OF_PLAN = 1,          /* EndCanon (0) was sent */
  CANTER_NOT_INITIALISED = 2,
  CANTER_NO_PLAN_OPEN = 3,
  CANTER_PLAN_ALREADY_OPEN = 4,
  CANTER_CANNOT_READ_FILE = 5,
  CANTER_PARSE_ERROR = 6,
  CANTER_UNSUPPORTED_PLAN_TYPE = 7,
  CANTER_UNKNOWN_ACTION = 8,
  CANTER_NO_SUCH_POSE = 9,
  CANTER_PRECONDITION_FALSE = 10,
  CANTER_SINK_FULL = 11,
  CANTER_INTERNAL = 12
};

/* Receives one command as a line of the text language, in metres and radians; returns 0 when it accepts
 * it. It must not call the functions below. The text is only valid during the call. */
typedef int (*canter_command)(const char *line, void *user);

/* To be called first: sets the world database and the function that receives the commands. */
int canter_configure(const char *world, canter_command command, void *user);

/* Section VII of the specification. plan_type is "PDDL". */
int InterpInit(void);
int InterpOpenPlan(const char *file_name, const char *plan_type);
int InterpExecute(void);
int InterpClosePlan(void);
int InterpExit(void);

/* The commands of the last step have been executed: writes its effects to the world database. A step
 * whose effects are not written counts as not executed. */
int canter_commit(void);

#ifdef __cplusplus
}
#endif
#endif
