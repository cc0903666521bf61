//! About where a fit passes each pose of a long list, in four bytes for each.
//!
//! A list is read in sections, each with the poses around it that count: a section of a fit, or of the
//! time along it, depends only on what is near. So what is needed on the way does not grow with the list.

use std::ops::Range;

use nalgebra::Isometry3;

use super::leg;
use super::list::List;
use crate::smooth::options::SmoothOptions;

/// Legs of a section, at least.
const SECTION: usize = 8192;
/// Poses around a section, at least; the way over them takes the time of braking, at least.
const AROUND: usize = 256;

/// The parameter of a fit at each pose: a whole number of knot intervals from the first to the last.
#[derive(Clone, Debug)]
pub(super) struct Marks {
    sections: Vec<Section>,
    /// Way from the start of its section to each pose but the last, in units of the section.
    ways: Vec<u32>,
    scale: f64,
    spans: usize,
}

#[derive(Clone, Copy, Debug)]
struct Section {
    /// Its first pose.
    first: usize,
    /// Parameter there, before all are scaled to a whole number.
    start: f64,
    unit: f64,
}

impl Marks {
    /// From the parameters of each section: `of` has the poses of one, with those around it, and which legs of
    /// them are its own.
    pub(super) fn new<E>(
        list: &List<'_>,
        options: &SmoothOptions,
        mut of: impl FnMut(&[Isometry3<f64>], Range<usize>) -> Result<Vec<f64>, E>,
    ) -> Result<Self, E> {
        let last = list.len() - 1;
        let count = (last / SECTION).max(1);
        let edge = |k: usize| k * last / count;
        let (mut sections, mut start) = (Vec::with_capacity(count), 0.0);
        let mut ways = Vec::with_capacity(last);
        for k in 0..count {
            let (first, end) = (edge(k), edge(k + 1));
            let back = (0..first).rev().map(|i| [i, i + 1]);
            let on = (end..last).map(|i| [i, i + 1]);
            let from = first - around(list, options, back);
            let to = end + around(list, options, on);
            let own = first - from..end - from;
            let parameters = of(&list.part(from..to + 1), own.clone())?;
            let begin = parameters[own.start];
            let way = parameters[own.end] - begin;
            let unit = way.max(1e-300) / f64::from(u32::MAX);
            sections.push(Section { first, start, unit });
            // The conversion saturates.
            ways.extend(
                parameters[own]
                    .iter()
                    .map(|u| ((u - begin) / unit).round() as u32),
            );
            start += way;
        }
        let whole = start.round().max(1.0);
        Ok(Self {
            sections,
            ways,
            scale: whole / start.max(1e-300),
            spans: whole as usize,
        })
    }

    /// Number of poses.
    pub(super) fn len(&self) -> usize {
        self.ways.len() + 1
    }

    /// Number of knot intervals.
    pub(super) fn spans(&self) -> usize {
        self.spans
    }

    /// The parameter at a pose.
    pub(super) fn at(&self, pose: usize) -> f64 {
        let Some(way) = self.ways.get(pose) else {
            return self.spans as f64;
        };
        let next = self
            .sections
            .partition_point(|section| section.first <= pose);
        let Section { start, unit, .. } = self.sections[next - 1];
        (start + f64::from(*way) * unit) * self.scale
    }

    /// How many poses come before the first whose parameter is not as asked for.
    pub(super) fn count(&self, is: impl Fn(f64) -> bool) -> usize {
        let (mut low, mut high) = (0, self.len());
        while low < high {
            let middle = low.midpoint(high);
            if is(self.at(middle)) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// How many poses belong around a section on the side of these legs.
fn around(
    list: &List<'_>,
    options: &SmoothOptions,
    legs: impl Iterator<Item = [usize; 2]>,
) -> usize {
    let (mut count, mut time) = (0, 0.0);
    for ends in legs {
        if count >= AROUND && time >= 1.0 {
            break;
        }
        count += 1;
        time += leg(&ends.map(|i| *list.at(i)), options);
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;

    /// Parameters that are known of the whole list are kept across sections, as a share of the whole.
    #[test]
    fn sections_are_one_list() {
        let poses: Vec<_> = (0..3 * SECTION as i32)
            .map(|i| Isometry3::translation(1e-3 * f64::from(i), 0.0, 0.0))
            .collect();
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            ..ToolLimits::UNLIMITED
        };
        let options = SmoothOptions::new(1e-4, limits);
        let at = |x: f64| 300.0 * x + 20.0 * x.sin();
        let list = List::of(&poses);
        let mut own = 0;
        let marks = Marks::new(&list, &options, |part, range| {
            own += range.len();
            Ok::<_, ()>(part.iter().map(|pose| at(pose.translation.x)).collect())
        })
        .unwrap();
        assert_eq!((own, marks.len()), (poses.len() - 1, poses.len()));
        let end = at(poses[poses.len() - 1].translation.x);
        for (i, pose) in poses.iter().enumerate() {
            let wanted = at(pose.translation.x) * marks.spans() as f64 / end;
            assert!((marks.at(i) - wanted).abs() < 1e-5, "{i}");
        }
        let before = marks.count(|u| u < 1000.0);
        assert!(marks.at(before - 1) < 1000.0 && marks.at(before) >= 1000.0);
    }
}
