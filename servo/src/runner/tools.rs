//! Orders to gripper and tool changer: one at a time, at rest.

use ipc::{Payload, ToolStatus};
use realtime::Demand;

use super::{Runner, Working};
use crate::event::{Event, Fault};
use crate::segment_sender::ToolOrder;

impl<const N: usize> Runner<N> {
    /// Sends a tool order; says whether it may begin now.
    pub(super) fn start_tool(&mut self, order: ToolOrder) -> bool {
        let moving = matches!(self.demand(), Demand::Run(share) if share > 0.0);
        let Some(command) = self.message.tools.get_mut(order.tool) else {
            self.latch(Fault::Tool {
                tool: order.tool,
                timeout: false,
            });
            return true;
        };
        if !self.ready || !moving {
            return false;
        }
        self.orders += 1;
        command.order = self.orders;
        command.action = order.action as u32;
        command.position = order.position;
        command.velocity = order.velocity;
        command.force = order.force;
        command.tolerance = order.tolerance;
        self.revise();
        let left = (order.timeout.max(0.0) / self.period) as u64;
        self.tool = Some(Working {
            order,
            number: self.orders,
            left,
        });
        self.report(Event::Started {
            command: order.command,
            tick: self.tick,
        });
        true
    }

    /// Whether the tool has done what it should.
    pub(super) fn watch_tool(&mut self) {
        let Some(mut working) = self.tool else { return };
        let tool = working.order.tool;
        let Some(feedback) = self.state.tools.get(tool) else {
            return;
        };
        let status = ToolStatus::from_number(feedback.status).unwrap_or(ToolStatus::Failed);
        let answered = feedback.order == working.number;
        match status {
            ToolStatus::Open | ToolStatus::Closed | ToolStatus::Reached if answered => {
                self.tool = None;
                if let Some(payload) = working.order.payload {
                    let number = self.payload.number.wrapping_add(1).max(1);
                    self.payload = Payload { number, ..payload };
                    self.revise();
                }
                let command = working.order.command;
                self.report(Event::Finished {
                    command,
                    tick: self.tick,
                });
            }
            ToolStatus::Failed | ToolStatus::Unknown | ToolStatus::NotHomed if answered => {
                self.latch(Fault::Tool {
                    tool,
                    timeout: false,
                });
            }
            _ if working.left == 0 => self.latch(Fault::Tool {
                tool,
                timeout: true,
            }),
            _ => {
                working.left -= 1;
                self.tool = Some(working);
            }
        }
    }
}
