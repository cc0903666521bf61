//! The five functions for callers in C, C++ and other languages.
//!
//! The specification gives them no handle, so there is one interpreter per process, behind a lock.
//! [`canter_configure`] sets the world database and the function that receives the commands; each
//! command comes as one line of the text language. The only unsafe code of this crate is here:
//! reading C strings and naming the functions (docs/decisions/0070).
#![allow(
    unsafe_code,
    reason = "C strings and unmangled names; see docs/decisions/0070"
)]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::sync::Mutex;

use crcl::Command;

use super::{Code, CommandSink, PddlInterpreter, PlanInterpreter};
use crate::pddl::ActionTable;
use crate::run::RobotOptions;
use crate::world::{Change, Durability, Writer};

/// Receives one command as a line of the text language and the pointer given to
/// [`canter_configure`]; returns 0 when it accepted the command.
pub type CommandCallback = extern "C" fn(line: *const c_char, user: *mut c_void) -> c_int;

struct Process {
    interpreter: PddlInterpreter,
    callback: CommandCallback,
    /// Address of the caller's data; never read here.
    user: usize,
    world: std::path::PathBuf,
    /// Effects of the last step, until they are committed.
    pending: Vec<Change>,
}

static PROCESS: Mutex<Option<Process>> = Mutex::new(None);

struct Lines<'a> {
    callback: CommandCallback,
    user: usize,
    pending: &'a mut Vec<Change>,
}

impl CommandSink for Lines<'_> {
    fn command(&mut self, command: Command) -> bool {
        // Turn the number back into the pointer that the caller gave.
        let user = std::ptr::without_provenance_mut::<c_void>(self.user);
        CString::new(crcl::text::write_command(&command))
            .is_ok_and(|line| (self.callback)(line.as_ptr(), user) == 0)
    }

    fn effects(&mut self, changes: Vec<Change>) {
        *self.pending = changes;
    }
}

/// Runs `call` with the interpreter and its sink.
fn with(call: impl FnOnce(&mut PddlInterpreter, &mut dyn CommandSink) -> Code) -> c_int {
    let mut process = PROCESS
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let Some(Process {
        interpreter,
        callback,
        user,
        pending,
        ..
    }) = process.as_mut()
    else {
        return Code::NotInitialised as c_int;
    };
    pending.clear();
    call(
        interpreter,
        &mut Lines {
            callback: *callback,
            user: *user,
            pending,
        },
    ) as c_int
}

/// Text of a C string; none for a null pointer or text that is not UTF-8.
///
/// # Safety
/// `text` is null or points to a text that ends with a zero byte and does not change during the
/// call.
unsafe fn text<'a>(text: *const c_char) -> Option<&'a str> {
    if text.is_null() {
        return None;
    }
    // SAFETY: not null, and the caller promises a terminated text that stays as it is.
    unsafe { CStr::from_ptr(text) }.to_str().ok()
}

/// Sets the world database and the function that receives the commands. To be called first; an open
/// plan is dropped. Returns 0, or a positive [`Code`].
///
/// # Safety
/// `world` is a text that ends with a zero byte. `callback` may be called with `user` until
/// `InterpExit` returns, from the thread that calls the other functions, and must not call them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn canter_configure(
    world: *const c_char,
    callback: CommandCallback,
    user: *mut c_void,
) -> c_int {
    // SAFETY: promised by the caller.
    let Some(world) = (unsafe { text(world) }) else {
        return Code::CannotReadFile as c_int;
    };
    let Ok(table) = ActionTable::own() else {
        return Code::Internal as c_int;
    };
    let interpreter = PddlInterpreter::new(Path::new(world), table, RobotOptions::default());
    let mut process = PROCESS
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let world = Path::new(world).to_owned();
    let (user, pending) = (user.addr(), Vec::new());
    *process = Some(Process {
        interpreter,
        callback,
        user,
        world,
        pending,
    });
    Code::Ok as c_int
}

/// Gets ready. Returns 0, or a positive [`Code`].
#[unsafe(no_mangle)]
pub extern "C" fn InterpInit() -> c_int {
    with(|interpreter, _| interpreter.init())
}

/// Opens a plan; `plan_type` is "PDDL". Returns 0, or a positive [`Code`].
///
/// # Safety
/// Both are texts that end with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn InterpOpenPlan(
    file_name: *const c_char,
    plan_type: *const c_char,
) -> c_int {
    // SAFETY: promised by the caller.
    let (file_name, plan_type) = unsafe { (text(file_name), text(plan_type)) };
    let (Some(file_name), Some(plan_type)) = (file_name, plan_type) else {
        return Code::CannotReadFile as c_int;
    };
    with(|interpreter, sink| interpreter.open_plan(file_name, plan_type, sink))
}

/// Interprets the next step. Returns 0, 1 at the end of the plan, or another positive [`Code`].
#[unsafe(no_mangle)]
pub extern "C" fn InterpExecute() -> c_int {
    with(|interpreter, sink| interpreter.execute(sink))
}

/// Writes the effects of the last step to the world database: for the controller, when all commands
/// of the step have been executed. A step whose effects are not written counts as not executed.
/// Returns 0, or a positive [`Code`].
#[unsafe(no_mangle)]
pub extern "C" fn canter_commit() -> c_int {
    let mut process = PROCESS
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let Some(process) = process.as_mut() else {
        return Code::NotInitialised as c_int;
    };
    let written = Writer::open(&process.world, Durability::Full)
        .and_then(|mut writer| writer.commit(&process.pending, None));
    match written {
        Ok(_) => {
            process.pending.clear();
            Code::Ok as c_int
        }
        Err(_) => Code::Internal as c_int,
    }
}

/// Closes the plan. Returns 0, or a positive [`Code`].
#[unsafe(no_mangle)]
pub extern "C" fn InterpClosePlan() -> c_int {
    with(|interpreter, _| interpreter.close_plan())
}

/// Stops. Returns 0, or a positive [`Code`].
#[unsafe(no_mangle)]
pub extern "C" fn InterpExit() -> c_int {
    with(|interpreter, _| interpreter.exit())
}
