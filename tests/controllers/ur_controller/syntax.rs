//! The part of URScript that programs for arms use, as data.

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expression {
    Number(f64),
    Truth(bool),
    Text(String),
    List(Vec<Expression>),
    Name(String),
    Index(Box<Expression>, Box<Expression>),
    /// Name, arguments in order, arguments by name.
    Call(String, Vec<Expression>, Vec<(String, Expression)>),
    /// Starts a thread.
    Run(String),
    Not(Box<Expression>),
    Minus(Box<Expression>),
    Pair(String, Box<Expression>, Box<Expression>),
}

/// A statement and its line, from 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Statement {
    pub(crate) line: usize,
    pub(crate) what: What,
}

/// What a statement does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum What {
    /// Name, place in a list, value.
    Set(String, Option<Expression>, Expression),
    Do(Expression),
    While(Expression, Vec<Statement>),
    If(Vec<(Expression, Vec<Statement>)>, Vec<Statement>),
    Thread(String, Vec<Statement>),
    Join(Expression),
    /// A critical section begins or ends: threads change only where one waits.
    Critical,
}

/// A program: `def` moves the arm, `sec` runs beside it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Program {
    pub(crate) secondary: bool,
    pub(crate) name: String,
    pub(crate) body: Vec<Statement>,
}

/// Why a text is no program.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SyntaxError {
    /// More of it must come.
    Unfinished,
    /// Line, from 1, and what is wrong there.
    Wrong(usize, String),
}

/// Reads all programs of a text.
pub(crate) fn read(text: &str) -> Result<Vec<Program>, SyntaxError> {
    let lines: Vec<(usize, Vec<Token>)> = text
        .split_inclusive('\n')
        .enumerate()
        .map(|(number, line)| match line.ends_with('\n') {
            true => Ok((number + 1, tokens(line, number + 1)?)),
            false => Err(SyntaxError::Unfinished),
        })
        .collect::<Result<Vec<_>, _>>()?;
    let full = lines.into_iter().filter(|(_, tokens)| !tokens.is_empty());
    let mut reader = Reader {
        lines: full.collect(),
        at: 0,
    };
    let mut programs = Vec::new();
    while let Some((line, tokens)) = reader.lines.get(reader.at).cloned() {
        reader.at += 1;
        let [Token::Word(kind), Token::Word(name), ..] = &tokens[..] else {
            return Err(SyntaxError::Wrong(line, "expected def or sec".into()));
        };
        if kind != "def" && kind != "sec" {
            return Err(SyntaxError::Wrong(line, format!("{kind} outside of def")));
        }
        programs.push(Program {
            secondary: kind == "sec",
            name: name.clone(),
            body: reader.block()?.0,
        });
    }
    Ok(programs)
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Word(String),
    Number(f64),
    Text(String),
    Sign(String),
}

fn tokens(line: &str, number: usize) -> Result<Vec<Token>, SyntaxError> {
    let letters: Vec<char> = line.chars().collect();
    let (mut found, mut at) = (Vec::new(), 0);
    let run = |from: usize, of: fn(char) -> bool| {
        let rest = letters[from..].iter();
        rest.take_while(|letter| of(**letter)).collect::<String>()
    };
    while let Some(&letter) = letters.get(at) {
        let token = if letter == '#' {
            break;
        } else if letter.is_whitespace() {
            at += 1;
            continue;
        } else if letter == '"' {
            let rest: String = letters[at + 1..].iter().collect();
            let end = rest.find('"');
            let end = end.ok_or(SyntaxError::Wrong(number, "a text has no end".into()))?;
            at += rest[..end].chars().count() + 2;
            found.push(Token::Text(rest[..end].to_owned()));
            continue;
        } else if letter.is_ascii_digit() {
            let text = run(at, |c| c.is_ascii_alphanumeric() || c == '.');
            let value = text.parse();
            at += text.len();
            let value =
                value.map_err(|_| SyntaxError::Wrong(number, format!("{text} is no number")))?;
            found.push(Token::Number(value));
            continue;
        } else if letter.is_alphabetic() || letter == '_' {
            Token::Word(run(at, |c| c.is_alphanumeric() || c == '_'))
        } else {
            let two: String = letters[at..letters.len().min(at + 2)].iter().collect();
            let known = ["<=", ">=", "==", "!="].contains(&two.as_str());
            Token::Sign(if known { two } else { letter.to_string() })
        };
        at += match &token {
            Token::Word(text) | Token::Sign(text) => text.chars().count(),
            _ => 0,
        };
        found.push(token);
    }
    Ok(found)
}

/// How a block ended.
#[derive(PartialEq)]
enum End {
    Whole,
    Elif(Expression),
    Else,
}

struct Reader {
    lines: Vec<(usize, Vec<Token>)>,
    at: usize,
}

impl Reader {
    /// Statements up to `end`, `elif` or `else`.
    fn block(&mut self) -> Result<(Vec<Statement>, End), SyntaxError> {
        let mut body = Vec::new();
        loop {
            let next = self.lines.get(self.at).cloned();
            let (line, tokens) = next.ok_or(SyntaxError::Unfinished)?;
            self.at += 1;
            let mut words = Words {
                tokens: &tokens,
                at: 0,
                line,
            };
            match words.word() {
                Some("end") => return Ok((body, End::Whole)),
                Some("else") => return Ok((body, End::Else)),
                Some("elif") => {
                    words.at = 1;
                    return Ok((body, End::Elif(words.expression(0)?)));
                }
                _ => body.push(Statement {
                    line,
                    what: self.statement(&mut words)?,
                }),
            }
        }
    }

