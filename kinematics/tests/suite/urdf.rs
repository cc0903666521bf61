//! Broken robot descriptions get an error that names the element, never a panic.

use crate::arms;
use kinematics::{UrdfError, urdf};

/// A two-joint robot in which one piece of text is replaced.
fn with(old: &str, new: &str) -> String {
    let text = r#"<robot name="pair">
  <link name="base"/><link name="upper"/><link name="lower"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="2" effort="3"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="2" effort="3"/>
  </joint>
</robot>"#;
    assert!(
        text.contains(old),
        "the test replaces text that is not there: {old}"
    );
    text.replacen(old, new, 1)
}

fn message(text: &str) -> String {
    urdf::read(text, None).expect_err("accepted").to_string()
}

#[test]
fn faults_name_element_and_place() {
    let elbow_limit = r#"<limit lower="-2" upper="2" velocity="2" effort="3"/>"#;
    let cases = [
        (with(elbow_limit, ""), r#"8:3: joint "elbow" has no <limit> element"#),
        (with(elbow_limit, r#"<limit velocity="2"/>"#), r#"joint "elbow" has no limit lower and upper"#),
        (with(r#"lower="-2" upper="2""#, r#"lower="2" upper="-2""#), r#"11:5: joint "elbow": lower limit 2 is not below upper limit -2"#),
        (with(r#"lower="-2""#, r#"lower="NaN""#), r#"limit lower must be a number, found "NaN""#),
        (with(r#"upper="2""#, r#"upper="1e999""#), r#"limit upper must be a finite number"#),
        (with(r#"velocity="2""#, r#"velocity="-2""#), r#"joint "shoulder": limit velocity must be zero or a positive number"#),
        (with(r#"xyz="0 0 1""#, r#"xyz="0 0""#), r#"joint "shoulder": origin xyz must be three finite numbers"#),
        (with(r#"xyz="0 0 1""#, r#"xyz="0 0 1e300""#), "three finite numbers"),
        (with(r#"<axis xyz="0 1 0"/>"#, r#"<axis xyz="0 0 0"/>"#), r#"5:38: joint "shoulder": axis (0 0 0) has no direction"#),
        (with(r#""elbow" type="revolute""#, r#""elbow" type="floating""#), r#"joint "elbow" of the chain is floating"#),
        (with(r#""elbow" type="revolute""#, r#""elbow" type="planar""#), r#"joint "elbow" of the chain is planar"#),
        (with(elbow_limit, &format!("{elbow_limit}<mimic joint=\"shoulder\"/>")), r#"joint "elbow" of the chain is a mimic joint"#),
        (with(r#"<parent link="upper"/>"#, r#"<parent link="forearm"/>"#), r#"joint "elbow": parent link "forearm" does not exist"#),
        (with(r#"<parent link="base"/>"#, r#"<parent link="lower"/>"#), "is part of a cycle"),
        (with(r#"<child link="lower"/>"#, r#"<child link="upper"/>"#), r#"link "upper" is the child of two joints, "shoulder" and "elbow""#),
        (with(r#"<child link="lower"/>"#, r#"<child link="base"/>"#), "is part of a cycle"),
        (with(r#"<link name="lower"/>"#, r#"<link name="lower"/><link name="stray"/>"#), r#"links "base", "stray" are all roots"#),
        (with(r#"<link name="lower"/>"#, r#"<link name="upper"/>"#), r#"link "upper" has the same name as the one at"#),
        (with(r#"name="elbow""#, r#"name="shoulder""#), r#"joint "shoulder" has the same name"#),
        (with(r#"<child link="lower"/>"#, ""), r#"joint "elbow" has no <child> element"#),
        (with("<robot", "<model"), "not well-formed"),
        (with("</robot>", ""), "not well-formed"),
        ("<sdf/>".into(), "expected root element <robot>, found <sdf>"),
        ("<robot/>".into(), "<robot> has no attribute name"),
        (r#"<robot name="r"/>"#.into(), "has no <link> element"),
        (r#"<robot name="r"><link name="a"/></robot>"#.into(), "no movable joint"),
        (String::new(), "not well-formed"),
        ("\u{0}\u{1}binary".into(), "not well-formed"),
        (r#"<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/></robot>"#.into(), "xacro:include> is a xacro element"),
    ];
    for (text, expected) in cases {
        let found = message(&text);
        assert!(
            found.contains(expected),
            "expected: {expected}\nfound:    {found}"
        );
    }
}

#[test]
fn several_tips_ask_for_a_choice() {
    let text = with(
        "</robot>",
        r#"<link name="finger"/><joint name="f" type="fixed"><parent link="upper"/><child link="finger"/></joint></robot>"#,
    );
    assert!(
        message(&text).contains(r#"several links could be the tip, choose one: "lower", "finger""#)
    );
    assert_eq!(urdf::read(&text, Some("finger")).unwrap().dof(), 1);
    assert!(matches!(
        urdf::read(&text, Some("thumb")),
        Err(UrdfError::NoSuchTip { .. })
    ));
}

/// Deep nesting and sheer size are answered, not overrun.
#[test]
fn deep_and_huge_files_are_answered() {
    let deep = format!(
        "<robot name=\"r\">{}{}</robot>",
        "<a>".repeat(200_000),
        "</a>".repeat(200_000)
    );
    assert!(message(&deep).contains("has no <link> element"));
    let huge = " ".repeat(33 << 20);
    assert!(message(&huge).contains("at most"));
}

/// URDF 1.2 attributes are read where they are given.
#[test]
fn acceleration_and_jerk_are_read() {
    let panda = arms::model("panda");
    assert_eq!(panda.joints[1].acceleration, Some(7.5));
    assert_eq!(panda.joints[1].jerk, Some(3750.0));
    assert_eq!(arms::model("ur5e").joints[0].acceleration, None);
}
