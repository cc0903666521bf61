//! The world model: import, export, database, chains, check.

use plan::finding::Severity;
use plan::world::{
    Change, Class, Durability, Location, Model, Object, Reader, Scalar, Writer, check, export_json,
    export_toml, import_json, import_nist, import_toml,
};

use crate::fixtures::{shared, shared_text};

fn errors(model: &Model) -> Vec<String> {
    check(model)
        .into_iter()
        .filter(|concern| concern.severity == Severity::Error)
        .map(|concern| format!("{}: {}", concern.subject, concern.message))
        .collect()
}

/// Same objects, places, properties and descriptions; numbers of objects may differ.
pub(crate) fn assert_same(one: &Model, other: &Model) {
    let names = |model: &Model| model.objects().map(|o| o.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(one), names(other));
    for object in one.objects() {
        let twin = other.named(&object.name).unwrap();
        assert_eq!(object.class, twin.class);
        let reference = |model: &Model, object: &Object| {
            model
                .object(object.location.reference)
                .unwrap()
                .name
                .clone()
        };
        assert_eq!(reference(one, object), reference(other, twin));
        assert_eq!(object.location.relation, twin.location.relation);
        let difference = object.location.pose.inv_mul(&twin.location.pose);
        assert!(difference.translation.vector.norm() < 1e-9 && difference.rotation.angle() < 1e-7);
        assert_eq!(object.properties.len(), twin.properties.len());
        for (name, value) in &object.properties {
            match (value, &twin.properties[name]) {
                (Scalar::Number(a), Scalar::Number(b)) => assert!((a - b).abs() < 1e-9),
                (a, b) => assert_eq!(a, b),
            }
        }
    }
    assert_eq!(one.skus().count(), other.skus().count());
    assert_eq!(one.designs().count(), other.designs().count());
}

/// Every workstation of the kitting viewer comes in, is consistent, and survives TOML and JSON.
#[test]
fn nist_workstations_come_in() {
    let Some(shared) = shared() else { return };
    let mut files = 0;
    for entry in std::fs::read_dir(shared.join("data/nist/workstation")).unwrap() {
        let path = entry.unwrap().path();
        if !path
            .file_name()
            .unwrap()
            .to_string_lossy()
            .starts_with("kittingInstances")
        {
            continue;
        }
        let model = import_nist(&std::fs::read_to_string(&path).unwrap())
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(errors(&model), Vec::<String>::new(), "{}", path.display());
        assert_same(&model, &import_toml(&export_toml(&model).unwrap()).unwrap());
        assert_same(&model, &import_json(&export_json(&model).unwrap()).unwrap());
        files += 1;
    }
    assert_eq!(files, 6);
}

