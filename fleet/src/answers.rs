//! Answers the questions that come over the network: two threads for each arm, so that a stop waits
//! for no program that is being read.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ipc::{Answer, Arm, Client, ControlAsk, ControlClient, IpcError, Verb};
use serde_json::{Value, json};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::allowed::Allowed;
use crate::failure::Failure;
use crate::keys;

/// How long an engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);

/// A question that has waited for longer is not answered any more.
const STALE: Duration = Duration::from_secs(5);

/// How many questions wait at most.
const WAITING: usize = 64;

/// A question that waits.
struct Waiting<T> {
    query: Query,
    came: Instant,
    what: T,
}

/// Time of this machine (ns since 1970).
pub(crate) fn clock_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    u64::try_from(since.unwrap_or_default().as_nanos()).unwrap_or(u64::MAX)
}

/// Answers questions to an arm until the queryable is dropped.
///
/// # Errors
/// The session is closed, or there are no threads.
pub(crate) fn declare(session: &Session, arm: &Arm) -> Result<Queryable<()>, Failure> {
    let (engine, engine_asked) = sync_channel(WAITING);
    let (control, control_asked) = sync_channel(WAITING);
    let own = arm.clone();
    spawn("engine", move || ask_engine(&own, &engine_asked))?;
    let own = arm.clone();
    spawn("control", move || ask_control(&own, &control_asked))?;
    let name = arm.to_string();
    session
        .declare_queryable(keys::ask(&name, "*"))
        .callback(move |query| sort(query, &name, (&engine, &control)))
        .wait()
        .map_err(Failure::link)
}

pub(crate) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), Failure> {
    let thread = thread::Builder::new().name(name.to_owned()).spawn(work);
    thread
        .map(|_| ())
        .map_err(|cause| Failure::NoPeer(format!("no thread: {cause}")))
}

/// Gives a question that passes to its thread.
fn sort(
    query: Query,
    arm: &str,
    (engine, control): (&SyncSender<Waiting<Verb>>, &SyncSender<Waiting<ControlAsk>>),
) {
    let name = query.key_expr().as_str().to_owned();
    let word = name.rsplit('/').next().unwrap_or_default();
    let one = name == keys::ask(arm, word);
    let text = query.payload().map(|payload| payload.to_bytes());
    let text = text.as_deref().unwrap_or_default();
    let allowed = Allowed::read(word, text, (one, clock_ns()));
    let came = Instant::now();
    let full = match allowed {
        Ok(Allowed::Status) => give(engine, (query, came, Verb::Status)),
        Ok(Allowed::Engine(verb)) => give(engine, (query, came, verb)),
        Ok(Allowed::Control(ask)) => give(control, (query, came, ask)),
        Err(refusal) => return reply(&query, arm, word, &Answer::refuse(refusal.to_string())),
    };
    if let Some(query) = full {
        reply(
            &query,
            arm,
            word,
            &Answer::refuse("too many questions wait"),
        );
    }
}

/// The query back if the thread has no room for it.
fn give<T>(to: &SyncSender<Waiting<T>>, (query, came, what): (Query, Instant, T)) -> Option<Query> {
    match to.try_send(Waiting { query, came, what }) {
        Ok(()) => None,
        Err(TrySendError::Full(waiting) | TrySendError::Disconnected(waiting)) => {
            Some(waiting.query)
        }
    }
}

/// Sends an answer; the name of the arm in it tells several apart.
fn reply(query: &Query, arm: &str, word: &str, answer: &Answer) {
    let text = serde_json::to_string(answer).unwrap_or_default();
    // Who asked may have gone.
    let _ = query.reply(keys::ask(arm, word), text).wait();
}

/// Asks the engine until nobody can give a question any more.
fn ask_engine(arm: &Arm, asked: &Receiver<Waiting<Verb>>) {
    let client = Client::open(arm, "canter-fleet");
    for Waiting { query, came, what } in asked {
        if came.elapsed() > STALE {
            continue;
        }
        let is_status = what == Verb::Status;
        let answer = match &client {
            Ok(client) => client.ask(what, PATIENCE),
            Err(error) => Err(error.clone()),
        };
        let answer = match answer {
            Ok(answer) if is_status => with_clock(answer),
            Ok(answer) => answer,
            // What became of it is not known: no answer says just that.
            Err(IpcError::NoWord { .. }) => continue,
            Err(error) => Answer::refuse(format!("not done: {error}")),
        };
        reply(&query, &arm.to_string(), word_of(&query), &answer);
    }
}

/// What the network is told of an engine's status.
fn with_clock(mut answer: Answer) -> Answer {
    let body = answer.body.take();
    answer.body = json!({
        "status": body["status"],
        "session": body["session"],
        "last_note": body["last_note"],
        "clock_ns": clock_ns(),
    });
    answer
}

/// Acts on the motion until nobody can ask for it any more.
fn ask_control(arm: &Arm, asked: &Receiver<Waiting<ControlAsk>>) {
    let client = ControlClient::open(arm);
    for Waiting { query, came, what } in asked {
        // A stop is always right; what moves is not, if it comes late.
        let moves = matches!(what, ControlAsk::Resume | ControlAsk::Override(_));
        if moves && came.elapsed() > STALE {
            continue;
        }
        let answer = match &client {
            Ok(client) => client.ask(what, PATIENCE),
            Err(error) => Err(error.clone()),
        };
        let answer = match answer {
            Ok(done) if done.accepted == 1 => Answer::accept(json!({
                "resting": done.resting == 1,
                "held": done.held == 1,
                "idle": done.idle == 1,
                "fault": done.fault,
                "time_scaling": done.time_scaling,
            })),
            Ok(done) => Answer::refuse(done.reason()),
            // It may have taken the request and not answered in time.
            Err(IpcError::NoAnswer { .. }) if moves => continue,
            Err(error) => Answer {
                accepted: false,
                message: error.to_string(),
                body: Value::Null,
            },
        };
        reply(&query, &arm.to_string(), word_of(&query), &answer);
    }
}

/// The last word of the name of a question.
fn word_of(query: &Query) -> &str {
    query
        .key_expr()
        .as_str()
        .rsplit('/')
        .next()
        .unwrap_or_default()
}
