//! The poses of a list without repeats, where it has some.

use nalgebra::Isometry3;

use super::list::List;
use super::moved_list;
use crate::line::Line;

/// The poses without repeats, and with more of them where the tool turns far.
#[derive(Clone, Debug)]
pub(super) struct Moved {
    pub(super) poses: Vec<Isometry3<f64>>,
    /// Which of them each pose of the list is.
    pub(super) given: Vec<usize>,
}

impl Moved {
    /// `None` where the list may be taken as it is.
    pub(super) fn new(list: &List<'_>) -> Option<Self> {
        let mut poses = moved_list(list)?;
        // The last pose is met exactly, also if it repeats one before it by rounding.
        *poses.last_mut()? = *list.last();
        let (mut kept, mut at) = (*list.at(0), 0);
        let mut given = Vec::with_capacity(list.len());
        for pose in list.iter() {
            if !Line::new(kept, *pose).is_still() {
                kept = *pose;
                at += 1;
                while at + 1 < poses.len() && poses[at] != kept {
                    at += 1;
                }
            }
            given.push(at);
        }
        Some(Self { poses, given })
    }
}
