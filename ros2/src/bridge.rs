//! The loop between ROS and the engine. It waits for neither.

use std::sync::mpsc::{Receiver, Sender};
use std::time::{Duration, Instant};

use ros2_client::RmwRequestId;
use ros2_client::log::LogLevel;

use crate::arm::ArmReader;
use crate::endpoints::Endpoints;
use crate::engine::{Heard, Order, Task};
use crate::goals::Goals;
use crate::messages::TriggerResponse;
use crate::notes::{Fate, words};
use crate::stopper::Stopped;

/// Time between two messages of the joints.
const STATES: Duration = Duration::from_millis(10);

/// How often the bridge looks for anything.
const LOOK: Duration = Duration::from_millis(2);

/// How long it may remain unknown whether it was this program that the engine dropped.
const DOUBT: Duration = Duration::from_secs(1);

/// The threads that the bridge asks, and what they tell.
pub(crate) struct Threads {
    /// To the engine.
    pub(crate) orders: Sender<Order>,
    /// From the engine.
    pub(crate) heard: Receiver<Heard>,
    /// To the thread that stops.
    pub(crate) stops: Sender<u64>,
    /// From the thread that stops.
    pub(crate) stopped: Receiver<Stopped>,
}

/// A program that ROS may start.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    /// Name of its service.
    pub(crate) name: String,
    /// `text`, `json` or `xml`.
    pub(crate) format: &'static str,
    /// The program.
    pub(crate) text: String,
}

/// A program that is executed.
struct Running {
    program: usize,
    request: RmwRequestId,
    serial: u64,
    /// Numbers of its first and last command.
    commands: Option<(u64, u64)>,
    /// Whether a note was about one of them.
    begun: bool,
    /// When something was dropped before that, and why: perhaps not these.
    dropped: Option<(Instant, String)>,
}

/// Serves ROS.
pub(crate) struct Bridge {
    pub(crate) ends: Endpoints,
    pub(crate) arm: ArmReader,
    pub(crate) threads: Threads,
    pub(crate) goals: Goals,
    /// Whether the time law is the engine's.
    pub(crate) retime: bool,
    /// Whether feedback has the number of the point.
    pub(crate) indexed: bool,
    pub(crate) told: Instant,
    programs: Vec<Program>,
    running: Option<Running>,
    /// Requests to stop that wait, with the number of the stop.
    stops: Vec<(u64, RmwRequestId)>,
    serial: u64,
    published: Instant,
    lost: bool,
}

/// What a bridge does for its options.
pub(crate) struct Choices {
    pub(crate) retime: bool,
    pub(crate) indexed: bool,
    pub(crate) programs: Vec<Program>,
}

impl Bridge {
    /// A bridge between these ends.
    pub(crate) fn new(ends: Endpoints, arm: ArmReader, threads: Threads, choices: Choices) -> Self {
        let Choices {
            retime,
            indexed,
            programs,
        } = choices;
        Self {
            ends,
            arm,
            threads,
            goals: Goals::default(),
            retime,
            indexed,
            told: Instant::now(),
            programs,
            running: None,
            stops: Vec::new(),
            serial: 0,
            published: Instant::now(),
            lost: false,
        }
    }

    /// Serves until `ends` is true; stops a goal that is under way.
    pub(crate) fn run(&mut self, over: impl Fn() -> bool) {
        while !over() {
            self.turn();
            std::thread::sleep(LOOK);
        }
        if self.goals.active.is_some() {
            // Nobody is left whom the answer could reach.
            let _ = self.threads.stops.send(0);
            let _ = self.threads.stopped.recv_timeout(Duration::from_secs(10));
        }
    }

    /// Everything once.
    fn turn(&mut self) {
        self.arm.look();
        self.read_goals();
        self.read_cancels();
        self.read_results();
        self.read_stops();
        self.read_programs();
        while let Ok(heard) = self.threads.heard.try_recv() {
            self.hear(heard);
        }
        while let Ok(stopped) = self.threads.stopped.try_recv() {
            self.stopped(&stopped);
        }
        self.watch();
        self.watch_program();
        if self.published.elapsed() >= STATES {
            // By the clock, so that the rate holds in the mean.
            self.published += STATES;
            if self.published.elapsed() > STATES * 10 {
                self.published = Instant::now();
            }
            if let Some(message) = self.arm.message() {
                // A reader that is too slow loses messages.
                let _ = self.ends.states.publish(message);
            }
        }
    }

    /// A number that no other task or stop has.
    pub(crate) fn next_serial(&mut self) -> u64 {
        self.serial += 1;
        self.serial
    }

    /// Whether something is executed for ROS.
    fn is_busy(&self) -> bool {
        self.goals.active.is_some() || self.running.is_some()
    }

