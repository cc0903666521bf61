//! Plan interpreters (PDDL, kitting process plans) and the world model.
