//! The world model: import, export, database, chains, check.

use plan::finding::Severity;
use plan::world::{
    Change, Class, Durability, Location, Model, Object, Reader, Scalar, Writer, check, export_json,
    export_toml, import_json, import_nist, import_toml,
};

use crate::fixtures::data;

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

/// A workstation in NIST's form comes in with what it says, is consistent, and survives TOML and
/// JSON.
#[test]
fn a_nist_workstation_comes_in() {
    let model = import_nist(&data("cell.xml")).unwrap();
    assert_eq!(errors(&model), Vec::<String>::new());
    assert_same(&model, &import_toml(&export_toml(&model).unwrap()).unwrap());
    assert_same(&model, &import_json(&export_json(&model).unwrap()).unwrap());
    assert_eq!((model.skus().count(), model.volumes().len()), (5, 1));
    assert_eq!(model.design("bolt_and_nut").unwrap().parts.len(), 2);
    assert_eq!(model.effector().unwrap().name, "big_cup");
    let bolts = model.named("bolts").unwrap().id;
    assert_eq!(model.count(bolts, "bolt", 1), 2);
    // (20, 0, 0) + turned by a quarter (0, -10, 30) + (2, 0, 0.5), in inches.
    let bolt = model.named("bolt_1").unwrap();
    let place = model.workstation_from(bolt.id).unwrap().translation.vector;
    let wanted = nalgebra::vector![20.0 + 10.0, 2.0, 30.5] * 0.0254;
    assert!((place - wanted).norm() < 1e-9, "{place}");
    assert_eq!(bolt.sku(), Some("bolt"));
    let kit = model.named("kit_7").unwrap();
    assert_eq!(
        (kit.class, kit.sku()),
        (Class::KitInstance, Some("bolt_and_nut"))
    );
    assert_eq!(
        kit.properties["isKitInstance_Finished"],
        Scalar::Truth(true)
    );
    let cup = model.named("small_cup").unwrap();
    assert_eq!(cup.number("hasVacuumEffector_CupDiameter"), Some(0.0127));
    let effectors = &model.sku("bolt").unwrap().effectors;
    assert_eq!(effectors, &["small_cup"]);
    let volume = &model.volumes()[0];
    assert!((volume.maximum[2] - 50.0 * 0.0254).abs() < 1e-12);
}

/// What the database gives back is the model that went in, bit for bit; readers cannot write.
#[test]
fn database_round_trip() {
    let model = import_nist(&data("cell.xml")).unwrap();
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
    let xml = data("cell.xml");
    let xml_with = |from: &str, to: &str| {
        assert!(xml.contains(from), "{from}");
        xml.replacen(from, to, 1)
    };
    let flat = xml_with("<Length>2.0</Length>", "<Length>-0.0</Length>");
    cases.push((flat, "xml", "sizes must be positive"));
    let twice = xml_with("<Name>nut</Name>", "<Name>bolt</Name>");
    cases.push((twice, "xml", "bolt"));
    let turned = xml_with(">degree</AngleUnit>", ">turn</AngleUnit>");
    cases.push((turned, "xml", "unknown angle unit"));
    let word = xml_with("<X>10</X>", "<X>ten</X>");
    cases.push((word, "xml", "X is not a number: ten"));
    let lost = xml_with("<RefObjectName>bench</", "<RefObjectName>stool</");
    cases.push((lost, "xml", "relative to an object that is not there"));
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
    let model = import_nist(&data("cell.xml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::open(&folder.path().join("w.db"), Durability::Process).unwrap();
    writer.replace(&model).unwrap();
    let part = model.first_of(Class::Part).unwrap();
    let tray = model.named("bolts").unwrap();
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

/// Chains through relative locations, cycles and missing objects are distinguished.
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
            .any(|error| error.contains("x, which has no description"))
    );
}
