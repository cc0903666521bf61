//! The meshes that the robot's URDF names, for pages that show a token.

use std::io::Read;

use planner::robot::{Robot, mesh_file, mesh_names};

/// The largest mesh that is served (bytes).
const LARGEST: u64 = 64 << 20;

/// Where pages ask for meshes: behind it stands a name of the URDF, percent-encoded.
pub(crate) const PATH: &str = "/mesh/";

/// The file that a page asks for with this path, if the URDF of the robot names it.
pub(crate) fn read(robot: &Robot, path: &str) -> Option<Vec<u8>> {
    let name = decode(path.strip_prefix(PATH)?)?;
    let folder = robot.folder.as_deref()?;
    // No other file of the disk is ever read, whatever the page asks for.
    if !mesh_names(&robot.urdf).contains(&name.as_str()) {
        return None;
    }
    let file = std::fs::File::open(mesh_file(folder, &name)?).ok()?;
    let found = file.metadata().ok()?;
    if !found.is_file() || found.len() > LARGEST {
        return None;
    }
    let mut bytes = Vec::new();
    file.take(LARGEST).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// A text without percent signs for its special characters.
fn decode(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_decoded() {
        let plain = "package://a b/c.stl";
        assert_eq!(
            decode("package%3A%2F%2Fa%20b%2Fc.stl").as_deref(),
            Some(plain)
        );
        assert_eq!(
            (decode("%"), decode("%zz"), decode("%ff")),
            (None, None, None)
        );
    }

    /// Only what the URDF names is read, and only meshes.
    #[test]
    fn no_other_file_is_read() {
        let folder = std::env::temp_dir().join(format!("canter-mesh-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for (name, text) in [("a.stl", "solid"), ("b.stl", "other"), ("c.txt", "text")] {
            std::fs::write(folder.join(name), text).unwrap();
        }
        let mut robot = planner::robot::load("ur5e").unwrap();
        robot.urdf = "<mesh filename=\"a.stl\"/><mesh filename=\"c.txt\"/>".to_owned();
        assert!(read(&robot, "/mesh/a.stl").is_none(), "it has no folder");
        robot.folder = Some(folder.clone());
        assert_eq!(read(&robot, "/mesh/a.stl").unwrap(), b"solid");
        for wrong in ["b.stl", "c.txt", "..%2Fa.stl", "%2Fetc%2Fpasswd", ""] {
            assert!(read(&robot, &format!("/mesh/{wrong}")).is_none(), "{wrong}");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
