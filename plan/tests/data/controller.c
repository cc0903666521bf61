/* Pulls a PDDL plan: arguments are the world database and the plan. */
#include <stdio.h>
#include "canter_interpreter.h"

static int take(const char *line, void *user) {
  ++*(int *)user;
  puts(line);
  return 0;
}

int main(int count, char **arguments) {
  int commands = 0, steps = 0, code;
  if (count != 3) return 64;
  if (InterpInit() != CANTER_NOT_INITIALISED) return 65;
  if (canter_configure(arguments[1], take, &commands) != CANTER_OK) return 66;
  if (InterpExecute() != CANTER_NOT_INITIALISED) return 67;
  if (InterpInit() != CANTER_OK) return 68;
  if (InterpOpenPlan("nowhere", "PDDL") != CANTER_CANNOT_READ_FILE) return 69;
  if (InterpOpenPlan(0, "PDDL") != CANTER_CANNOT_READ_FILE) return 70;
  if (InterpOpenPlan(arguments[2], "HTN") != CANTER_UNSUPPORTED_PLAN_TYPE) return 71;
  if (InterpOpenPlan(arguments[2], "PDDL") != CANTER_OK) return 72;
  while ((code = InterpExecute()) == CANTER_OK) {
    ++steps;
    if (canter_commit() != CANTER_OK) return 73;
  }
  if (InterpClosePlan() != CANTER_OK || InterpExit() != CANTER_OK) return 74;
  printf("%d steps, %d commands, code %d\n", steps, commands, code);
  return code == CANTER_END_OF_PLAN ? 0 : code;
}
