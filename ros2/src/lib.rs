//! Canter in ROS 2 without ROS on the machine: a client of the engine like any other, and a node in
//! the graph of ROS.
//!
//! The node publishes `joint_states` and `robot_description`, and serves the action
//! `FollowJointTrajectory` of a trajectory controller. It knows ROS and no motion: a trajectory goes
//! to the engine as [`ipc::Verb::Follow`], which checks all of it before it moves; stops go through
//! [`ipc::ControlClient`]. The process that moves the arm opens no socket.
//!
//! # Source
//! The action as `joint_trajectory_controller` of ros2_controllers documents it; the crate
//! `ros2-client` for DDS and the conventions of ROS on top of it.

mod action;
mod arm;
mod bridge;
mod endpoints;
mod engine;
mod goal;
mod goals;
mod loopback;
pub mod messages;
mod notes;
mod options;
mod serve;
mod stopper;

pub use serve::main;
