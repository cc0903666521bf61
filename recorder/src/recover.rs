//! Making a whole file of one that was cut off.

use std::path::{Path, PathBuf};

use crate::{RecorderError, Rotation, Writer, read, topic};

/// What could be saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// The whole file.
    pub path: PathBuf,
    /// Periods in it.
    pub samples: usize,
    /// Why the file ended before its end; none where it was whole.
    pub cut: Option<String>,
}

/// Writes all that can be read of `path` into a new file: the same name without `.part`, or with
/// `-recovered`. The old file stays.
///
/// # Errors
/// The file cannot be read or is no recording, or the new one cannot be written.
pub fn recover(path: &Path) -> Result<Recovered, RecorderError> {
    let recorded = read(path)?;
    let whole = if path.extension().is_some_and(|found| found == "part") {
        path.with_extension("")
    } else {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{stem}-recovered.mcap"))
    };
    // The first file is written under a name of its own, so that the old one is not in its way.
    let aside = whole.with_extension("recovering.mcap");
    let mut writer = Writer::create(&aside, recorded.head.clone(), Rotation::NEVER)?;
    for text in &recorded.programs {
        writer.latch(topic::PROGRAM_TOPIC, text.clone())?;
    }
    for text in &recorded.certificates {
        writer.latch(topic::CERTIFICATE_TOPIC, text.clone())?;
    }
    let mut notes = recorded.notes.iter().peekable();
    for sample in &recorded.samples {
        let time = recorded.head.time_of(sample.tick);
        while let Some(note) = notes.next_if(|note| note.time_ns <= time) {
            writer.note(20, [&note.json, &note.json])?;
        }
        writer.put(sample)?;
    }
    for note in notes {
        writer.note(20, [&note.json, &note.json])?;
    }
    if let Some(periods) = &recorded.periods {
        writer.periods(periods)?;
    }
    writer.sync()?;
    for written in writer.close()? {
        if whole.exists() {
            return Err(RecorderError::Exists { path: whole });
        }
        std::fs::rename(&written, &whole)
            .map_err(|cause| crate::error::unwritable(&whole, cause))?;
    }
    Ok(Recovered {
        path: whole,
        samples: recorded.samples.len(),
        cut: recorded.cut,
    })
}
