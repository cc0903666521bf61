//! What a page asks for.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use ipc::{ControlAsk, Verb};
use planner::robot::Robot;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::freshness::Freshness;
use crate::hand::HandPost;
use crate::live::EngineHandle;
use crate::player::Player;
use crate::preview::{Detail, Draft, preview};
use crate::{Access, PoseList, lists, mesh};

/// How long a jog goes on when the page falls silent.
const JOG: Duration = Duration::from_millis(200);

/// How long a step may take: it ends by itself.
const STEP: Duration = Duration::from_secs(2);

/// The longest step: of the tool in m, of a joint in rad or m.
const LONGEST_STEP: f64 = 1.0;

/// How old a request to jog may be (ms).
const OLDEST_JOG_MS: f64 = 150.0;

/// The longest program that is planned for a page (bytes).
const LONGEST: usize = 4 << 20;

/// What a page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Wish {
    /// The hand.
    Take,
    /// Lets the hand go.
    Release,
    /// Moves by hand, for a moment.
    Jog {
        space: String,
        speeds: Vec<f64>,
        /// When it was sent, by the page's clock (ms).
        sent_ms: f64,
        /// Where a jog in space `goal` ends.
        #[serde(default)]
        goal: Vec<f64>,
    },
    /// Moves by hand, as far as this.
    Step {
        space: String,
        speeds: Vec<f64>,
        sent_ms: f64,
        distance: f64,
    },
    /// Executes commands one by one, or all again.
    SingleStep {
        on: bool,
    },
    /// Lets the next command begin.
    Next,
    /// Stops on the path: everybody may.
    Stop {
        fast: bool,
    },
    Pause,
    Resume,
    Override {
        share: f64,
    },
    Abort,
    Recover,
    /// Executes a program.
    Run {
        name: String,
        program: String,
    },
    /// Plans a program.
    Plan {
        name: String,
        form: String,
        program: String,
        start: Option<Vec<f64>>,
    },
    /// Shows a list of poses.
    List {
        index: usize,
    },
    /// Goes to a time of a recording.
    Seek {
        at: f64,
    },
    /// Plays a recording or stands.
    Play {
        plays: bool,
        speed: f64,
    },
}

/// A wish with its number, which the answer has as well.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Numbered {
    number: u64,
    #[serde(flatten)]
    wish: Wish,
}

/// Who fulfils wishes: what is shown, with what can be done there.
#[derive(Debug)]
pub(crate) struct Service {
    pub(crate) engine: Option<EngineHandle>,
    pub(crate) player: Option<Player>,
    pub(crate) hand: HandPost,
    /// The robot, for plans; none while no engine is there.
    pub(crate) robot: Arc<Mutex<Option<Robot>>>,
    pub(crate) planning: Arc<AtomicBool>,
    /// The lists of poses that are looked at.
    pub(crate) lists: Vec<PoseList>,
}

/// Who wishes.
#[derive(Debug)]
pub(crate) struct Wisher {
    pub(crate) page: u64,
    pub(crate) access: Access,
    /// The way back for what takes time.
    pub(crate) later: Sender<String>,
    /// How old what it sends is.
    pub(crate) freshness: Freshness,
}

impl Wisher {
    /// Refuses what was sent long ago, or at no time.
    fn check_fresh(&self, sent_ms: f64) -> Result<(), String> {
        let age = self.freshness.age_ms(sent_ms);
        if age <= OLDEST_JOG_MS {
            return Ok(());
        }
        Err(format!(
            "this request is {age:.0} ms old: the link stood still"
        ))
    }
}

impl Wish {
    /// Whether it moves the arm or changes how it moves.
    fn needs_hand(&self) -> bool {
        matches!(
            self,
            Self::Jog { .. }
                | Self::Step { .. }
                | Self::SingleStep { .. }
                | Self::Next
                | Self::Resume
                | Self::Override { .. }
                | Self::Recover
                | Self::Run { .. }
                | Self::Abort
        )
    }
}

impl Service {
    /// Fulfils a wish of a page; gives the answer.
    pub(crate) fn fulfil(&self, wisher: &Wisher, text: &str) -> Value {
        let numbered: Numbered = match serde_json::from_str(text) {
            Ok(numbered) => numbered,
            Err(cause) => {
                return json!({"is": "answer", "number": 0, "ok": false,
                    "message": format!("cannot read the request: {cause}")});
            }
        };
        let number = numbered.number;
        match self.answer(wisher, numbered) {
            Ok(()) => json!({"is": "answer", "number": number, "ok": true}),
            Err(message) => {
                json!({"is": "answer", "number": number, "ok": false, "message": message})
            }
        }
    }

    fn answer(&self, wisher: &Wisher, Numbered { number, wish }: Numbered) -> Result<(), String> {
        if wish.needs_hand() {
            if wisher.access != Access::Hand {
                return Err("this address only watches".to_owned());
            }
            if !self.hand.has(wisher.page) {
                return Err("take the hand first: one page moves the arm at a time".to_owned());
            }
        }
        match wish {
            Wish::Take => self.take(wisher),
            Wish::Release => {
                self.release(wisher.page);
                Ok(())
            }
            Wish::Plan {
                name,
                form,
                program,
                start,
            } => {
                let draft = Draft {
                    name,
                    form,
                    text: program,
                    start,
                    default_length: "mm".to_owned(),
                    rate_hz: 1000.0,
                    detail: self.detail(),
                };
                self.plan(wisher, number, draft)
            }
            Wish::List { index } => {
                let drawn = lists::drawn(&self.lists, index)?;
                // A page that has gone needs no list.
                let _ = wisher.later.send(drawn.to_string());
                Ok(())
            }
            Wish::Seek { at } => self.player()?.seek_checked(at),
            Wish::Play { plays, speed } => {
                self.player()?.play(plays, speed);
                Ok(())
            }
            jog @ (Wish::Jog { .. } | Wish::Step { .. }) => self.jog(wisher, jog),
            other => self.pass_on(other),
        }
    }

