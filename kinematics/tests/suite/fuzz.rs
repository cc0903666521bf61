//! Damaged robot descriptions: a result or an error, never a panic.

use crate::arms::{self, Random, SEVEN, SIX};
use kinematics::urdf;
use nalgebra::SVector;

/// Pieces that turn up in broken files.
const PIECES: [&str; 14] = [
    "NaN",
    "inf",
    "-1e308",
    "1e-320",
    "\"",
    "<",
    ">",
    "/>",
    "<joint",
    "0 0 0",
    "fixed",
    "\u{0}",
    "&amp;",
    "<mimic joint=\"joint_1\"/>",
];

/// One to eight small damages, the same for the same number.
pub(crate) fn damaged(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=(random.unit() * 8.0) as u32 {
        let at = |random: &mut Random, length: usize| (random.unit() * length as f64) as usize;
        let (from, length) = (at(random, bytes.len().max(1)), at(random, 40));
        let to = (from + length).min(bytes.len());
        match (random.unit() * 5.0) as u32 {
            0 => drop(bytes.drain(from.min(to)..to)),
            1 => {
                let copy = bytes[from.min(to)..to].to_vec();
                let place = at(random, bytes.len() + 1);
                bytes.splice(place..place, copy);
            }
            2 => {
                let piece = PIECES[at(random, PIECES.len())];
                let end = (from + piece.len()).min(bytes.len());
                bytes.splice(from.min(end)..end, piece.bytes());
            }
            3 => bytes.truncate(bytes.len() - length.min(bytes.len())),
            _ => {
                if let Some(byte) = bytes.get_mut(from) {
                    *byte ^= 1 << at(random, 8);
                }
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// `CANTER_FUZZ_CASES` asks for more than the usual number.
fn cases() -> u32 {
    std::env::var("CANTER_FUZZ_CASES")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(3000)
}

#[test]
fn damaged_urdfs_are_answered() {
    let texts: Vec<String> = SIX
        .iter()
        .chain(&SEVEN)
        .map(|name| arms::text(name))
        .collect();
    let mut random = Random(41);
    let (mut read, mut refused) = (0, 0);
    for case in 0..cases() {
        let text = damaged(&texts[case as usize % texts.len()], &mut random);
        match urdf::read(&text, None) {
            Ok(model) => {
                read += 1;
                if let Ok(chain) = model.chain::<6>() {
                    let pose = chain.forward(&SVector::zeros());
                    assert!(pose.translation.vector.iter().all(|x| x.is_finite()));
                }
            }
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().is_empty());
            }
        }
    }
    assert!(read > 0 && refused > 0, "{read} read, {refused} refused");
}
