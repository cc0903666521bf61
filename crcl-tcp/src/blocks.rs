//! Blocks of commands that a client repeats: LoopBlockStart and LoopBlockEnd over TCP.

use crcl::Command;

/// How many commands a block may come to when it is written out.
const LONGEST: usize = 2000;

/// How many blocks may be open one inside the other.
const DEEPEST: usize = 8;

/// The blocks that are open on a connection. Their commands are executed as they come; the end of a
/// block repeats them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Blocks {
    open: Vec<(String, Vec<Command>)>,
}

impl Blocks {
    /// Begins a block.
    ///
    /// # Errors
    /// A sentence when too many are open.
    pub(crate) fn begin(&mut self, name: String) -> Result<(), String> {
        if self.open.len() >= DEEPEST {
            return Err(format!("more than {DEEPEST} blocks one inside the other"));
        }
        self.open.push((name, Vec::new()));
        Ok(())
    }

    /// Keeps commands that are executed now for when their block is repeated.
    ///
    /// # Errors
    /// A sentence when a block gets too long; it is not kept then.
    pub(crate) fn keep(&mut self, commands: &[Command]) -> Result<(), String> {
        let Some((name, kept)) = self.open.last_mut() else {
            return Ok(());
        };
        if kept.len() + commands.len() > LONGEST {
            return Err(format!(
                "the block `{name}` has more than {LONGEST} commands"
            ));
        }
        kept.extend_from_slice(commands);
        Ok(())
    }

    /// Ends a block; gives the commands that are still to be executed, which count for the block
    /// around it too.
    ///
    /// # Errors
    /// A sentence when no block of that name is open, or the number of times is none.
    pub(crate) fn end(&mut self, name: &str, count: i32) -> Result<Vec<Command>, String> {
        let Some((open, kept)) = self.open.pop() else {
            return Err(format!("the block `{name}` ends, but does not begin"));
        };
        if open != name {
            return Err(format!("the block `{name}` ends inside `{open}`"));
        }
        let more = usize::try_from(count).ok().and_then(|n| n.checked_sub(1));
        let Some(more) = more else {
            return Err(format!(
                "a block that was executed once cannot be executed {count} times"
            ));
        };
        if kept.len().saturating_mul(more) > LONGEST {
            return Err(format!(
                "the block `{name}` comes to more than {LONGEST} commands"
            ));
        }
        let rest: Vec<_> = (0..more).flat_map(|_| kept.iter().cloned()).collect();
        self.keep(&kept)?;
        self.keep(&rest)?;
        Ok(rest)
    }

    /// Forgets all blocks.
    pub(crate) fn clear(&mut self) {
        self.open.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_executed_as_often_as_it_says() {
        let mut blocks = Blocks::default();
        let one = Command::Dwell { seconds: 1.0 };
        let two = Command::Dwell { seconds: 2.0 };
        blocks.begin("outer".to_owned()).unwrap();
        blocks.keep(std::slice::from_ref(&one)).unwrap();
        blocks.begin("inner".to_owned()).unwrap();
        blocks.keep(std::slice::from_ref(&two)).unwrap();
        assert_eq!(blocks.end("inner", 3).unwrap(), [two.clone(), two.clone()]);
        let again = blocks.end("outer", 2).unwrap();
        assert_eq!(again, [one, two.clone(), two.clone(), two]);
        assert!(blocks.end("outer", 1).is_err());
    }

    #[test]
    fn a_block_that_cannot_be_is_refused() {
        let mut blocks = Blocks::default();
        blocks.begin("a".to_owned()).unwrap();
        assert!(blocks.end("b", 1).is_err());
        blocks.begin("a".to_owned()).unwrap();
        assert!(blocks.end("a", 0).is_err());
        blocks.begin("a".to_owned()).unwrap();
        blocks.keep(&vec![Command::OpenGripper; LONGEST]).unwrap();
        assert!(blocks.keep(&[Command::OpenGripper]).is_err());
        assert!(blocks.end("a", i32::MAX).is_err());
    }
}
