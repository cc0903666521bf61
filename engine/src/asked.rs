//! What a client asks of the session.

use std::time::Duration;

use crcl::{Located, ReadOptions};
use ipc::{Answer, FollowPoint, Verb};
use planner::timed::{TimedPoint, TimedTrajectory};
use serde_json::{Value, json};

use crate::queue::Given;
use crate::session::{Jog, JogSpace, Session};

/// Asks the session for what concerns it alone.
pub(crate) fn of_session(session: &Session, verb: Verb) -> Answer {
    match verb {
        Verb::Replace {
            format,
            name,
            program,
        } => replace(session, &format, &name, &program),
        jog @ Verb::Jog { .. } => jog_for(session, jog),
        follow @ Verb::Follow { .. } => self::follow(session, follow),
        Verb::SingleStep { on } => {
            session.set_single_step(on);
            Answer::accept(Value::Null)
        }
        Verb::Next => done(session.step_on()),
        _ => Answer::refuse("this engine cannot do that"),
    }
}

/// The answer to a request that gives nothing back.
fn done<E: std::fmt::Display>(result: Result<(), E>) -> Answer {
    match result {
        Ok(()) => Answer::accept(Value::Null),
        Err(error) => Answer::refuse(error.to_string()),
    }
}

/// Takes a program of a client: all its commands or none.
pub(crate) fn submit(session: &Session, verb: &Verb) -> Answer {
    let Some(program) = verb.program() else {
        return Answer::refuse("this is no program");
    };
    match read(program.format, program.name, program.text) {
        Ok(commands) => taken(session.submit(commands)),
        Err(refusal) => refusal,
    }
}

/// Executes a move in the place of the one that moves.
fn replace(session: &Session, format: &str, name: &str, program: &str) -> Answer {
    match read(format, name, program) {
        Ok(commands) => taken(session.replace(commands)),
        Err(refusal) => refusal,
    }
}

/// The commands of a program, or the answer that says what is wrong with it.
fn read(format: &str, name: &str, program: &str) -> Result<Vec<Located>, Answer> {
    let read = match format {
        "text" => crcl::text::read,
        "json" => crcl::json::read,
        "xml" => crcl::xml::read,
        other => {
            let why = format!("a program is text, json or xml, not {other:?}");
            return Err(Answer::refuse(why));
        }
    };
    let reading = read(program, &ReadOptions::default());
    if reading.has_errors() {
        let source = crcl::Source::new(name, program);
        let text = crcl::render(
            &reading.findings,
            reading.omitted,
            &source,
            (crcl::Look::Plain, 100),
        );
        return Err(Answer::refuse(text.trim_end()));
    }
    Ok(reading.program.commands)
}

/// The numbers of commands that were taken, as an answer.
fn taken(ids: Result<Vec<u32>, impl std::fmt::Display>) -> Answer {
    match ids {
        Ok(ids) => Answer::accept(json!({
            "first": ids.first(),
            "last": ids.last(),
            "commands": ids.len(),
        })),
        Err(refusal) => Answer::refuse(refusal.to_string()),
    }
}

/// Takes a trajectory with times of its own into the queue.
fn follow(session: &Session, verb: Verb) -> Answer {
    let Verb::Follow {
        joints,
        points,
        retime,
    } = verb
    else {
        return Answer::refuse("this is no trajectory");
    };
    taken(session.give(vec![Given::Timed(TimedTrajectory {
        joints,
        points: points.into_iter().map(timed_point).collect(),
        retime,
    })]))
}

/// A point as the planner takes it.
fn timed_point(point: FollowPoint) -> TimedPoint {
    TimedPoint {
        time: point.time_s,
        positions: point.positions,
        velocities: point.velocities,
        accelerations: point.accelerations,
    }
}

/// Jogs for as long as the client sends requests.
fn jog_for(session: &Session, verb: Verb) -> Answer {
    let Verb::Jog {
        space,
        speeds,
        timeout_ms,
        distance,
        goal,
    } = verb
    else {
        return Answer::refuse("this is no jog");
    };
    let space = match space.as_str() {
        "joint" => JogSpace::Joint,
        "tool" => JogSpace::Tool,
        "workstation" => JogSpace::Workstation,
        "base" => JogSpace::Base,
        "goal" => JogSpace::Goal,
        other => {
            return Answer::refuse(format!(
                "a jog is in joint, tool, workstation or base space or towards a goal, not {other:?}"
            ));
        }
    };
    match session.jog(Jog {
        space,
        speeds,
        timeout: Duration::from_millis(timeout_ms),
        distance,
        goal,
    }) {
        Ok(()) => Answer::accept(Value::Null),
        Err(error) => Answer::refuse(error.to_string()),
    }
}
