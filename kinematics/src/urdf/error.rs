//! Why a URDF cannot be used.

use std::fmt;
use thiserror::Error;

/// Where an element starts in the text, both counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Line.
    pub line: u32,
    /// Column, in characters.
    pub column: u32,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// Why a URDF cannot be used. Each variant names the element and its place.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum UrdfError {
    /// The text is longer than any robot description should be.
    #[error("the text has {bytes} bytes; at most {limit} are read")]
    TooLarge {
        /// Length of the text.
        bytes: usize,
        /// The largest length accepted.
        limit: usize,
    },
    /// The text is not well-formed XML.
    #[error("{place}: not well-formed XML: {message}")]
    NotXml {
        /// Where reading stopped.
        place: Place,
        /// What the XML reader said.
        message: String,
    },
    /// The root element is not `<robot>`.
    #[error("{place}: expected root element <robot>, found <{found}>")]
    NotRobot {
        /// The root element.
        place: Place,
        /// Its name.
        found: String,
    },
    /// The file is a xacro template.
    #[error("{place}: <{found}> is a xacro element; expand the file with `xacro` first")]
    Xacro {
        /// The first xacro element.
        place: Place,
        /// Its name.
        found: String,
    },
    /// An element or attribute that must be there is not.
    #[error("{place}: {element} has no {missing}")]
    Missing {
        /// The element.
        place: Place,
        /// Kind and name of the element, e.g. `joint "elbow"`.
        element: String,
        /// What is missing.
        missing: String,
    },
    /// An attribute does not hold the numbers that it should.
    #[error("{place}: {element}: {attribute} must be {expected}, found \"{found}\"")]
    BadNumber {
        /// The element.
        place: Place,
        /// Kind and name of the element.
        element: String,
        /// The attribute.
        attribute: String,
        /// What it should hold.
        expected: &'static str,
        /// What it holds.
        found: String,
    },
    /// Two elements of one kind have the same name.
    #[error("{place}: {element} has the same name as the one at {first}")]
    Duplicate {
        /// The second element.
        place: Place,
        /// Kind and name of the element.
        element: String,
        /// The first element.
        first: Place,
    },
    /// A joint names a link that does not exist.
    #[error("{place}: joint \"{joint}\": {role} link \"{link}\" does not exist")]
    UnknownLink {
        /// The joint.
        place: Place,
        /// Its name.
        joint: String,
        /// `parent` or `child`.
        role: &'static str,
        /// The link that it names.
        link: String,
    },
    /// A link is the child of two joints: a closed loop.
    #[error("{place}: link \"{link}\" is the child of two joints, \"{first}\" and \"{second}\"")]
    TwoParents {
        /// The second joint.
        place: Place,
        /// The link.
        link: String,
        /// The first joint.
        first: String,
        /// The second joint.
        second: String,
    },
    /// The joints form a cycle.
    #[error("{place}: joint \"{joint}\" is part of a cycle; a robot must be a tree")]
    Cycle {
        /// A joint of the cycle.
        place: Place,
        /// Its name.
        joint: String,
    },
    /// Several links have no parent.
    #[error("{place}: links {links} are all roots; a robot has exactly one")]
    SeveralRoots {
        /// The second root.
        place: Place,
        /// Their names.
        links: String,
    },
    /// There is no movable joint between root and tip.
    #[error("{place}: no movable joint between root link \"{root}\" and tip link \"{tip}\"")]
    NoChain {
        /// The tip or robot element.
        place: Place,
        /// The root link.
        root: String,
        /// The tip link.
        tip: String,
    },
    /// Several links could be the tip and none was chosen.
    #[error("{place}: several links could be the tip, choose one: {tips}")]
    SeveralTips {
        /// The robot element.
        place: Place,
        /// Their names.
        tips: String,
    },
    /// The chosen tip does not exist.
    #[error("tip link \"{tip}\" does not exist; leaf links are {leaves}")]
    NoSuchTip {
        /// The name asked for.
        tip: String,
        /// Names of the leaf links.
        leaves: String,
    },
    /// A joint of the chain has a kind that a serial arm cannot have.
    #[error(
        "{place}: joint \"{joint}\" of the chain is {found}; only revolute, continuous, prismatic and fixed joints can be driven"
    )]
    UnsupportedJoint {
        /// The joint.
        place: Place,
        /// Its name.
        joint: String,
        /// Its kind, or `mimic`.
        found: String,
    },
    /// The axis has no direction.
    #[error("{place}: joint \"{joint}\": axis ({x} {y} {z}) has no direction")]
    ZeroAxis {
        /// The axis element.
        place: Place,
        /// The joint.
        joint: String,
        /// Component of the axis.
        x: f64,
        /// Component of the axis.
        y: f64,
        /// Component of the axis.
        z: f64,
    },
    /// The lower limit is not below the upper one.
    #[error("{place}: joint \"{joint}\": lower limit {lower} is not below upper limit {upper}")]
    LimitsReversed {
        /// The limit element.
        place: Place,
        /// The joint.
        joint: String,
        /// Lower limit, rad or m.
        lower: f64,
        /// Upper limit, rad or m.
        upper: f64,
    },
    /// The joint count is not the one asked for.
    #[error("the chain has {found} movable joints, {expected} were asked for")]
    JointCount {
        /// Joints in the chain.
        found: usize,
        /// Joints asked for.
        expected: usize,
    },
    /// The loader `k` refused a file that passed our checks.
    #[error("the kinematics loader refused the chain: {message}")]
    Loader {
        /// What it said.
        message: String,
    },
}