/// Figures of one file, counted by eye.
#[test]
fn a_nist_workstation_holds_what_it_says() {
    let Some(text) = shared_text("data/nist/workstation/kittingInstancesInit1.xml") else {
        return;
    };
    let model = import_nist(&text).unwrap();
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

/// What the database gives back is the model that went in, bit for bit; readers cannot write.
#[test]
fn database_round_trip() {
    let Some(text) = shared_text("data/nist/workstation/kittingInstancesGoal2.xml") else {
        return;
    };
    let model = import_nist(&text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.db");
    let mut writer = Writer::open(&path, Durability::Process).unwrap();
    writer.replace(&model).unwrap();
    let reader = Reader::open(&path).unwrap();
    let read = reader.model().unwrap();
    assert_eq!(
        model.objects().collect::<Vec<_>>(),
        read.objects().collect::<Vec<_>>(),
        "objects are the same, bit for bit"
    );
    assert_eq!(reader.revision().unwrap(), 0);
    let part = model.first_of(Class::Part).unwrap();
    let location = Location::pose(model.workstation().unwrap().id, part.location.pose);
    writer
        .commit(
            &[Change::Place {
                object: part.id,
                location,
            }],
            None,
        )
        .unwrap();
    assert_eq!(reader.revision().unwrap(), 1);
    assert_eq!(
        reader.model().unwrap().object(part.id).unwrap().location,
        location
    );
}

/// Sizes that are not positive, numbers that are none and names that are used twice are refused,
/// in all forms of files.
#[test]
fn impossible_descriptions_are_refused() {
    let toml = crate::fixtures::repository_text("examples/kitting/workstation.toml");
    let json = export_json(&import_toml(&toml).unwrap()).unwrap();
    let mut cases: Vec<(String, &str, &str)> = [
        ("length = 25", "length = 0", "sizes must be positive"),
        ("length = 25", "length = -inf", "sizes must be positive"),
        ("weight = 0.02", "weight = nan", "weight"),
        ("weight = 0.02", "weight = -1.0", "weight"),
        ("id = \"PartB\"", "id = \"PartA\"", "PartA"),
    ]
    .map(|(from, to, why)| (toml.replacen(from, to, 1), "toml", why))
    .into();
    let volume = "[[volume]]\nrobot = \"Robot1\"\nminimum = [0, 0, 0]\nmaximum = [1, inf, 1]\n";
    cases.push((format!("{toml}\n{volume}"), "toml", "volume"));
    let flat = json.replacen("\"length\": 25.0", "\"length\": -25.0", 1);
    cases.push((flat, "json", "sizes must be positive"));
    if let Some(xml) = shared_text("data/nist/workstation/kittingInstancesInit1.xml") {
        let (start, length) = (xml.find("<Length>").unwrap(), "<Length>".len());
        let end = start + xml[start..].find("</Length>").unwrap();
        let flat = format!("{}-0.0{}", &xml[..start + length], &xml[end..]);
        cases.push((flat, "xml", "sizes must be positive"));
        let first = "<Name>stock_keeping_unit_part_a</Name>";
        let twice = xml.replacen("<Name>stock_keeping_unit_part_b</Name>", first, 1);
        assert_ne!(twice, xml);
        let unit = "<AngleUnit>degree</AngleUnit>";
        let turned = xml.replacen(unit, "<AngleUnit>turn</AngleUnit>", 1);
        assert_ne!(turned, xml);
        cases.push((turned, "xml", "unknown angle unit"));
        cases.push((twice, "xml", "stock_keeping_unit_part_a"));
    }
    for (text, form, why) in cases {
        let import = match form {
            "toml" => import_toml,
            "json" => import_json,
            _ => import_nist,
        };
        let said = import(&text).map(|_| ()).unwrap_err().to_string();
        assert!(said.contains(why), "{form}, {why}: {said}");
    }
    let mut model = import_toml(&toml).unwrap();
    let table = model.named("Table1").unwrap().id;
    let (property, value) = ("hasBox_Length".into(), Scalar::Number(-1.0));
    let change = Change::Set {
        object: table,
        property,
        value,
    };
    model.apply(&change).unwrap();
    assert!(errors(&model).iter().any(|e| e.contains("hasBox_Length")));
}

/// A world that replaces another is not taken for the one that a run was made in.
#[test]
fn runs_go_with_their_world() {
    let text = crate::fixtures::repository_text("examples/kitting/workstation.toml");
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::open(&folder.path().join("w.db"), Durability::Process).unwrap();
    writer.replace(&import_toml(&text).unwrap()).unwrap();
    let mut run = plan::world::StoredRun {
        id: 0,
        plan: "p".into(),
        source: "(greet robot_1)".into(),
        parameters: "{}".into(),
        stock: "{}".into(),
        state: "{}".into(),
        outcome: None,
        under_way: None,
    };
    run.id = writer.begin_run(&run).unwrap();
    assert_eq!(writer.last_run().unwrap(), Some(run));
    writer.replace(&import_toml(&text).unwrap()).unwrap();
    assert_eq!(writer.last_run().unwrap(), None);
}

/// A commit with one impossible change changes nothing.
#[test]
fn commits_are_whole() {
    let Some(text) = shared_text("data/nist/workstation/kittingInstancesInit1.xml") else {
        return;
    };
    let model = import_nist(&text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::open(&folder.path().join("w.db"), Durability::Process).unwrap();
    writer.replace(&model).unwrap();
    let part = model.first_of(Class::Part).unwrap();
    let tray = model.named("part_a_tray").unwrap();
    let good = Change::Set {
        object: part.id,
        property: "hasPart_SerialNumber".into(),
        value: Scalar::Text("changed".into()),
    };
    // The tray still has parts in it.
    writer
        .commit(&[good, Change::Delete(tray.id)], None)
        .unwrap_err();
    let after = writer.model().unwrap();
    assert_eq!(after.revision, 0);
    assert_eq!(after.object(part.id).unwrap(), part);
    after.object(tray.id).unwrap();
}

/// A database of schema version 1 is brought up to date and keeps its contents.
#[test]
fn old_databases_are_migrated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.db");
    let old = rusqlite::Connection::open(&path).unwrap();
    old.execute_batch(plan::world::schema::MIGRATIONS[0])
        .unwrap();
    old.execute_batch(
        "PRAGMA user_version = 1;
         INSERT INTO workstation VALUES (1, 'mm', 'degree', 'kilogram', 2, 7, NULL);
         INSERT INTO object VALUES (1, 'w', 'KittingWorkstation', 1, 'pose', '0 0 0 0 0 0 1');",
    )
    .unwrap();
    drop(old);
    assert!(Reader::open(&path).is_err());
    let writer = Writer::open(&path, Durability::Process).unwrap();
    assert_eq!(writer.model().unwrap().revision, 7);
    assert!(writer.last_run().unwrap().is_none());
    Reader::open(&path).unwrap();
    drop(writer);
    let newer = rusqlite::Connection::open(&path).unwrap();
    newer.pragma_update(None, "user_version", 99).unwrap();
    let error = Writer::open(&path, Durability::Process).unwrap_err();
    assert!(error.to_string().contains("version 99"), "{error}");
}

/// Chains through relative locations, cycles and missing objects are told apart.
#[test]
fn bad_chains_are_refused() {
    let text = r#"
        units = { length = "mm", angle = "degree", weight = "kilogram" }
        object = [
          { name = "w", class = "KittingWorkstation" },
          { name = "t", class = "WorkTable", reference = "w", pose = { point = [100, 0, 0] } },
          { name = "p", class = "Part", reference = "t", relation = "on", properties = { hasPart_SkuRef = "x" } },
        ]"#;
    let mut model = import_toml(text).unwrap();
    let part = model.named("p").unwrap().id;
    let table = model.named("t").unwrap().id;
    let error = model.workstation_from(part).unwrap_err().to_string();
    assert!(error.contains("only known to be on"), "{error}");
    let location = Location::pose(part, nalgebra::Isometry3::identity());
    let error = model
        .apply(&Change::Place {
            object: table,
            location,
        })
        .unwrap_err()
        .to_string();
    assert!(error.contains("relative to itself"), "{error}");
    assert!(
        errors(&model)
            .iter()
            .any(|error| error.contains("x, which nobody describes"))
    );
}
