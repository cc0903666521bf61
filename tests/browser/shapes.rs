//! An arm of meshes is drawn from the files that its URDF names.

use std::fs;
use std::path::Path;

use crate::canter::canter;
use crate::devtools::Browser;
use crate::pages::{SIZE, ready};
use crate::scene::{Peer, Scene};

/// A box of 0.1 m as triangles: corners and the three corners of each triangle.
const CORNERS: [[f64; 3]; 8] = [
    [-0.05, -0.05, 0.0],
    [0.05, -0.05, 0.0],
    [0.05, 0.05, 0.0],
    [-0.05, 0.05, 0.0],
    [-0.05, -0.05, 0.3],
    [0.05, -0.05, 0.3],
    [0.05, 0.05, 0.3],
    [-0.05, 0.05, 0.3],
];
const TRIANGLES: [[usize; 3]; 12] = [
    [0, 2, 1],
    [0, 3, 2],
    [4, 5, 6],
    [4, 6, 7],
    [0, 1, 5],
    [0, 5, 4],
    [1, 2, 6],
    [1, 6, 5],
    [2, 3, 7],
    [2, 7, 6],
    [3, 0, 4],
    [3, 4, 7],
];

fn stl() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((TRIANGLES.len() as u32).to_le_bytes());
    for triangle in TRIANGLES {
        bytes.extend([0; 12]);
        for corner in triangle {
            for value in CORNERS[corner] {
                bytes.extend((value as f32).to_le_bytes());
            }
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn obj() -> String {
    let corner = |[x, y, z]: &[f64; 3]| format!("v {x} {y} {z}\n");
    let face = |[a, b, c]: &[usize; 3]| format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    CORNERS
        .iter()
        .map(corner)
        .chain(TRIANGLES.iter().map(face))
        .collect()
}

/// In millimetres, with an axis that is up for other programs: the page must not turn it.
fn dae() -> String {
    let numbers: Vec<String> = CORNERS
        .iter()
        .flatten()
        .map(|value| (value * 1e3).to_string())
        .collect();
    let indices: Vec<String> = TRIANGLES
        .iter()
        .flatten()
        .map(ToString::to_string)
        .collect();
    format!(
        "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\
         <asset><unit meter=\"0.001\" name=\"millimeter\"/><up_axis>Z_UP</up_axis></asset>\
         <library_geometries><geometry id=\"g\"><mesh><source id=\"p\"><float_array id=\"a\" count=\"24\">{}</float_array>\
         <technique_common><accessor source=\"#a\" count=\"8\" stride=\"3\"><param name=\"X\" type=\"float\"/>\
         <param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common></source>\
         <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"12\">\
         <input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>{}</p></triangles></mesh></geometry></library_geometries>\
         <library_visual_scenes><visual_scene id=\"s\"><node id=\"n\"><instance_geometry url=\"#g\"/></node></visual_scene>\
         </library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>",
        numbers.join(" "),
        indices.join(" ")
    )
}

fn urdf() -> String {
    let link = |name: &str, file: &str| {
        format!(
            "<link name=\"{name}\"><visual><geometry><mesh filename=\"{file}\"/></geometry></visual></link>"
        )
    };
    let joint = |name: &str, parent: &str, child: &str, axis: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"0 0 0.3\"/><axis xyz=\"{axis}\"/><limit lower=\"-2\" upper=\"2\" velocity=\"2\" effort=\"10\"/></joint>"
        )
    };
    format!(
        "<robot name=\"boxes\">{}{}{}{}{}{}{}{}{}</robot>",
        link("base", "package://boxes/meshes/a.stl"),
        link("one", "package://boxes/meshes/b.obj"),
        link("two", "package://boxes/meshes/c.dae"),
        "<link name=\"three\"/><link name=\"four\"/>",
        joint("j1", "base", "one", "0 0 1"),
        joint("j2", "one", "two", "0 1 0"),
        joint("j3", "two", "three", "0 1 0"),
        joint("j4", "three", "four", "1 0 0"),
        "<link name=\"lost\"><visual><geometry><mesh filename=\"package://boxes/meshes/none.stl\"/></geometry></visual></link>\
         <joint name=\"fixed\" type=\"fixed\"><parent link=\"base\"/><child link=\"lost\"/></joint>",
    )
}

