//! Orders to tools, and what the arm carries with them.

use ipc::Payload;
use planner::task::ToolAction;
use planner::tooling::Tooling;
use servo::ToolOrder;

use super::TOOL_PATIENCE;

/// The order of a command that nominally takes `nominal` (s); `tooling` is as after it.
pub(super) fn tool_order(
    command: u32,
    action: ToolAction,
    nominal: f64,
    tooling: &Tooling,
) -> ToolOrder {
    let position = match action {
        ToolAction::MoveGripper { opening_um } => f64::from(opening_um) * 1e-6,
        _ => 0.0,
    };
    let (tool, wanted) = match action {
        ToolAction::OpenGripper => (ipc::GRIPPER, ipc::ToolAction::Open),
        ToolAction::CloseGripper => (ipc::GRIPPER, ipc::ToolAction::Close),
        ToolAction::MoveGripper { .. } => (ipc::GRIPPER, ipc::ToolAction::Move),
        ToolAction::OpenToolChanger => (ipc::TOOL_CHANGER, ipc::ToolAction::Open),
        ToolAction::CloseToolChanger => (ipc::TOOL_CHANGER, ipc::ToolAction::Close),
    };
    let changes = tool == ipc::TOOL_CHANGER;
    ToolOrder {
        position,
        payload: changes.then(|| payload(tooling)).flatten(),
        ..ToolOrder::new(command, tool, wanted, nominal + TOOL_PATIENCE)
    }
}

/// What the arm carries, for its controller; `None` where no mass is known.
pub(super) fn payload(tooling: &Tooling) -> Option<Payload> {
    let carried = tooling.carried()?;
    let tool = tooling.flange_from_tool();
    let moment = |row, column| carried.moment[(row, column)];
    let turn = tool.rotation.quaternion();
    Some(Payload {
        mass: carried.mass,
        centre: carried.centre.into(),
        inertia: [
            moment(0, 0),
            moment(1, 1),
            moment(2, 2),
            moment(0, 1),
            moment(0, 2),
            moment(1, 2),
        ],
        tool_position: tool.translation.vector.into(),
        tool_rotation: [turn.w, turn.i, turn.j, turn.k],
        ..Payload::default()
    })
}
