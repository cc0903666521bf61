//! A list of poses after the pose that a move starts in, which may be kept elsewhere.

use std::ops::Range;

use nalgebra::Isometry3;

use crate::ToolLimits;
use crate::smooth::exact_stop;
use crate::smooth::options::{SmoothError, SmoothOptions};

/// The poses of a list. Nothing is copied: a list may be long.
#[derive(Clone, Copy, Debug)]
pub(super) struct List<'a> {
    start: &'a Isometry3<f64>,
    others: &'a [Isometry3<f64>],
}

impl<'a> List<'a> {
    /// A start and the poses after it.
    pub(super) fn new(start: &'a Isometry3<f64>, others: &'a [Isometry3<f64>]) -> Self {
        Self { start, others }
    }

    /// A list that begins with its start; it is not empty.
    pub(super) fn of(poses: &'a [Isometry3<f64>]) -> Self {
        Self::new(&poses[0], &poses[1..])
    }

    pub(super) fn len(&self) -> usize {
        self.others.len() + 1
    }

    pub(super) fn at(&self, index: usize) -> &'a Isometry3<f64> {
        match index.checked_sub(1) {
            Some(index) => &self.others[index],
            None => self.start,
        }
    }

    pub(super) fn last(&self) -> &'a Isometry3<f64> {
        self.others.last().unwrap_or(self.start)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &'a Isometry3<f64>> {
        std::iter::once(self.start).chain(self.others)
    }

    /// Both ends of each leg.
    pub(super) fn legs(&self) -> impl Iterator<Item = [&'a Isometry3<f64>; 2]> {
        self.iter().zip(self.others).map(|(from, to)| [from, to])
    }

    /// Checks poses and options.
    pub(super) fn check(&self, options: &SmoothOptions) -> Result<(), SmoothError> {
        options.check(std::slice::from_ref(self.start))?;
        options.check(if self.others.is_empty() {
            std::slice::from_ref(self.start)
        } else {
            self.others
        })
    }

    /// Time with a stop at each pose, s.
    pub(super) fn exact_stop(&self, limits: &ToolLimits) -> f64 {
        let first = self.others.first().unwrap_or(self.start);
        exact_stop::duration(&[*self.start, *first], limits)
            + exact_stop::duration(self.others, limits)
    }

    /// A copy of a part.
    pub(super) fn part(&self, range: Range<usize>) -> Vec<Isometry3<f64>> {
        range.map(|i| *self.at(i)).collect()
    }
}
