//! A motion from rest to rest, as spans with their origin.

use super::method::Method;
use super::rest::{Rest, RestCause};
use super::span::{Span, reversed};

/// A certified motion, or a part of one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motion {
    pub(crate) spans: Vec<Span>,
    /// How each part was made, and how many spans it has.
    pub(crate) parts: Vec<(Method, usize)>,
    /// The rests inside, in the order of time.
    pub(crate) rests: Vec<Rest>,
    /// Whether a part is slower than its way of planning usually is: another way may be faster.
    pub(crate) eased: bool,
    /// Whether a part was found only at a further attempt, with smaller balls or more knots: within less of the
    /// tolerance there may be a faster motion.
    pub(crate) retried: bool,
}

impl Motion {
    /// A motion that was made in one way and rests nowhere inside.
    pub(crate) fn new(spans: Vec<Span>, method: Method) -> Self {
        let parts = if spans.is_empty() {
            Vec::new()
        } else {
            vec![(method, spans.len())]
        };
        Self {
            spans,
            parts,
            rests: Vec::new(),
            eased: false,
            retried: false,
        }
    }

    /// Straight legs with a stop at the end of each.
    pub(crate) fn stops(spans: Vec<Span>) -> Self {
        let starts = spans.iter().skip(1).filter(|span| span.starts_at_rest());
        let rests = starts.map(|span| Rest::new(span.start, RestCause::Stop));
        Self {
            rests: rests.collect(),
            ..Self::new(spans, Method::ExactStop)
        }
    }

    /// Time of the motion, s.
    pub(crate) fn duration(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end)
    }

    /// The same way from its end to its start.
    pub(crate) fn reversed(&self) -> Self {
        let total = self.duration();
        let rests = self.rests.iter().rev().map(|rest| Rest {
            time: total - rest.time,
            ..*rest
        });
        Self {
            spans: reversed(&self.spans),
            parts: self.parts.iter().rev().copied().collect(),
            rests: rests.collect(),
            eased: self.eased,
            retried: self.retried,
        }
    }

    /// Adds a motion that goes on where this one is at its end, without a rest.
    pub(crate) fn join(&mut self, other: Motion) {
        let offset = self.duration();
        self.spans.extend(other.spans.into_iter().map(|mut span| {
            span.start += offset;
            span
        }));
        self.rests.extend(other.rests.into_iter().map(|mut rest| {
            rest.time += offset;
            rest
        }));
        self.parts.extend(other.parts);
        self.eased |= other.eased;
        self.retried |= other.retried;
    }

    /// Adds a motion that starts at rest where this one ends at rest.
    pub(crate) fn append(&mut self, other: Motion, cause: RestCause) {
        if !other.spans.is_empty() {
            self.rest(cause);
        }
        self.join(other);
    }

    /// Records that the motion, which goes on, rests at its present end.
    pub(crate) fn rest(&mut self, cause: RestCause) {
        if !self.spans.is_empty() {
            self.rests.push(Rest::new(self.duration(), cause));
        }
    }
}
