//! Other programs read the file with equal counts and values.

use std::path::Path;
use std::process::Command;

use crate::recorded_run;

/// What a script printed: counts of messages by topic, and the sum of all published positions.
fn compare(file: &Path, program: &mut Command) {
    let ran = program.arg(file).output().unwrap();
    let text = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{text}");
    let found: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    let ours = recorder::read(file).unwrap();
    let positions = ours.samples.iter().flat_map(|sample| &sample.position[..6]);
    let sum: f64 = positions.sum();
    assert_eq!(found[0]["/canter/setpoint"], ours.samples.len());
    assert_eq!(found[0]["/canter/state"], ours.samples.len());
    assert_eq!(found[0]["/robot_description"], 1);
    let all: u64 = found[0]
        .as_object()
        .unwrap()
        .values()
        .filter_map(serde_json::Value::as_u64)
        .sum();
    assert_eq!(all, ours.messages);
    assert!(
        (found[1].as_f64().unwrap() - sum).abs() < 1e-6,
        "{found} {sum}"
    );
}

/// The Python library reads the file, with equal counts and values.
pub(crate) fn python_reads_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    recorded_run(&file, "python");
    let script = "import sys, json\n\
        from mcap.reader import make_reader\n\
        from mcap_ros2.decoder import DecoderFactory\n\
        n = {}; s = 0.0\n\
        reader = make_reader(open(sys.argv[1], 'rb'), validate_crcs=True, \
        decoder_factories=[DecoderFactory()])\n\
        for schema, channel, message, ros in reader.iter_decoded_messages():\n    \
        n[channel.topic] = n.get(channel.topic, 0) + 1\n    \
        s += sum(ros.position) if channel.topic == '/canter/setpoint' else 0.0\n\
        print(json.dumps([n, s]))\n";
    compare(&file, Command::new("python3").args(["-c", script]));
}

/// Lichtblick's and Foxglove's own library reads the file, with equal counts and values. The bytes of
/// a setpoint are taken apart here: its list of positions stands at a known place.
pub(crate) fn node_reads_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.mcap");
    recorded_run(&file, "node");
    let script = "const { McapIndexedReader } = require('@mcap/core');\n\
        const { loadDecompressHandlers } = require('@mcap/support');\n\
        const bytes = require('node:fs').readFileSync(process.argv[1]);\n\
        const readable = {\n\
          size: async () => BigInt(bytes.length),\n\
          read: async (from, count) => new Uint8Array(bytes.subarray(Number(from), Number(from + count))),\n\
        };\n\
        (async () => {\n\
          const decompressHandlers = await loadDecompressHandlers();\n\
          const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });\n\
          const n = {}; let s = 0;\n\
          for await (const message of reader.readMessages()) {\n\
            const { topic } = reader.channelsById.get(message.channelId);\n\
            n[topic] = (n[topic] ?? 0) + 1;\n\
            if (topic !== '/canter/setpoint') continue;\n\
            const view = new DataView(message.data.buffer, message.data.byteOffset + 4, message.data.byteLength - 4);\n\
            let at = 8; at += 4 + view.getUint32(at, true);\n\
            const align = (size) => { at = Math.ceil(at / size) * size; };\n\
            align(8); at += 8; at += 4; align(8); at += 16;\n\
            const count = view.getUint32(at, true); at += 4; align(8);\n\
            for (let k = 0; k < count; k += 1) s += view.getFloat64(at + 8 * k, true);\n\
          }\n\
          console.log(JSON.stringify([n, s]));\n\
        })();\n";
    compare(&file, Command::new("node").args(["-e", script]));
}
