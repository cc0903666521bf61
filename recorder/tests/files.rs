//! Files of recordings: written, read, cut off, recovered, rotated.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::fs;
use std::path::Path;

use recorder::{
    Head, MAX_JOINTS, Periods, Recording, Rotation, Sample, Writer, read, recover, topic,
};

fn head() -> Head {
    Head {
        form: recorder::FORM,
        version: "0".to_owned(),
        arm: "cell/arm".to_owned(),
        robot: "two".to_owned(),
        driver: "none".to_owned(),
        joints: vec!["a".to_owned(), "b".to_owned()],
        root_link: "base".to_owned(),
        period_ns: 1_000_000,
        begin_ns: 1_700_000_000_000_000_000,
        workstation_from_base: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0],
        start: vec![0.0, 0.5],
        default_length: "mm".to_owned(),
        reason: "record".to_owned(),
        urdf: "<robot/>".to_owned(),
        robot_toml: "[home]".to_owned(),
    }
}

fn list(first: f64, second: f64) -> [f64; MAX_JOINTS] {
    let mut list = [0.0; MAX_JOINTS];
    (list[0], list[1]) = (first, second);
    list
}

/// A motion with digits that no short form would keep.
fn sample(tick: u64) -> Sample {
    let t = tick as f64 * 1e-3;
    Sample {
        tick,
        command: 1 + (tick / 1000) as u32,
        path_time: t,
        time_scaling: 1.0,
        position: list(t.sin(), t.cos()),
        velocity: list(t.cos(), -t.sin()),
        acceleration: list(-t.sin(), -t.cos()),
        measured: list(t.sin() + 1e-4 * (17.0 * t).sin(), t.cos()),
        tool: [t.sqrt(), 0.0, 0.5, 1.0, 0.0, 0.0, 0.0],
        measured_tool: [t.cbrt(), 0.1, 0.2],
    }
}

fn write(path: &Path, ticks: u64) {
    let mut writer = Writer::create(path, head(), Rotation::NEVER).unwrap();
    writer
        .latch(topic::PROGRAM_TOPIC, "{\"name\":\"p\"}".to_owned())
        .unwrap();
    for tick in 0..ticks {
        writer.put(&sample(tick)).unwrap();
        if tick % 500 == 499 {
            writer.note(20, ["{\"event\":\"done\"}", "done"]).unwrap();
            writer.flush().unwrap();
        }
    }
    let periods = Periods {
        ticks,
        published: ticks,
        ..Periods::default()
    };
    writer.periods(&periods).unwrap();
    assert_eq!(writer.close().unwrap(), [path]);
}

/// Every number comes back with the same bits.
#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 2500);
    let recorded = read(&path).unwrap();
    assert_eq!(recorded.cut, None);
    assert_eq!(recorded.head, head());
    assert_eq!(recorded.samples.len(), 2500);
    for (tick, found) in recorded.samples.iter().enumerate() {
        assert_eq!(*found, sample(tick as u64));
    }
    assert_eq!(recorded.notes.len(), 5);
    assert_eq!(recorded.notes[0].json, "{\"event\":\"done\"}");
    assert_eq!(recorded.programs, ["{\"name\":\"p\"}"]);
    assert_eq!(recorded.periods.unwrap().ticks, 2500);
    assert!(!folder.path().join("a.mcap.part").exists());
    let again = Writer::create(&path, head(), Rotation::NEVER).unwrap_err();
    assert!(again.to_string().contains("exists already"), "{again}");
}

/// A file that ends anywhere is read up to its last whole chunk, and made whole again.
#[test]
fn a_file_that_is_cut_anywhere_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 2000);
    let bytes = fs::read(&path).unwrap();
    let cut = folder.path().join("cut.mcap.part");
    let (mut last, mut seen) = (usize::MAX, Vec::new());
    for end in (0..bytes.len()).rev().step_by(bytes.len() / 400) {
        fs::write(&cut, &bytes[..end]).unwrap();
        let Ok(recorded) = read(&cut) else {
            // Only where not even the head of the file is there.
            assert!(end < 16_384, "unreadable though {end} bytes are there");
            continue;
        };
        assert!(end == bytes.len() || recorded.cut.is_some());
        assert!(recorded.samples.len() <= last);
        last = recorded.samples.len();
        seen.push(last);
        for (tick, found) in recorded.samples.iter().enumerate() {
            assert_eq!(found.position, sample(tick as u64).position);
        }
    }
    seen.dedup();
    assert!(seen.starts_with(&[2000]) && seen.contains(&500), "{seen:?}");
    fs::write(&cut, &bytes[..bytes.len() * 3 / 4]).unwrap();
    let recovered = recover(&cut).unwrap();
    assert_eq!(recovered.path, folder.path().join("cut.mcap"));
    let whole = read(&recovered.path).unwrap();
    assert_eq!(whole.cut, None);
    assert_eq!(whole.samples, read(&cut).unwrap().samples);
    assert_eq!(whole.programs.len(), 1);
    assert!(recover(&cut).is_err(), "it is not written over");
}