    /// Why the arm takes nothing new now; nothing where it does.
    pub(crate) fn busy(&self) -> Option<&'static str> {
        let why = if self.arm.is_held() {
            "a pause or stop holds the arm in the middle of a motion; canter resume goes on with it"
        } else {
            "the arm is executing something else"
        };
        self.is_busy().then_some(why)
    }

    fn read_stops(&mut self) {
        while let Ok(Some((request, _))) = self.ends.stop.receive_request() {
            let serial = self.next_serial();
            self.stops.push((serial, request));
            if let Some(active) = &mut self.goals.active {
                active.doomed = true;
            }
            // The thread lives as long as the bridge.
            let _ = self.threads.stops.send(serial);
        }
    }

    fn read_programs(&mut self) {
        for program in 0..self.programs.len() {
            while let Ok(Some((request, _))) = self.ends.programs[program].receive_request() {
                if let Some(said) = self.busy() {
                    self.answer(program, request, (false, said));
                    continue;
                }
                let serial = self.next_serial();
                let Program { name, format, text } = self.programs[program].clone();
                let task = Task::Program { format, name, text };
                let _ = self.threads.orders.send(Order { serial, task });
                self.running = Some(Running {
                    program,
                    request,
                    serial,
                    commands: None,
                    begun: false,
                    dropped: None,
                });
            }
        }
    }

    /// Answers who asked for a program.
    fn answer(&self, program: usize, request: RmwRequestId, (success, said): (bool, &str)) {
        let response = TriggerResponse {
            success,
            message: said.to_owned(),
        };
        if let Err(error) = self.ends.programs[program].send_response(request, response) {
            self.ends
                .say(LogLevel::Warn, &format!("an answer was not sent: {error}"));
        }
    }

    fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Taken { serial, commands } => {
                self.lost = false;
                if let Some(running) = self.running.as_mut().filter(|r| r.serial == serial) {
                    running.commands = Some(commands);
                }
                self.goal_taken(serial, commands.0);
            }
            Heard::Refused { serial, why } => {
                self.goal_refused(|active| active.serial == serial, &why);
                if self
                    .running
                    .as_ref()
                    .is_some_and(|running| running.serial == serial)
                {
                    self.end_program(false, &why);
                }
            }
            Heard::Note(note) => {
                self.lost = false;
                let (level, text) = words(&note);
                self.ends.say(level, &text);
                let fate = Fate::of(&note);
                self.program_fate(&fate);
                self.goal_fate(fate);
            }
            Heard::Lost(why) => {
                let why = format!("the engine does not answer: {why}");
                if !self.lost {
                    self.ends.say(LogLevel::Error, &why);
                }
                self.lost = true;
                self.program_fate(&Fate::Dropped(why.clone()));
                self.goal_fate(Fate::Dropped(why));
            }
        }
    }

    fn program_fate(&mut self, fate: &Fate) {
        let Some(running) = &mut self.running else {
            return;
        };
        let (first, last) = running.commands.unwrap_or((u64::MAX, 0));
        let ours = |id: &u64| (first..=last).contains(id);
        running.begun |= match fate {
            Fate::Started(id) | Fate::Done(id) | Fate::Refused(id, _) => ours(id),
            Fate::Dropped(_) | Fate::Other => false,
        };
        match fate {
            Fate::Done(id) if *id == last => self.end_program(true, "done"),
            Fate::Refused(id, why) if ours(id) => self.end_program(false, why),
            Fate::Dropped(why) if running.begun => self.end_program(false, why),
            Fate::Dropped(why) => running.dropped = Some((Instant::now(), why.clone())),
            _ => {}
        }
    }

    /// Ends a program that was dropped before it began.
    fn watch_program(&mut self) {
        let Some(running) = self.running.as_ref().filter(|running| !running.begun) else {
            return;
        };
        let dropped = running.dropped.clone();
        if let Some((_, why)) = dropped.filter(|(at, _)| at.elapsed() > DOUBT) {
            self.end_program(false, &why);
        }
    }

    fn end_program(&mut self, success: bool, said: &str) {
        if let Some(running) = self.running.take() {
            self.answer(running.program, running.request, (success, said));
        }
    }

    fn stopped(&mut self, stopped: &Stopped) {
        let said = match &stopped.result {
            Ok(()) => "the arm rests".to_owned(),
            Err(why) => why.clone(),
        };
        self.stops.retain(|(serial, request)| {
            if *serial != stopped.serial {
                return true;
            }
            let response = TriggerResponse {
                success: stopped.result.is_ok(),
                message: said.clone(),
            };
            if let Err(error) = self.ends.stop.send_response(*request, response) {
                self.ends
                    .say(LogLevel::Warn, &format!("an answer was not sent: {error}"));
            }
            false
        });
        self.goal_stopped(stopped);
    }
}
