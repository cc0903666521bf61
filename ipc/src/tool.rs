//! Orders of the engine to a gripper or tool changer, and their status.

use iceoryx2::prelude::ZeroCopySend;

/// What a gripper or tool changer shall do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ToolAction {
    /// Nothing was asked yet.
    None = 0,
    /// Open.
    Open = 1,
    /// Close; with a force, grasp.
    Close = 2,
    /// Move to the opening of the order.
    Move = 3,
    /// Find the ends of the tool's own travel.
    Home = 4,
}

impl ToolAction {
    /// The action that a number on the wire stands for.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::None),
            1 => Some(Self::Open),
            2 => Some(Self::Close),
            3 => Some(Self::Move),
            4 => Some(Self::Home),
            _ => None,
        }
    }
}

/// How a tool is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ToolStatus {
    /// There is no such tool, or its status is unknown.
    Unknown = 0,
    /// Open, at rest.
    Open = 1,
    /// Closed, at rest.
    Closed = 2,
    /// Moving.
    Moving = 3,
    /// The last order failed.
    Failed = 4,
    /// At rest at the opening of the last order, which was [`ToolAction::Move`].
    Reached = 5,
    /// Its ends are not known yet: it needs [`ToolAction::Home`].
    NotHomed = 6,
}

impl ToolStatus {
    /// The status that a number on the wire stands for.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            0 => Some(Self::Unknown),
            1 => Some(Self::Open),
            2 => Some(Self::Closed),
            3 => Some(Self::Moving),
            4 => Some(Self::Failed),
            5 => Some(Self::Reached),
            6 => Some(Self::NotHomed),
            _ => None,
        }
    }
}

/// An order to one tool, repeated in every setpoint. A new `order` number is a new order.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.ToolCommand.1")]
pub struct ToolCommand {
    /// Number of the order; 0 is none. It grows by one with each order.
    pub order: u32,
    /// A [`ToolAction`] by number.
    pub action: u32,
    /// Wanted opening (m): of a move, and of a close with a tolerance.
    pub position: f64,
    /// Fastest allowed motion (m/s); 0 means the tool's own value.
    pub velocity: f64,
    /// Largest allowed force (N); 0 means the tool's own value.
    pub force: f64,
    /// How far the opening may be from `position` with an object held (m); 0 means any opening.
    pub tolerance: f64,
}

/// Bits of [`ToolFeedback::flags`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToolFlags;

impl ToolFlags {
    /// `position` is measured.
    pub const POSITION: u32 = 1;
    /// `force` is measured.
    pub const FORCE: u32 = 2;
    /// The tool can tell whether it holds an object.
    pub const SENSES_OBJECT: u32 = 4;
    /// An object is held.
    pub const OBJECT: u32 = 8;
}

/// How one tool is, repeated in every state.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("canter.ToolFeedback.1")]
pub struct ToolFeedback {
    /// Number of the last order that was received.
    pub order: u32,
    /// A [`ToolStatus`] by number.
    pub status: u32,
    /// Opening (m).
    pub position: f64,
    /// Force (N).
    pub force: f64,
    /// Bits of [`ToolFlags`].
    pub flags: u32,
    /// For later; 0.
    pub reserved: u32,
}
