//! Runs programs in URScript. Each thread of a program is a thread of the system that runs only
//! while the controller lets it: until it waits for the next cycle.

use std::collections::HashMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{JoinHandle, spawn};

use super::syntax::{Expression, Statement, What};

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Nothing,
    Number(f64),
    Truth(bool),
    Text(String),
    List(Vec<f64>),
    Thread(usize),
}

/// Why a thread of a program ends early.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Halt {
    /// The controller ends it.
    Ended,
    /// Line and what is wrong.
    Exception(usize, String),
}

/// What a thread of a program says when it lets the controller go on.
enum Report {
    Waits,
    Ended(Result<(), Halt>),
}

/// The functions that the controller offers.
pub(crate) trait Functions: Send + Sync {
    /// Calls a function; `wait` lets the next cycle come.
    fn call(
        &self,
        name: &str,
        arguments: &Arguments,
        wait: &mut dyn FnMut() -> Result<(), Halt>,
    ) -> Result<Value, Halt>;
}

/// Arguments in order and by name.
pub(crate) struct Arguments {
    pub(crate) line: usize,
    pub(crate) plain: Vec<Value>,
    pub(crate) named: HashMap<String, Value>,
}

impl Arguments {
    fn wrong(&self, expected: &str, found: Option<&Value>) -> Halt {
        Halt::Exception(self.line, format!("expected {expected}, found {found:?}"))
    }

    pub(crate) fn number(&self, place: usize) -> Result<f64, Halt> {
        match self.plain.get(place) {
            Some(Value::Number(number)) => Ok(*number),
            found => Err(self.wrong("a number", found)),
        }
    }

    pub(crate) fn named_number(&self, name: &str) -> Result<f64, Halt> {
        match self.named.get(name) {
            Some(Value::Number(number)) => Ok(*number),
            found => Err(self.wrong(name, found)),
        }
    }

    pub(crate) fn text(&self, place: usize) -> Result<&str, Halt> {
        match self.plain.get(place) {
            Some(Value::Text(text)) => Ok(text),
            found => Err(self.wrong("a text", found)),
        }
    }

    pub(crate) fn truth(&self, place: usize) -> Result<bool, Halt> {
        match self.plain.get(place) {
            Some(Value::Truth(truth)) => Ok(*truth),
            found => Err(self.wrong("True or False", found)),
        }
    }

    pub(crate) fn list(&self, place: usize) -> Result<&[f64], Halt> {
        match self.plain.get(place) {
            Some(Value::List(list)) => Ok(list),
            found => Err(self.wrong("a list", found)),
        }
    }
}

/// What all threads of a program see.
struct World {
    functions: Arc<dyn Functions>,
    /// The variables of the program.
    variables: Mutex<HashMap<String, Value>>,
    bodies: Mutex<HashMap<String, Vec<Statement>>>,
    /// Threads that were started, by number, and those that have ended.
    started: Mutex<Vec<Vec<Statement>>>,
    ended: Mutex<Vec<bool>>,
}

/// A program that runs.
pub(crate) struct Running {
    world: Arc<World>,
    threads: Vec<Option<Thread>>,
}

struct Thread {
    go: Sender<bool>,
    said: Receiver<Report>,
    handle: JoinHandle<()>,
}

impl Running {
    /// A program that will begin with the next cycle.
    pub(crate) fn new(body: Vec<Statement>, functions: Arc<dyn Functions>) -> Self {
        let world = Arc::new(World {
            functions,
            variables: Mutex::default(),
            bodies: Mutex::default(),
            started: Mutex::new(vec![body]),
            ended: Mutex::default(),
        });
        Self {
            world,
            threads: Vec::new(),
        }
    }

    /// Lets each thread run until it waits. Returns whether the program goes on.
    pub(crate) fn cycle(&mut self) -> Result<bool, Halt> {
        let mut number = 0;
        loop {
            let bodies: Vec<_> = self.world.started.lock().unwrap().drain(..).collect();
            for body in bodies {
                let number = self.threads.len();
                self.world.ended.lock().unwrap().resize(number + 1, false);
                self.threads
                    .push(Some(start(body, &self.world, number == 0)));
            }
            let Some(place) = self.threads.get_mut(number) else {
                break;
            };
            if let Some(thread) = place {
                thread.go.send(true).unwrap();
                if let Report::Ended(how) = thread.said.recv().unwrap() {
                    self.world.ended.lock().unwrap()[number] = true;
                    place.take().unwrap().handle.join().unwrap();
                    how?;
                }
            }
            number += 1;
        }
        Ok(self.threads.first().is_some_and(Option::is_some))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        for thread in self.threads.drain(..).flatten() {
            let _ = thread.go.send(false);
            let _ = thread.handle.join();
        }
    }
}

