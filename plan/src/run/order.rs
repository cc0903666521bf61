//! Chooses the order of lists that leave it open: the one with the shortest predicted time.

use super::factotum::Factotum;
use super::machine::{Chooser, Machine};
use super::motion::{Motion, Situation};
use super::program::{Node, Program};
use super::robot::{RobotOptions, situation};
use super::state::{Act, Frame, State};
use super::value::Value;
use crate::world::Model;

/// Most branches that are tried for one list.
const MOST_BRANCHES: usize = 600;
/// Most statements that are followed in one branch.
const MOST_STATEMENTS: usize = 2000;

/// Takes lists in their written order (or the first order that the pairs allow).
pub(crate) struct Written;

impl Chooser for Written {
    fn order(&mut self, program: &Program, _: &State, _: &Model, node: usize) -> (Vec<usize>, f64) {
        (written(program, node), 0.0)
    }
}

/// The written order, or the nearest to it that keeps all pairs; of a DoOne, the first.
pub(crate) fn written(program: &Program, node: usize) -> Vec<usize> {
    let (count, pairs) = match &program.nodes[node] {
        Node::AnyOrder(list, pairs) => (list.len(), pairs.as_slice()),
        Node::One(list) => return (0..list.len().min(1)).collect(),
        _ => return Vec::new(),
    };
    let mut order = Vec::with_capacity(count);
    while let Some(next) = ready(count, pairs, &order).into_iter().next() {
        order.push(next);
    }
    order
}

/// Members that may come next.
fn ready(count: usize, pairs: &[(usize, usize)], order: &[usize]) -> Vec<usize> {
    (0..count)
        .filter(|member| !order.contains(member))
        .filter(|member| {
            pairs
                .iter()
                .all(|(before, after)| after != member || order.contains(before))
        })
        .collect()
}

/// Simulates the possible orders and takes the one with the shortest time.
///
/// The search goes depth first with the written order as the first bound, so that the result is
/// never slower than the written order, by the same prediction; the motion that follows the list
/// counts, because it begins where the list ends. Lists inside the members are simulated in their
/// written order.
pub(crate) struct Foresight<'a> {
    pub(crate) motion: &'a mut dyn Motion,
    pub(crate) factotum: &'a dyn Factotum,
    pub(crate) options: &'a RobotOptions,
}

struct Search<'p> {
    program: &'p Program,
    /// The continuation after the list.
    rest: Vec<Frame>,
    list: &'p [usize],
    pairs: &'p [(usize, usize)],
    /// Members of an order: all, or one of a DoOne.
    length: usize,
    best: Option<(f64, Vec<usize>)>,
    branches: usize,
}

impl Chooser for Foresight<'_> {
    fn order(
        &mut self,
        program: &Program,
        state: &State,
        model: &Model,
        node: usize,
    ) -> (Vec<usize>, f64) {
        let first = written(program, node);
        let (list, pairs, length) = match &program.nodes[node] {
            Node::AnyOrder(list, pairs) => (list, pairs.as_slice(), list.len()),
            Node::One(list) => (list, [].as_slice(), list.len().min(1)),
            _ => return (first, 0.0),
        };
        if list.len() < 2 || !program.moves(node) {
            return (first, 0.0);
        }
        let mut search = Search {
            rest: {
                let mut rest = state.stack.clone();
                rest.pop();
                rest
            },
            program,
            list,
            pairs,
            length,
            best: None,
            branches: 0,
        };
        let mut at = Some((0.0, state.clone(), model.clone()));
        for member in &first {
            at = at.and_then(|(time, state, model)| {
                self.follow(program, list[*member], time, (&state, &model))
            });
        }
        // The frame of the members ends with them: the rest of the plan continues in the frame
        // below.
        let rest = search.rest.clone();
        let slowest =
            at.map(|(time, state, model)| time + self.tail(program, &rest, &state, &model));
        search.best = slowest.map(|time| (time, first.clone()));
        self.search(&mut search, &mut Vec::new(), (0.0, state, model));
        match (search.best, slowest) {
            (Some((time, order)), Some(slowest)) => (order, slowest - time),
            (Some((_, order)), None) => (order, 0.0),
            (None, _) => (first, 0.0),
        }
    }
}

impl Foresight<'_> {
    fn search(
        &mut self,
        search: &mut Search<'_>,
        order: &mut Vec<usize>,
        (time, state, model): (f64, &State, &Model),
    ) {
        if order.len() == search.length {
            let time = time + self.tail(search.program, &search.rest, state, model);
            if search
                .best
                .as_ref()
                .is_none_or(|(best, _)| time < best - 1e-9)
            {
                search.best = Some((time, order.clone()));
            }
            return;
        }
        for member in ready(search.list.len(), search.pairs, order) {
            if search.branches >= MOST_BRANCHES {
                return;
            }
            search.branches += 1;
            let node = search.list[member];
            let Some((later, state, model)) =
                self.follow(search.program, node, time, (state, model))
            else {
                continue;
            };
            if search
                .best
                .as_ref()
                .is_some_and(|(best, _)| later >= best - 1e-9)
            {
                continue;
            }
            order.push(member);
            self.search(search, order, (later, &state, &model));
            order.pop();
        }
    }

    /// Time of the next motion after the list (s): it begins where the list ended.
    fn tail(&mut self, program: &Program, rest: &[Frame], state: &State, model: &Model) -> f64 {
        let mut state = State {
            stack: rest.to_vec(),
            ..state.clone()
        };
        let mut model = model.clone();
        for _ in 0..MOST_STATEMENTS {
            let machine = Machine {
                program,
                model: &model,
                options: self.options,
            };
            let Ok(step) = machine.step(&state, &mut Written) else {
                return 0.0;
            };
            match step.act {
                Act::Nothing => {}
                Act::Motion(batch) => {
                    let Ok(start) = situation(&model) else {
                        return 0.0;
                    };
                    return self.motion.predict(&start, &batch).unwrap_or(0.0);
                }
                _ => return 0.0,
            }
            state = step.state;
            if model.apply_all(&step.changes).is_err() {
                return 0.0;
            }
        }
        0.0
    }

    /// Simulates a node; none when it fails or ends the plan.
    fn follow(
        &mut self,
        program: &Program,
        node: usize,
        time: f64,
        (state, model): (&State, &Model),
    ) -> Option<(f64, State, Model)> {
        let mut time = time;
        let mut model = model.clone();
        let mut state = State {
            stack: vec![Frame::new(node)],
            ..state.clone()
        };
        for _ in 0..MOST_STATEMENTS {
            let machine = Machine {
                program,
                model: &model,
                options: self.options,
            };
            let step = machine.step(&state, &mut Written).ok()?;
            state = step.state;
            let mut changes = step.changes;
            match step.act {
                Act::Nothing => {}
                Act::Motion(batch) => {
                    let start: Situation = situation(&model).ok()?;
                    time += self.motion.predict(&start, &batch).ok()?;
                    changes.extend(batch.changes);
                }
                Act::Errand(request) => {
                    let delivery = self
                        .factotum
                        .preview(&model, &program.plan, &request)
                        .ok()?;
                    time += delivery.seconds;
                    let value = delivery.object.map_or(Value::Null, Value::Object);
                    state.bindings.insert(request.variable, value);
                    changes.extend(delivery.changes);
                }
                // The member has ended; a Stop or Quit in it ends the whole plan.
                Act::Exhausted => {
                    state.outcome = None;
                    return Some((time, state, model));
                }
                Act::End => return None,
            }
            model.apply_all(&changes).ok()?;
        }
        None
    }
}
