//! The names under which cells are found in the network.

/// What all names begin with.
const ROOT: &str = "canter";

/// Something that every arm has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Reports.
    Status,
    /// What happened.
    Note,
    /// Present while the engine answers.
    Alive,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Status, Self::Note, Self::Alive];

    /// The last part of the name.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Status => "status",
            Self::Note => "note",
            Self::Alive => "alive",
        }
    }
}

/// The name of something of an arm `CELL/ARM`, or of all with `*/*`.
pub(crate) fn of(arm: &str, kind: Kind) -> String {
    format!("{ROOT}/{arm}/{}", kind.word())
}

/// The name of a question to an arm `CELL/ARM`, or to all with `*/*`.
pub(crate) fn ask(arm: &str, word: &str) -> String {
    format!("{ROOT}/{arm}/ask/{word}")
}

/// Arm and kind of a name that came.
pub(crate) fn read(name: &str) -> Option<(&str, Kind)> {
    let rest = name.strip_prefix(ROOT)?.strip_prefix('/')?;
    let (arm, word) = rest.rsplit_once('/')?;
    let kind = Kind::ALL.into_iter().find(|kind| kind.word() == word)?;
    (arm.split('/').count() == 2).then_some((arm, kind))
}

/// The arm that answered under this name.
pub(crate) fn answered(name: &str) -> Option<&str> {
    let rest = name.strip_prefix(ROOT)?.strip_prefix('/')?;
    rest.rsplit_once("/ask/").map(|(arm, _)| arm)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_made() {
        for kind in Kind::ALL {
            assert_eq!(read(&of("hall/left", kind)), Some(("hall/left", kind)));
        }
        assert_eq!(answered(&ask("hall/left", "stop")), Some("hall/left"));
        for wrong in [
            "canter/status",
            "other/a/b/status",
            "canter/a/b/c/status",
            "canter/a/b/x",
        ] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }
}