fn start(body: Vec<Statement>, world: &Arc<World>, first: bool) -> Thread {
    let (go, going) = channel();
    let (saying, said) = channel();
    let world = Arc::clone(world);
    let handle = spawn(move || {
        let mut run = Run {
            world,
            own: HashMap::new(),
            first,
            going,
            saying,
        };
        let ended = match run.going.recv() {
            Ok(true) => run.block(&body),
            _ => Err(Halt::Ended),
        };
        let _ = run.saying.send(Report::Ended(ended));
    });
    Thread { go, said, handle }
}

/// One thread of a program.
struct Run {
    world: Arc<World>,
    /// Variables of this thread alone.
    own: HashMap<String, Value>,
    /// The program's first thread: its variables are those of the program.
    first: bool,
    going: Receiver<bool>,
    saying: Sender<Report>,
}

impl Run {
    fn wait(&mut self) -> Result<(), Halt> {
        self.saying.send(Report::Waits).map_err(|_| Halt::Ended)?;
        match self.going.recv() {
            Ok(true) => Ok(()),
            _ => Err(Halt::Ended),
        }
    }

    fn block(&mut self, body: &[Statement]) -> Result<(), Halt> {
        for statement in body {
            self.statement(statement)?;
        }
        Ok(())
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), Halt> {
        let line = statement.line;
        match &statement.what {
            What::Set(name, None, value) => {
                let value = self.value(value, line)?;
                self.set(name, value);
            }
            What::Set(name, Some(place), value) => self.set_place((name, place), value, line)?,
            What::Do(value) => {
                self.value(value, line)?;
            }
            What::While(condition, body) => {
                while self.truth(condition, line)? {
                    self.block(body)?;
                }
            }
            What::If(cases, otherwise) => {
                for (condition, body) in cases {
                    if self.truth(condition, line)? {
                        return self.block(body);
                    }
                }
                self.block(otherwise)?;
            }
            What::Thread(name, body) => {
                let mut bodies = self.world.bodies.lock().unwrap();
                bodies.insert(name.clone(), body.clone());
            }
            What::Join(thread) => {
                let Value::Thread(number) = self.value(thread, line)? else {
                    return Err(Halt::Exception(line, "join needs a thread".into()));
                };
                while !self.world.ended.lock().unwrap()[number] {
                    self.wait()?;
                }
            }
            What::Critical => {}
        }
        Ok(())
    }

    /// A variable of the program is set there; any other belongs to this thread.
    fn set(&mut self, name: &str, value: Value) {
        let mut variables = self.world.variables.lock().unwrap();
        if self.first || variables.contains_key(name) {
            variables.insert(name.to_owned(), value);
        } else {
            self.own.insert(name.to_owned(), value);
        }
    }

    fn set_place(
        &mut self,
        (name, place): (&str, &Expression),
        value: &Expression,
        line: usize,
    ) -> Result<(), Halt> {
        let wrong = |what: &str| Halt::Exception(line, what.to_owned());
        let Value::Number(value) = self.value(value, line)? else {
            return Err(wrong("only numbers are put into lists"));
        };
        let Value::Number(place) = self.value(place, line)? else {
            return Err(wrong("a place is a number"));
        };
        let Value::List(mut list) = self.variable(name, line)? else {
            return Err(wrong("no list"));
        };
        let slot = list.get_mut(place as usize);
        *slot.ok_or_else(|| wrong("no such place"))? = value;
        self.set(name, Value::List(list));
        Ok(())
    }

    fn variable(&self, name: &str, line: usize) -> Result<Value, Halt> {
        let variables = self.world.variables.lock().unwrap();
        let found = self.own.get(name).or_else(|| variables.get(name));
        let found = found.cloned();
        found.ok_or_else(|| Halt::Exception(line, format!("no variable {name}")))
    }

