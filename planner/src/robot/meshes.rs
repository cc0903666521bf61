//! Files of shapes that a URDF names.

use std::path::{Component, Path, PathBuf};

/// Forms of meshes that a live view can draw.
const FORMS: [&str; 3] = ["stl", "obj", "dae"];

/// The names of meshes in a URDF, in its order: what stands in the attributes `filename`.
#[must_use]
pub fn mesh_names(urdf: &str) -> Vec<&str> {
    let after = urdf.split("filename=").skip(1);
    let quoted = after.filter_map(|rest| {
        let quote = rest.chars().next().filter(|first| "\"'".contains(*first))?;
        rest.get(1..)?.split(quote).next()
    });
    quoted
        .filter(|name| form(Path::new(name)).is_some())
        .collect()
}

/// The form of a mesh by the end of its name: `stl`, `obj` or `dae`.
fn form(path: &Path) -> Option<&'static str> {
    let end = path.extension()?.to_str()?;
    FORMS
        .into_iter()
        .find(|form| end.eq_ignore_ascii_case(form))
}

/// The file of a mesh that a URDF names; none where there is no such regular file.
///
/// `folder` is that of the URDF. A name is a path from there, `file://` with a whole path, or
/// `package://NAME/PATH`: then `NAME` is looked for in the folder, and in and above its parents.
/// What [`super::import`] has copied is in the folder `meshes`.
#[must_use]
pub fn mesh_file(folder: &Path, name: &str) -> Option<PathBuf> {
    form(Path::new(name))?;
    let copied = folder.join("meshes").join(plain(name));
    let mut places = vec![copied];
    if let Some(whole) = name.strip_prefix("file://") {
        places.push(PathBuf::from(whole));
    } else if let Some(path) = name.strip_prefix("package://") {
        let (package, rest) = path.split_once('/')?;
        for above in folder.ancestors() {
            places.push(above.join(path));
            if above.file_name().is_some_and(|found| found == package) {
                places.push(above.join(rest));
            }
        }
    } else {
        places.push(folder.join(name));
    }
    places.into_iter().find(|place| place.is_file())
}

/// A name as a path that stays in its folder.
fn plain(name: &str) -> PathBuf {
    let path = name.split_once("://").map_or(name, |(_, path)| path);
    let inside = |part: &Component<'_>| matches!(part, Component::Normal(_));
    Path::new(path).components().filter(inside).collect()
}

/// Copies the meshes that a URDF of the folder `from` names into the robot folder `to`; says how
/// many were found and how many not.
///
/// # Errors
/// A file that cannot be copied.
pub(super) fn copy_meshes(urdf: &str, from: &Path, to: &Path) -> std::io::Result<(usize, usize)> {
    let mut counts = (0, 0);
    for name in mesh_names(urdf) {
        let Some(file) = mesh_file(from, name) else {
            counts.1 += 1;
            continue;
        };
        let copy = to.join("meshes").join(plain(name));
        if !copy.exists() {
            std::fs::create_dir_all(copy.parent().unwrap_or(to))?;
            std::fs::copy(&file, &copy)?;
        }
        counts.0 += 1;
    }
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    const URDF: &str = "<mesh filename=\"package://arm/meshes/a.STL\"/><mesh filename='b.obj'/>\
        <mesh filename=\"../../etc/c.dae\"/><texture filename=\"wood.png\"/>";

    #[test]
    fn meshes_are_named_found_and_copied() {
        assert_eq!(
            mesh_names(URDF),
            ["package://arm/meshes/a.STL", "b.obj", "../../etc/c.dae"]
        );
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let urdf = at.join("arm/urdf");
        for path in ["arm/meshes", "arm/urdf"] {
            std::fs::create_dir_all(at.join(path)).unwrap();
        }
        std::fs::write(at.join("arm/meshes/a.STL"), "a").unwrap();
        std::fs::write(urdf.join("b.obj"), "b").unwrap();
        assert!(mesh_file(&urdf, "package://arm/meshes/a.STL").is_some());
        assert!(mesh_file(&urdf, "package://other/meshes/a.STL").is_none());
        assert!(mesh_file(&urdf, "b.obj").is_some() && mesh_file(&urdf, "b.png").is_none());
        let robot = at.join("elsewhere/robot");
        assert_eq!(copy_meshes(URDF, &urdf, &robot).unwrap(), (2, 1));
        let copied = mesh_file(&robot, "package://arm/meshes/a.STL").unwrap();
        assert!(copied.starts_with(robot.join("meshes")));
        assert!(mesh_file(&robot, "b.obj").is_some());
        assert_eq!(plain("../../etc/c.dae"), Path::new("etc/c.dae"));
    }
}