    /// Jogs, or goes one step.
    fn jog(&self, wisher: &Wisher, wish: Wish) -> Result<(), String> {
        match wish {
            Wish::Jog {
                space,
                speeds,
                sent_ms,
                goal,
            } => {
                // Rest is never too old.
                if speeds.iter().any(|speed| *speed != 0.0) {
                    wisher.check_fresh(sent_ms)?;
                }
                self.engine()?.ask(Verb::Jog {
                    space,
                    speeds,
                    timeout_ms: JOG.as_millis() as u64,
                    distance: None,
                    goal,
                })
            }
            Wish::Step {
                space,
                speeds,
                sent_ms,
                distance,
            } => {
                wisher.check_fresh(sent_ms)?;
                if !(0.0..=LONGEST_STEP).contains(&distance) {
                    return Err(format!(
                        "a step is at most {LONGEST_STEP} (m, rad), got {distance}"
                    ));
                }
                self.engine()?.ask(Verb::Jog {
                    space,
                    speeds,
                    timeout_ms: STEP.as_millis() as u64,
                    distance: Some(distance),
                    goal: Vec::new(),
                })
            }
            other => self.pass_on(other),
        }
    }

    /// What pages get of a plan: where nothing runs, what the plots need as well.
    fn detail(&self) -> Detail {
        if self.engine.is_none() && self.player.is_none() {
            Detail::Plots
        } else {
            Detail::Picture
        }
    }

    fn engine(&self) -> Result<&EngineHandle, String> {
        let engine = self.engine.as_ref();
        engine.ok_or_else(|| "nothing moves here: it is no running arm".to_owned())
    }

    /// A mesh of the robot that a page asks for.
    pub(crate) fn mesh(&self, path: &str) -> Option<Vec<u8>> {
        let robot = self.robot.lock().ok()?.clone()?;
        mesh::read(&robot, path)
    }

    /// Passes on what is for the engine.
    fn pass_on(&self, wish: Wish) -> Result<(), String> {
        let engine = self.engine()?;
        match wish {
            Wish::Stop { fast } => engine.control(ControlAsk::Stop { fast }),
            Wish::Pause => engine.control(ControlAsk::Pause),
            Wish::Resume => engine.control(ControlAsk::Resume),
            Wish::Override { share } => {
                if !(0.0..=1.0).contains(&share) {
                    return Err(format!("an override is 0 to 1, got {share}"));
                }
                engine.control(ControlAsk::Override(share))
            }
            Wish::Abort => engine.control(ControlAsk::Abort),
            Wish::Recover => engine.control(ControlAsk::Recover),
            Wish::SingleStep { on } => engine.ask(Verb::SingleStep { on }),
            Wish::Next => engine.ask(Verb::Next),
            Wish::Run { name, program } => {
                let json = program.trim_start().starts_with(['{', '[']);
                let verb = Verb::Submit {
                    format: if json { "json" } else { "text" }.to_owned(),
                    name,
                    program,
                };
                engine.ask(verb)
            }
            _ => Ok(()),
        }
    }

    fn player(&self) -> Result<&Player, String> {
        let player = self.player.as_ref();
        player.ok_or_else(|| "this is no recording".to_owned())
    }

    fn take(&self, wisher: &Wisher) -> Result<(), String> {
        if wisher.access != Access::Hand {
            return Err("this address only watches".to_owned());
        }
        if self.hand.take(wisher.page) {
            Ok(())
        } else {
            Err("another page has the hand; it must let go first".to_owned())
        }
    }

    /// Takes the hand from a page that lets go or has gone. A jog that was under way ends now, and
    /// not only when its time is over.
    pub(crate) fn release(&self, page: u64) {
        if self.hand.release(page)
            && let Some(engine) = &self.engine
        {
            let verb = Verb::Jog {
                space: "tool".to_owned(),
                speeds: vec![0.0; 6],
                timeout_ms: 50,
                distance: None,
                goal: Vec::new(),
            };
            // Without an engine there is no jog.
            let _ = engine.ask(verb);
        }
    }

    fn plan(&self, wisher: &Wisher, number: u64, draft: Draft) -> Result<(), String> {
        if draft.text.len() > LONGEST {
            return Err(format!(
                "a program of at most {LONGEST} bytes is planned here"
            ));
        }
        let robot = self.robot.lock().ok().and_then(|robot| robot.clone());
        let robot = robot.ok_or("no robot is known yet")?;
        if self.planning.swap(true, Ordering::AcqRel) {
            return Err("another program is being planned; try again".to_owned());
        }
        let (later, planning) = (wisher.later.clone(), Arc::clone(&self.planning));
        let spawned = std::thread::Builder::new()
            .name("view plan".to_owned())
            .stack_size(16 << 20)
            .spawn(move || {
                let mut planned = preview(&robot, &draft);
                planned["number"] = json!(number);
                // A page that has gone needs no plan.
                let _ = later.send(planned.to_string());
                planning.store(false, Ordering::Release);
            });
        spawned.map(|_| ()).map_err(|cause| {
            self.planning.store(false, Ordering::Release);
            cause.to_string()
        })
    }
}

impl Player {
    fn seek_checked(&self, at_s: f64) -> Result<(), String> {
        if !at_s.is_finite() {
            return Err("a time is a number".to_owned());
        }
        self.seek(at_s);
        Ok(())
    }
}