fn package(folder: &Path) {
    let meshes = folder.join("boxes/meshes");
    fs::create_dir_all(folder.join("boxes/urdf")).unwrap();
    fs::create_dir_all(&meshes).unwrap();
    fs::write(meshes.join("a.stl"), stl()).unwrap();
    fs::write(meshes.join("b.obj"), obj()).unwrap();
    fs::write(meshes.join("c.dae"), dae()).unwrap();
    fs::write(folder.join("boxes/urdf/boxes.urdf"), urdf()).unwrap();
}

/// Meshes in all three forms are imported, served and drawn where the URDF puts them; one that is
/// missing is named.
pub(crate) fn meshes_of_an_imported_robot_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    package(folder.path());
    let robot = folder.path().join("robot");
    let (file, to) = (
        folder.path().join("boxes/urdf/boxes.urdf"),
        robot.display().to_string(),
    );
    let file = file.display().to_string();
    let ran = canter(["robots", "import", &file, "--to", &to, "--tip", "four"]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert!(
        ran.stderr.contains("1 of 4 meshes were not found"),
        "{}",
        ran.stderr
    );
    // What was copied is enough: the package may go.
    fs::remove_dir_all(folder.path().join("boxes")).unwrap();
    let scene = Scene::of("meshes", &to);
    let browser = Browser::start();
    let mut tab = browser.open(&scene.hand, SIZE);
    ready(&mut tab);
    tab.wait("__view.stage.robot.drawn === 3 && __view.stage.ghost.drawn === 3");
    tab.wait("[...document.querySelectorAll('#notes li')].some((note) => note.textContent.includes('none.stl'))");
    // Each box is 0.1 x 0.1 x 0.3 m, stands on its link and points along the link's z axis.
    let boxes = tab.eval(
        "['base', 'one', 'two'].map((name) => { const { links } = __view.stage.robot; const link = links.get(name); \
         link.updateWorldMatrix(true, true); let low = [9, 9, 9], high = [-9, -9, -9]; \
         link.children[0].traverse((o) => { if (!o.isMesh) return; const p = o.geometry.attributes.position; \
         const v = o.position.clone(); for (let k = 0; k < p.count; k += 1) { v.fromBufferAttribute(p, k).applyMatrix4(o.matrixWorld); \
         link.worldToLocal(v); v.toArray().forEach((x, i) => { low[i] = Math.min(low[i], x); high[i] = Math.max(high[i], x); }); } }); \
         return [...low, ...high]; })",
    );
    for found in boxes.as_array().unwrap() {
        let wanted = [-0.05, -0.05, 0.0, 0.05, 0.05, 0.3];
        for (index, wanted) in wanted.into_iter().enumerate() {
            let value = found[index].as_f64().unwrap();
            assert!((value - wanted).abs() < 1e-6, "{boxes}");
        }
    }
    // The browser itself says that a file is missing; nothing else.
    tab.complaints.retain(|text| !text.contains("none.stl"));
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}

/// What stands in the workstation is drawn where the world says, with its name under the pointer.
pub(crate) fn objects_of_the_world_are_drawn() {
    let arm = format!("browser{}/world", std::process::id());
    let mut engine = Peer::start(&[
        "engine",
        "--robot",
        "ur5e",
        "--arm",
        &arm,
        "--view",
        "--world",
        "examples/kitting/workstation.toml",
    ]);
    let address = engine.line("http://");
    let browser = Browser::start();
    let mut tab = browser.open(&address, SIZE);
    ready(&mut tab);
    tab.wait("__view.world.group.children.length > 3");
    let ran = canter([
        "world",
        "export",
        "examples/kitting/workstation.toml",
        "--json",
    ]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let names = tab.eval(
        "__view.world.group.children.map((box) => box.children[0].userData.name.split(' (')[0])",
    );
    for name in names.as_array().unwrap() {
        assert!(
            ran.stdout.contains(name.as_str().unwrap()),
            "{name} is not in the world"
        );
    }
    // The first box that is seen by itself names itself under the pointer.
    let named = "__view.world.group.children.some((box) => { const p = box.children[0].getWorldPosition(box.position.clone()).project(__view.stage.camera); \
        const { clientWidth: w, clientHeight: h } = __view.stage.canvas; \
        return __view.world.under((p.x + 1) / 2 * w, (1 - p.y) / 2 * h) === box.children[0].userData.name; })";
    assert_eq!(tab.eval(named), true);
    tab.eval("document.querySelector('[data-layer=objects]').click()");
    assert_eq!(tab.eval("__view.world.group.visible"), false);
    assert!(tab.complaints.is_empty(), "{:#?}", tab.complaints);
}
