//! The tree of links and joints in a URDF, and the path from its root to a tip.

use super::error::{Place, UrdfError};
use roxmltree::Node;
use std::collections::HashMap;

/// Longest text that is read, bytes.
pub(super) const MAX_BYTES: usize = 32 << 20;

/// A `<joint>` of the tree with the links that it names.
#[derive(Clone, Copy)]
pub(super) struct Joint<'a> {
    pub(super) node: Node<'a, 'a>,
    pub(super) name: &'a str,
    pub(super) kind: &'a str,
    pub(super) parent: &'a str,
    pub(super) child: &'a str,
}

/// Links and joints of one robot, checked to form a tree.
pub(super) struct Tree<'a> {
    pub(super) robot: Node<'a, 'a>,
    pub(super) name: &'a str,
    links: Vec<(&'a str, Place)>,
    joints: Vec<Joint<'a>>,
    /// Index of the joint above each link.
    above: HashMap<&'a str, usize>,
}

/// Where an element starts.
pub(super) fn place(node: Node<'_, '_>) -> Place {
    let at = node.document().text_pos_at(node.range().start);
    Place {
        line: at.row,
        column: at.col,
    }
}

/// Kind and name of an element, for messages.
pub(super) fn title(node: Node<'_, '_>) -> String {
    let kind = node.tag_name().name();
    node.attribute("name")
        .map_or_else(|| format!("<{kind}>"), |name| format!("{kind} \"{name}\""))
}

/// The value of an attribute that must be there.
fn required<'a>(node: Node<'a, 'a>, attribute: &str) -> Result<&'a str, UrdfError> {
    node.attribute(attribute)
        .filter(|value| !value.is_empty())
        .ok_or_else(|| UrdfError::Missing {
            place: place(node),
            element: title(node),
            missing: format!("attribute {attribute}"),
        })
}

/// The first child element of that name.
pub(super) fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children()
        .find(|child| child.is_element() && child.tag_name().name() == name)
}

/// The link that a `<parent>` or `<child>` of a joint names.
fn link_of<'a>(joint: Node<'a, 'a>, role: &str) -> Result<&'a str, UrdfError> {
    let element = child(joint, role).ok_or_else(|| UrdfError::Missing {
        place: place(joint),
        element: title(joint),
        missing: format!("<{role}> element"),
    })?;
    required(element, "link")
}

impl<'a> Tree<'a> {
    /// Reads links and joints and checks that they form one tree.
    ///
    /// # Errors
    /// Any error of names, links or loops, with its element.
    pub(super) fn read(document: &'a roxmltree::Document<'a>) -> Result<Self, UrdfError> {
        let robot = document.root_element();
        if robot.tag_name().name() != "robot" {
            let found = robot.tag_name().name().to_owned();
            return Err(UrdfError::NotRobot {
                place: place(robot),
                found,
            });
        }
        let name = required(robot, "name")?;
        let mut tree = Tree {
            robot,
            name,
            links: Vec::new(),
            joints: Vec::new(),
            above: HashMap::new(),
        };
        for node in robot.children().filter(Node::is_element) {
            match node.tag_name().name() {
                _ if node
                    .tag_name()
                    .namespace()
                    .is_some_and(|space| space.contains("xacro")) =>
                {
                    let found = format!("xacro:{}", node.tag_name().name());
                    return Err(UrdfError::Xacro {
                        place: place(node),
                        found,
                    });
                }
                "link" => tree.links.push((required(node, "name")?, place(node))),
                // `<joint>` inside `<transmission>` is not a child of `<robot>`.
                "joint" => tree.joints.push(Joint {
                    node,
                    name: required(node, "name")?,
                    kind: required(node, "type")?,
                    parent: link_of(node, "parent")?,
                    child: link_of(node, "child")?,
                }),
                _ => {}
            }
        }
        tree.check_names()?;
        tree.check_links()?;
        tree.check_loops()?;
        Ok(tree)
    }

    fn check_names(&self) -> Result<(), UrdfError> {
        let mut seen: HashMap<(&str, &str), Place> = HashMap::new();
        let links = self
            .links
            .iter()
            .map(|(name, place)| ("link", *name, *place));
        let joints = self
            .joints
            .iter()
            .map(|joint| ("joint", joint.name, place(joint.node)));
        for (kind, name, place) in links.chain(joints) {
            if let Some(first) = seen.insert((kind, name), place) {
                let element = format!("{kind} \"{name}\"");
                return Err(UrdfError::Duplicate {
                    place,
                    element,
                    first,
                });
            }
        }
        Ok(())
    }

    fn check_links(&mut self) -> Result<(), UrdfError> {
        let known: HashMap<&str, Place> = self.links.iter().copied().collect();
        for (index, joint) in self.joints.iter().enumerate() {
            for (role, link) in [("parent", joint.parent), ("child", joint.child)] {
                if !known.contains_key(link) {
                    return Err(UrdfError::UnknownLink {
                        place: place(joint.node),
                        joint: joint.name.to_owned(),
                        role,
                        link: link.to_owned(),
                    });
                }
            }
            if let Some(first) = self.above.insert(joint.child, index) {
                return Err(UrdfError::TwoParents {
                    place: place(joint.node),
                    link: joint.child.to_owned(),
                    first: self.joints[first].name.to_owned(),
                    second: joint.name.to_owned(),
                });
            }
        }
        Ok(())
    }