    fn statement(&mut self, words: &mut Words<'_>) -> Result<What, SyntaxError> {
        let first = words.word().unwrap_or_default().to_owned();
        words.at += 1;
        match first.as_str() {
            "while" => {
                let condition = words.expression(0)?;
                Ok(What::While(condition, self.block()?.0))
            }
            "if" => self.branches(words.expression(0)?),
            "thread" => {
                let name = words.word().unwrap_or_default().to_owned();
                Ok(What::Thread(name, self.block()?.0))
            }
            "enter_critical" | "exit_critical" => Ok(What::Critical),
            "join" => Ok(What::Join(words.expression(0)?)),
            "global" | "local" => self.statement(words),
            _ => {
                words.at -= 1;
                words.assignment()
            }
        }
    }

    fn branches(&mut self, first: Expression) -> Result<What, SyntaxError> {
        let (mut cases, mut condition) = (Vec::new(), first);
        loop {
            let (body, end) = self.block()?;
            cases.push((condition, body));
            condition = match end {
                End::Whole => return Ok(What::If(cases, Vec::new())),
                End::Elif(next) => next,
                End::Else => return Ok(What::If(cases, self.block()?.0)),
            };
        }
    }
}

/// The rest of a line.
struct Words<'a> {
    tokens: &'a [Token],
    at: usize,
    line: usize,
}

/// Signs between two expressions, from the loosest.
const LEVELS: [&[&str]; 5] = [
    &["or"],
    &["and"],
    &["<", ">", "<=", ">=", "==", "!="],
    &["+", "-"],
    &["*", "/"],
];

impl Words<'_> {
    fn word(&self) -> Option<&str> {
        match self.tokens.get(self.at) {
            Some(Token::Word(word) | Token::Sign(word)) => Some(word),
            _ => None,
        }
    }

    fn wrong(&self, expected: &str) -> SyntaxError {
        let found = self.tokens.get(self.at);
        SyntaxError::Wrong(self.line, format!("expected {expected}, found {found:?}"))
    }

    fn is_next(&mut self, sign: &str) -> bool {
        let found = self.word() == Some(sign);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, sign: &str) -> Result<(), SyntaxError> {
        match self.is_next(sign) {
            true => Ok(()),
            false => Err(self.wrong(sign)),
        }
    }

    fn assignment(&mut self) -> Result<What, SyntaxError> {
        let target = self.expression(0)?;
        if !self.is_next("=") {
            return Ok(What::Do(target));
        }
        let value = self.expression(0)?;
        match target {
            Expression::Name(name) => Ok(What::Set(name, None, value)),
            Expression::Index(list, place) => match *list {
                Expression::Name(name) => Ok(What::Set(name, Some(*place), value)),
                _ => Err(self.wrong("a name")),
            },
            _ => Err(self.wrong("a name")),
        }
    }

    fn expression(&mut self, level: usize) -> Result<Expression, SyntaxError> {
        let Some(signs) = LEVELS.get(level) else {
            return self.unary();
        };
        let mut left = self.expression(level + 1)?;
        while let Some(sign) = self.word().filter(|word| signs.contains(word)) {
            let sign = sign.to_owned();
            self.at += 1;
            let right = self.expression(level + 1)?;
            left = Expression::Pair(sign, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expression, SyntaxError> {
        if self.is_next("-") {
            return Ok(Expression::Minus(Box::new(self.unary()?)));
        }
        if self.is_next("not") {
            return Ok(Expression::Not(Box::new(self.unary()?)));
        }
        let mut value = self.atom()?;
        while self.is_next("[") {
            let place = self.expression(0)?;
            self.expect("]")?;
            value = Expression::Index(Box::new(value), Box::new(place));
        }
        Ok(value)
    }

    fn atom(&mut self) -> Result<Expression, SyntaxError> {
        let token = self.tokens.get(self.at).cloned();
        self.at += 1;
        match token {
            Some(Token::Number(value)) => Ok(Expression::Number(value)),
            Some(Token::Text(text)) => Ok(Expression::Text(text)),
            Some(Token::Sign(sign)) if sign == "(" => {
                let inner = self.expression(0)?;
                self.expect(")")?;
                Ok(inner)
            }
            Some(Token::Sign(sign)) if sign == "[" => Ok(Expression::List(self.list("]")?.0)),
            Some(Token::Word(word)) => self.named(word),
            _ => {
                self.at -= 1;
                Err(self.wrong("a value"))
            }
        }
    }

    fn named(&mut self, word: String) -> Result<Expression, SyntaxError> {
        match word.as_str() {
            "True" | "False" => return Ok(Expression::Truth(word == "True")),
            // A pose.
            "p" if self.is_next("[") => return Ok(Expression::List(self.list("]")?.0)),
            "run" => {
                let name = self.word().unwrap_or_default().to_owned();
                self.at += 1;
                self.expect("(")?;
                self.expect(")")?;
                return Ok(Expression::Run(name));
            }
            _ => {}
        }
        if !self.is_next("(") {
            return Ok(Expression::Name(word));
        }
        let (plain, named) = self.list(")")?;
        Ok(Expression::Call(word, plain, named))
    }

    #[allow(clippy::type_complexity, reason = "arguments in order and by name")]
    fn list(
        &mut self,
        end: &str,
    ) -> Result<(Vec<Expression>, Vec<(String, Expression)>), SyntaxError> {
        let (mut plain, mut named) = (Vec::new(), Vec::new());
        while !self.is_next(end) {
            let value = self.expression(0)?;
            match value {
                Expression::Name(name) if self.is_next("=") => {
                    named.push((name, self.expression(0)?));
                }
                value => plain.push(value),
            }
            if !self.is_next(",") {
                self.expect(end)?;
                break;
            }
        }
        Ok((plain, named))
    }
}
