//! NIST's workstations, from the kitting viewer.

use plan::finding::Severity;
use plan::world::{Model, check, export_json, export_toml, import_json, import_nist, import_toml};

const FOLDER: &str = "data/nist/workstation";

fn names(model: &Model) -> Vec<String> {
    model.objects().map(|object| object.name.clone()).collect()
}

/// Every workstation comes in, is consistent, and survives TOML and JSON.
pub(crate) fn nist_workstations_come_in() {
    let mut files = 0;
    for entry in std::fs::read_dir(crate::path(FOLDER)).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.starts_with("kittingInstances") {
            continue;
        }
        let model = import_nist(&std::fs::read_to_string(&path).unwrap())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let errors = check(&model).into_iter();
        let errors: Vec<_> = errors.filter(|c| c.severity == Severity::Error).collect();
        assert_eq!(errors, [], "{name}");
        let toml = import_toml(&export_toml(&model).unwrap()).unwrap();
        let json = import_json(&export_json(&model).unwrap()).unwrap();
        assert_eq!((names(&toml), names(&json)), (names(&model), names(&model)));
        files += 1;
    }
    assert_eq!(files, 6);
}

/// Figures of one file, counted by eye.
pub(crate) fn a_nist_workstation_holds_what_it_says() {
    let model = import_nist(&crate::text(&format!("{FOLDER}/kittingInstancesInit1.xml"))).unwrap();
    assert_eq!(model.skus().count(), 6);
    assert_eq!(model.design("kit_design_a2b1c1").unwrap().parts.len(), 4);
    assert_eq!(model.effector().unwrap().name, "tray_gripper");
    let tray = model.named("part_a_tray").unwrap().id;
    assert_eq!(model.count(tray, "stock_keeping_unit_part_a", 1), 2);
    let part = model.named("part_a_1").unwrap().id;
    let pose = model.workstation_from(part).unwrap();
    assert!((pose.translation.vector - nalgebra::vector![5.659, 1.1, 0.0001]).norm() < 1e-9);
    let supply = model.named("empty_kit_tray_supply").unwrap().id;
    assert_eq!(model.count(supply, "stock_keeping_unit_kit_tray", 1), 1);
}