    fn check_loops(&self) -> Result<(), UrdfError> {
        let roots: Vec<_> = self
            .links
            .iter()
            .filter(|(name, _)| !self.above.contains_key(name))
            .collect();
        // Every link has at most one joint above it, so links that no root reaches form a cycle.
        let below = self.joints_below();
        let mut reached = vec![false; self.joints.len()];
        let mut open: Vec<&str> = roots.iter().map(|(name, _)| *name).collect();
        while let Some(link) = open.pop() {
            for &index in below.get(link).into_iter().flatten() {
                reached[index] = true;
                open.push(self.joints[index].child);
            }
        }
        if let Some(index) = reached.iter().position(|reached| !reached) {
            let joint = self.joints[index];
            return Err(UrdfError::Cycle {
                place: place(joint.node),
                joint: joint.name.to_owned(),
            });
        }
        if let [_, (_, place), ..] = roots[..] {
            return Err(UrdfError::SeveralRoots {
                place: *place,
                links: quoted(&roots),
            });
        }
        if roots.is_empty() {
            return Err(UrdfError::Missing {
                place: place(self.robot),
                element: title(self.robot),
                missing: "<link> element".to_owned(),
            });
        }
        Ok(())
    }

    fn joints_below(&self) -> HashMap<&'a str, Vec<usize>> {
        let mut below: HashMap<&str, Vec<usize>> = HashMap::new();
        for (index, joint) in self.joints.iter().enumerate() {
            below.entry(joint.parent).or_default().push(index);
        }
        below
    }

    /// The joints below a link.
    pub(super) fn joints_of(&self, link: &str) -> impl Iterator<Item = Joint<'a>> {
        self.joints
            .iter()
            .filter(move |joint| joint.parent == link)
            .copied()
    }

    /// The element of a link.
    pub(super) fn link(&self, name: &str) -> Option<Node<'a, 'a>> {
        let mut nodes = self.robot.children().filter(Node::is_element);
        nodes.find(|node| node.tag_name().name() == "link" && node.attribute("name") == Some(name))
    }

    /// The joints from the root to a link, root first.
    pub(super) fn way_to(&self, link: &str) -> Vec<Joint<'a>> {
        let mut way = Vec::new();
        let mut link = link;
        while let Some(&index) = self.above.get(link) {
            way.push(self.joints[index]);
            link = self.joints[index].parent;
        }
        way.reverse();
        way
    }

    /// The tip: the one asked for, or the only leaf behind a movable joint.
    ///
    /// # Errors
    /// [`UrdfError::NoSuchTip`], or [`UrdfError::SeveralTips`] when none was
    /// asked for and more than one leaf is carried by movable joints.
    pub(super) fn tip(&self, asked: Option<&str>) -> Result<&'a str, UrdfError> {
        let below = self.joints_below();
        let leaves: Vec<_> = self
            .links
            .iter()
            .filter(|(name, _)| !below.contains_key(name))
            .collect();
        if let Some(tip) = asked {
            return self
                .links
                .iter()
                .map(|(name, _)| *name)
                .find(|name| *name == tip)
                .ok_or_else(|| UrdfError::NoSuchTip {
                    tip: tip.to_owned(),
                    leaves: quoted(&leaves),
                });
        }
        let carried: Vec<_> = leaves
            .iter()
            .copied()
            .filter(|(name, _)| self.way_to(name).iter().any(|joint| joint.kind != "fixed"))
            .collect();
        match carried[..] {
            [(tip, _)] => Ok(tip),
            [] => Err(UrdfError::NoChain {
                place: place(self.robot),
                root: self
                    .links
                    .iter()
                    .map(|(name, _)| *name)
                    .find(|name| !self.above.contains_key(name))
                    .unwrap_or("")
                    .to_owned(),
                tip: leaves.first().map_or("", |(name, _)| name).to_owned(),
            }),
            _ => Err(UrdfError::SeveralTips {
                place: place(self.robot),
                tips: quoted(&carried),
            }),
        }
    }

    /// The root of the tree.
    pub(super) fn root(&self) -> &'a str {
        self.links
            .iter()
            .map(|(name, _)| *name)
            .find(|name| !self.above.contains_key(name))
            .unwrap_or("")
    }
}

/// Names in quotes, at most eight of them.
fn quoted(links: &[&(&str, Place)]) -> String {
    let mut text: Vec<String> = links
        .iter()
        .take(8)
        .map(|(name, _)| format!("\"{name}\""))
        .collect();
    if links.len() > 8 {
        text.push(format!("and {} more", links.len() - 8));
    }
    text.join(", ")
}