/// A changed byte is found by a checksum, or was in no sample: a wrong number is never read.
#[test]
fn a_changed_byte_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 2000);
    let bytes = fs::read(&path).unwrap();
    let mut found = 0;
    for place in (64..bytes.len()).step_by(bytes.len() / 60) {
        let mut changed = bytes.clone();
        changed[place] ^= 1;
        fs::write(&path, &changed).unwrap();
        match read(&path) {
            Ok(recorded) => {
                found += usize::from(recorded.cut.is_some());
                for (tick, sample_read) in recorded.samples.iter().enumerate() {
                    assert_eq!(*sample_read, sample(tick as u64), "byte {place}");
                }
            }
            Err(_) => found += 1,
        }
    }
    assert!(found > 30, "{found} of 60");
}

#[test]
fn foreign_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for bytes in [&b""[..], b"hello", b"\x89MCAP0\r\n", &[0; 4096]] {
        fs::write(&path, bytes).unwrap();
        assert!(read(&path).is_err());
    }
    assert!(read(folder.path()).is_err());
    assert!(read(&folder.path().join("none")).is_err());
}

/// Files end at their age, each has all that a reader needs, and the oldest go.
#[test]
fn a_recording_is_rotated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let rotation = Rotation {
        age_ns: 1_000_000_000,
        keep: 400_000,
        ..Rotation::default()
    };
    let recording = Recording::start(&path, head(), rotation).unwrap();
    recording.latch(topic::PROGRAM_TOPIC, "{}".to_owned());
    for batch in 0..100 {
        recording.put((batch * 100..(batch + 1) * 100).map(sample).collect());
    }
    let summary = recording.close().unwrap();
    assert_eq!((summary.written, summary.dropped), (10_000, 0));
    assert!(summary.files.len() < 10, "{:?}", summary.files);
    assert!(!path.exists(), "the oldest stays");
    let mut next = None;
    for path in &summary.files {
        let recorded = read(path).unwrap();
        assert_eq!(recorded.programs, ["{}"]);
        assert_eq!(recorded.head.urdf, "<robot/>");
        for sample in &recorded.samples {
            assert!(
                next.is_none_or(|next| next == sample.tick),
                "a sample is missing"
            );
            next = Some(sample.tick + 1);
        }
    }
    assert_eq!(next, Some(10_000));
}

/// What has no room is counted; the file has the rest.
#[test]
fn a_full_channel_drops_and_counts() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let recording = Recording::start(&path, head(), Rotation::NEVER).unwrap();
    let batch: Vec<Sample> = (0..20_000).map(sample).collect();
    for _ in 0..40 {
        recording.put(batch.clone());
    }
    let summary = recording.close().unwrap();
    assert_eq!(summary.written + summary.dropped, 800_000);
    assert_eq!(read(&path).unwrap().samples.len() as u64, summary.written);
}

/// A folder that is missing is named before anything is recorded.
#[test]
fn a_missing_folder_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("none/a.mcap");
    let error = Writer::create(&missing, head(), Rotation::NEVER).unwrap_err();
    assert!(error.to_string().contains("cannot write"), "{error}");
}

/// A deterministic sequence of numbers.
struct Dice(u64);

impl Dice {
    /// The next number below `most`.
    ///
    /// # Source
    /// G. Marsaglia, Xorshift RNGs, Journal of Statistical Software 8(14), 2003.
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % most as u64) as usize
    }
}

/// One changed byte, wherever it stands, is found: the file is refused, or said to be damaged.
#[test]
fn one_changed_byte_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 1500);
    let whole = read(&path).unwrap();
    assert!(whole.cut.is_none() && !whole.damaged);
    let bytes = fs::read(&path).unwrap();
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    let changed = folder.path().join("changed.mcap");
    // Random places, and every byte of the last 300: the end of the file has its own records.
    let places = (0..1000)
        .map(|_| dice.below(bytes.len()))
        .collect::<Vec<_>>();
    for place in places.into_iter().chain(bytes.len() - 300..bytes.len()) {
        let mut copy = bytes.clone();
        copy[place] ^= 1 << (dice.0 % 8);
        fs::write(&changed, &copy).unwrap();
        if let Ok(found) = read(&changed) {
            assert!(found.damaged, "byte {place} of {}", bytes.len());
            assert!(found.cut.is_some());
            // What is given all the same is what was written.
            for sample in &found.samples {
                assert_eq!(*sample, whole.samples[sample.tick as usize]);
            }
        }
    }
}
