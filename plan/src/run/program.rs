//! A plan as numbered nodes, so that a place in it is a number.

use crate::kitting::ast::{Action, Expression, Plan, Span, Statement};
use crate::kitting::effects::{conflicts, steps};
use crate::kitting::types::Scope;

/// A node of the program.
#[derive(Clone, Debug)]
pub(crate) enum Node {
    /// A statement without others in it.
    Leaf(Action, Span),
    /// All in order.
    Sequence(Vec<usize>),
    /// All in any order that keeps the pairs (earlier, later), both positions in the list.
    AnyOrder(Vec<usize>, Vec<(usize, usize)>),
    /// One of them.
    One(Vec<usize>),
    /// The first whose test is true; no test is true.
    Choice(Vec<(Option<Expression>, usize)>),
    /// As long as the test is true.
    Loop(Expression, usize),
}

/// A plan as nodes; the last is the whole plan.
#[derive(Clone, Debug)]
pub struct Program {
    /// The plan.
    pub plan: Plan,
    pub(crate) scope: Scope,
    pub(crate) nodes: Vec<Node>,
}

impl Program {
    /// Lowers a plan.
    #[must_use]
    pub fn new(plan: Plan) -> Self {
        let scope = Scope::new(&plan);
        let mut program = Self {
            plan: Plan::default(),
            scope,
            nodes: Vec::new(),
        };
        let members = program.members(&plan.todo);
        program.add(Node::Sequence(members));
        program.plan = plan;
        program
    }

    /// Number of the node that is the whole plan.
    pub(crate) fn root(&self) -> usize {
        self.nodes.len() - 1
    }

    fn add(&mut self, node: Node) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// One node for each step of a list; an If with its ElseIf and Else is one step.
    fn members(&mut self, list: &[Statement]) -> Vec<usize> {
        steps(list)
            .into_iter()
            .map(|range| self.step(&list[range]))
            .collect()
    }

    fn step(&mut self, chain: &[Statement]) -> usize {
        let mut choices = Vec::new();
        for statement in chain {
            match &statement.action {
                Action::If { test, then } | Action::ElseIf { test, then } => {
                    choices.push((Some(test.clone()), self.step(std::slice::from_ref(then))));
                }
                Action::Else { then } => {
                    choices.push((None, self.step(std::slice::from_ref(then))))
                }
                _ => return self.statement(statement),
            }
        }
        self.add(Node::Choice(choices))
    }

    fn statement(&mut self, statement: &Statement) -> usize {
        let node = match &statement.action {
            Action::DoInGivenOrder(list) => Node::Sequence(self.members(list)),
            Action::DoInAnyOrder(list) => self.any_order(list),
            Action::DoOne(list) => Node::One(self.members(list)),
            Action::DoInPreconditionOrder(triples) => {
                let members = triples
                    .iter()
                    .map(|triple| self.step(std::slice::from_ref(&triple.statement)))
                    .collect();
                let position = |index| triples.iter().position(|t| t.index == index);
                let pairs = triples.iter().enumerate().flat_map(|(later, triple)| {
                    triple
                        .before
                        .iter()
                        .filter_map(move |b| Some((position(*b)?, later)))
                });
                Node::AnyOrder(members, pairs.collect())
            }
            Action::LoopInGivenOrderWhile { test, body } => {
                let members = self.members(body);
                let body = self.add(Node::Sequence(members));
                Node::Loop(test.clone(), body)
            }
            Action::LoopInAnyOrderWhile { test, body } => {
                let node = self.any_order(body);
                let body = self.add(node);
                Node::Loop(test.clone(), body)
            }
            leaf => Node::Leaf(leaf.clone(), statement.span),
        };
        self.add(node)
    }

    fn any_order(&mut self, list: &[Statement]) -> Node {
        let members = self.members(list);
        let pairs = conflicts(list, &self.scope)
            .into_iter()
            .map(|(a, b, _)| (a, b))
            .collect();
        Node::AnyOrder(members, pairs)
    }

    /// Whether the node moves the robot.
    pub(crate) fn moves(&self, node: usize) -> bool {
        match &self.nodes[node] {
            Node::Leaf(action, _) => matches!(
                action,
                Action::RobotChangeEndEffector { .. }
                    | Action::RobotMoveAbove { .. }
                    | Action::RobotPickUp { .. }
                    | Action::RobotPutDown { .. }
            ),
            Node::Sequence(list) | Node::AnyOrder(list, _) | Node::One(list) => {
                list.iter().any(|member| self.moves(*member))
            }
            Node::Choice(list) => list.iter().any(|(_, member)| self.moves(*member)),
            Node::Loop(_, body) => self.moves(*body),
        }
    }
}
