//! What the bridge is told when it starts.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use clap::{Parser, ValueEnum};
use ros2_client::{Name, NodeName, ServiceMapping};

/// Let ROS 2 drive the arm of a running engine, without ROS on this machine
///
/// Publishes `joint_states` and `robot_description`, and serves the action `FollowJointTrajectory` of a
/// trajectory controller, as MoveIt uses it. Neither DDS nor ROS asks who is there: whoever can
/// reach this process can move the arm. Without `--network` only programs on this machine can. Ctrl-C
/// ends it and stops a trajectory that is under way.
#[derive(Clone, Debug, Parser)]
#[command(name = "canter-ros2", version)]
pub(crate) struct Options {
    /// Name of the arm, as cell/arm
    #[arg(long, value_name = "CELL/ARM", default_value = "canter/arm")]
    pub(crate) arm: String,
    /// Directory in which engine, driver and clients find each other [default: $CANTER_DOMAIN, else
    /// canter in the user's runtime directory]
    #[arg(long, value_name = "DIR")]
    pub(crate) domain: Option<PathBuf>,
    /// Distribution of ROS 2 on the other side
    #[arg(long, value_enum, default_value_t = Distribution::Jazzy)]
    pub(crate) distro: Distribution,
    /// DDS of ROS 2 on the other side: services and actions differ
    #[arg(long, value_enum, default_value_t = Rmw::Fastdds)]
    pub(crate) rmw: Rmw,
    /// Number of the ROS domain [default: $ROS_DOMAIN_ID, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    pub(crate) ros_domain: Option<u16>,
    /// Namespace of all names
    #[arg(long, value_name = "NAMESPACE", default_value = "/")]
    pub(crate) namespace: String,
    /// Name of the controller that has the action
    #[arg(
        long,
        value_name = "NAME",
        default_value = "joint_trajectory_controller"
    )]
    pub(crate) controller: String,
    /// Keep only the way of a trajectory, and make the fastest time law for it
    #[arg(long)]
    pub(crate) retime: bool,
    /// A program that ROS may start by the service NAME; may be given several times
    #[arg(long, value_name = "NAME=FILE")]
    pub(crate) program: Vec<Program>,
    /// Serve the network interface with this address too: whoever is there can move the arm
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) network: Vec<std::net::IpAddr>,
}

/// A distribution of ROS 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Distribution {
    /// 2022.
    Humble,
    /// 2024.
    Jazzy,
    /// 2025, and later ones.
    Kilted,
}

/// The middleware on the other side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Rmw {
    /// `rmw_fastrtps`, which is ROS's own choice, and `rmw_connextdds`.
    Fastdds,
    /// `rmw_cyclonedds`.
    Cyclone,
}

impl Rmw {
    /// How a service carries the number of its requests.
    pub(crate) fn mapping(self) -> ServiceMapping {
        match self {
            Self::Fastdds => ServiceMapping::Enhanced,
            Self::Cyclone => ServiceMapping::Cyclone,
        }
    }
}

/// A program with the name of its service.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Program {
    /// The name.
    pub(crate) name: String,
    /// The file.
    pub(crate) file: PathBuf,
}

impl FromStr for Program {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, file) = text
            .split_once('=')
            .ok_or_else(|| format!("expected NAME=FILE, got {text:?}"))?;
        Name::new("/", name).map_err(|error| format!("{name:?} is no name in ROS: {error}"))?;
        Ok(Self {
            name: name.to_owned(),
            file: file.into(),
        })
    }
}

/// Where the names of the bridge are.
#[derive(Clone, Debug)]
pub(crate) struct Names {
    namespace: String,
}

/// A name that ROS does not allow.
#[derive(Debug)]
pub(crate) struct BadName(String);

impl fmt::Display for BadName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Names {
    /// The names in a namespace, which begins with a slash.
    pub(crate) fn new(namespace: &str) -> Self {
        Self {
            namespace: namespace.to_owned(),
        }
    }

    /// The node.
    ///
    /// # Errors
    /// The namespace is none.
    pub(crate) fn node(&self) -> Result<NodeName, BadName> {
        NodeName::new(&self.namespace, "canter")
            .map_err(|error| BadName(format!("the namespace {:?}: {error}", self.namespace)))
    }

    /// A topic, service or action; `under` is the part before the last slash, if there is one.
    ///
    /// # Errors
    /// It is no name.
    pub(crate) fn name(&self, under: &str, base: &str) -> Result<Name, BadName> {
        let space = self.namespace.trim_end_matches('/');
        let space = if under.is_empty() {
            space.to_owned()
        } else {
            format!("{space}/{under}")
        };
        let space = if space.is_empty() { "/" } else { &space };
        Name::new(space, base).map_err(|error| BadName(format!("{space}/{base}: {error}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_ros() {
        let root = Names::new("/");
        assert_eq!(
            root.name("", "joint_states").unwrap().to_string(),
            "/joint_states"
        );
        let name = root.name("scaled", "follow_joint_trajectory").unwrap();
        assert_eq!(name.to_string(), "/scaled/follow_joint_trajectory");
        let left = Names::new("/cell/left");
        assert_eq!(
            left.name("canter", "stop").unwrap().to_string(),
            "/cell/left/canter/stop"
        );
        assert!(Names::new("left").node().is_err());
        assert!(root.name("", "no spaces").is_err());
    }

    #[test]
    fn a_program_has_name_and_file() {
        let program: Program = "pick=a=b.canon".parse().unwrap();
        assert_eq!(
            (program.name.as_str(), program.file.to_str()),
            ("pick", Some("a=b.canon"))
        );
        assert!("pick".parse::<Program>().is_err());
        assert!(
            "pick-it=x.canon"
                .parse::<Program>()
                .unwrap_err()
                .contains("no name in ROS")
        );
    }
}
