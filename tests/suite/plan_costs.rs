//! The computing time of choosing orders, and of a kit, measured with the real command.
//!
//! `CANTER_LAYOUTS` sets the number of layouts, `CANTER_KITS` that of kits.

use std::process::Stdio;

use system_tests::repository;

use crate::canter::{canter, command};
use crate::plans::{PLAN, WORLD, own, report, run, size};

/// On random layouts the order chosen by the planner's predicted times is never slower than the
/// written one. The places of the supplies are drawn with a fixed seed.
#[test]
fn chosen_orders_are_never_slower() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(repository::root().join(WORLD)).unwrap();
    let mut state: u64 = 20_261_121;
    let mut random = move || {
        // Source: Marsaglia, Xorshift RNGs (2003), the 64-bit triple 13, 7, 17.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let layouts = size("CANTER_LAYOUTS", 4);
    let (mut sums, mut better) = ([0.0; 2], 0);
    for layout in 0..layouts {
        let mut places = [210.0, 0.0, -210.0];
        for last in (1..3).rev() {
            places.swap(last, (random() * (last + 1) as f64) as usize);
        }
        let mut moved = text.clone();
        for (index, y) in [210, 0, -210].iter().enumerate() {
            let old = format!("pose = {{ point = [105, {y}, 700] }}");
            let (x, y) = (
                105.0 + 60.0 * (random() - 0.5),
                places[index] + 40.0 * (random() - 0.5),
            );
            moved = moved.replacen(
                &old,
                &format!("pose = {{ point = [{x:.2}, {y:.2}, 700] }} #"),
                1,
            );
        }
        let file = folder.path().join(format!("{layout}.toml"));
        std::fs::write(&file, moved).unwrap();
        let time = |more: &[&str]| {
            let start = [
                "plan-run",
                PLAN,
                "--world",
                file.to_str().unwrap(),
                "-r",
                "ur5e",
                "--json",
            ];
            let end = ["--dry-run", "--set", "NumberOfKitsToMake=1"];
            let ran = canter(start.iter().chain(&end).chain(more));
            assert_eq!(ran.code, 0, "{}{}", ran.stdout, ran.stderr);
            report(&ran)["motion_s"].as_f64().unwrap()
        };
        let (written, chosen) = (time(&["--written-order"]), time(&[]));
        assert!(
            chosen <= written + 1e-9,
            "layout {layout}: {chosen} s > {written} s"
        );
        sums = [sums[0] + written, sums[1] + chosen];
        better += usize::from(chosen < written - 1e-6);
    }
    println!(
        "{layouts} layouts: {:.3} s a kit as written, {:.3} s as chosen ({:.2} % less), better in {better}",
        sums[0] / layouts as f64,
        sums[1] / layouts as f64,
        100.0 * (1.0 - sums[1] / sums[0])
    );
}

/// Processor time (s) and resident memory (kB) of a process.
fn cost(process: u32) -> (f64, u64) {
    let read =
        |file: &str| std::fs::read_to_string(format!("/proc/{process}/{file}")).unwrap_or_default();
    let (stat, status) = (read("stat"), read("status"));
    // After the name in parentheses come state, ..., utime and stime in hundredths of a second.
    let fields = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .skip(11);
    let ticks: f64 = fields
        .take(2)
        .filter_map(|field| field.parse::<f64>().ok())
        .sum();
    let memory = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let memory = memory.and_then(|line| line.split_whitespace().next()?.parse().ok());
    (ticks / 100.0, memory.unwrap_or(0))
}

/// Many kits in a dry run: prints what a kit costs at the start and at the end, and holds the
/// memory flat.
#[test]
fn many_kits_cost_no_more_each() {
    use std::io::BufRead;
    let kits = size("CANTER_KITS", 4);
    let mut child = command(run(&own(), kits, &["--dry-run"]))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut marks = vec![(0.0, 0)];
    for line in std::io::BufReader::new(child.stderr.take().unwrap()).lines() {
        if line.unwrap().ends_with("is finished") {
            marks.push(cost(child.id()));
        }
    }
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert_eq!(marks.len(), kits + 1);
    let window = (kits / 10).max(1);
    let first = marks[window].0 - marks[0].0;
    let last = marks[kits].0 - marks[kits - window].0;
    println!(
        "{kits} kits: first {window} {:.3} s of processor each, last {window} {:.3} s, ratio {:.3}; \
         memory after {window} {} kB, at the end {} kB",
        first / window as f64,
        last / window as f64,
        last / first,
        marks[window].1,
        marks[kits].1
    );
    let (early, late) = (marks[kits.div_ceil(2)].1, marks[kits].1);
    assert!(late < early + 20_000, "{early} kB grew to {late} kB");
}