    fn truth(&mut self, condition: &Expression, line: usize) -> Result<bool, Halt> {
        match self.value(condition, line)? {
            Value::Truth(truth) => Ok(truth),
            other => Err(Halt::Exception(line, format!("{other:?} is no truth"))),
        }
    }

    fn value(&mut self, expression: &Expression, line: usize) -> Result<Value, Halt> {
        let wrong = |what: String| Halt::Exception(line, what);
        Ok(match expression {
            Expression::Number(number) => Value::Number(*number),
            Expression::Truth(truth) => Value::Truth(*truth),
            Expression::Text(text) => Value::Text(text.clone()),
            Expression::Name(name) => self.variable(name, line)?,
            Expression::List(values) => {
                let mut list = Vec::new();
                for value in values {
                    match self.value(value, line)? {
                        Value::Number(number) => list.push(number),
                        other => return Err(wrong(format!("{other:?} in a list"))),
                    }
                }
                Value::List(list)
            }
            Expression::Index(list, place) => {
                let (list, place) = (self.value(list, line)?, self.value(place, line)?);
                match (&list, &place) {
                    (Value::List(list), Value::Number(place)) => {
                        let found = list.get(*place as usize);
                        Value::Number(*found.ok_or_else(|| wrong("no such place".into()))?)
                    }
                    _ => return Err(wrong(format!("{list:?} at {place:?}"))),
                }
            }
            Expression::Run(name) => self.run(name, line)?,
            Expression::Not(inner) => Value::Truth(!self.truth(inner, line)?),
            Expression::Minus(inner) => match self.value(inner, line)? {
                Value::Number(number) => Value::Number(-number),
                other => return Err(wrong(format!("minus {other:?}"))),
            },
            Expression::Pair(sign, left, right) => self.pair(sign, (left, right), line)?,
            Expression::Call(name, plain, named) => self.call(name, (plain, named), line)?,
        })
    }

    fn run(&mut self, name: &str, line: usize) -> Result<Value, Halt> {
        let body = self.world.bodies.lock().unwrap().get(name).cloned();
        let body = body.ok_or_else(|| Halt::Exception(line, format!("no thread {name}")))?;
        let mut started = self.world.started.lock().unwrap();
        started.push(body);
        let mut ended = self.world.ended.lock().unwrap();
        let number = ended.len();
        ended.push(false);
        Ok(Value::Thread(number))
    }

    fn pair(
        &mut self,
        sign: &str,
        (left, right): (&Expression, &Expression),
        line: usize,
    ) -> Result<Value, Halt> {
        let left = self.value(left, line)?;
        match (sign, &left) {
            ("and", Value::Truth(false)) | ("or", Value::Truth(true)) => return Ok(left),
            ("and" | "or", Value::Truth(_)) => return self.truth(right, line).map(Value::Truth),
            _ => {}
        }
        let right = self.value(right, line)?;
        let (Value::Number(a), Value::Number(b)) = (&left, &right) else {
            return match sign {
                "==" => Ok(Value::Truth(left == right)),
                "!=" => Ok(Value::Truth(left != right)),
                _ => Err(Halt::Exception(line, format!("{left:?} {sign} {right:?}"))),
            };
        };
        Ok(match sign {
            "+" => Value::Number(a + b),
            "-" => Value::Number(a - b),
            "*" => Value::Number(a * b),
            "/" => Value::Number(a / b),
            "<" => Value::Truth(a < b),
            ">" => Value::Truth(a > b),
            "<=" => Value::Truth(a <= b),
            ">=" => Value::Truth(a >= b),
            "==" => Value::Truth(a == b),
            "!=" => Value::Truth(a != b),
            other => return Err(Halt::Exception(line, format!("{other} is unknown"))),
        })
    }

    fn call(
        &mut self,
        name: &str,
        (plain, named): (&[Expression], &[(String, Expression)]),
        line: usize,
    ) -> Result<Value, Halt> {
        let mut arguments = Arguments {
            line,
            plain: Vec::new(),
            named: HashMap::new(),
        };
        for value in plain {
            arguments.plain.push(self.value(value, line)?);
        }
        for (key, value) in named {
            let value = self.value(value, line)?;
            arguments.named.insert(key.clone(), value);
        }
        let functions = Arc::clone(&self.world.functions);
        functions.call(name, &arguments, &mut || self.wait())
    }
}
