//! Builds the calls of a program from tokens, without their meaning, and recovers from errors.

use std::ops::Range;

use crate::call::{Call, Node, State, Tree};
use crate::code;
use crate::command_info::CommandInfo;
use crate::finding::{Finding, Findings};
use crate::lexer::{Bracket, Kind, Lexer, Token, clip};
use crate::literal::{number_help, parse_number, unescape};

/// Brackets within brackets: the deepest command, a list of RollPitchYaw poses, needs 4.
const DEEPEST: usize = 16;

/// Names that stand inside a command and never begin one.
const VALUE_NAMES: [&str; 3] = ["Pose", "Point", "RollPitchYaw"];

/// The call that is being parsed cannot be finished.
struct Abandoned;

/// Makes calls out of tokens.
pub(crate) struct Parser<'a, 'f> {
    source: &'a str,
    lexer: Lexer<'a>,
    ahead: [Option<Token>; 2],
    open: Vec<(Bracket, usize)>,
    state: State,
    last_end: usize,
    pub(crate) findings: &'f mut Findings,
}

impl<'a, 'f> Parser<'a, 'f> {
    pub(crate) fn new(source: &'a str, findings: &'f mut Findings) -> Self {
        let (lexer, state) = (Lexer::new(source), State::Sound);
        let (ahead, open) = ([None; 2], Vec::new());
        Self {
            source,
            lexer,
            ahead,
            open,
            state,
            last_end: 0,
            findings,
        }
    }

    pub(crate) fn text(&self, span: Range<usize>) -> &'a str {
        self.source.get(span).unwrap_or_default()
    }

    /// The next call that has both its parentheses; nothing at the end of the source.
    pub(crate) fn next_call(&mut self) -> Option<Call> {
        loop {
            let token = self.peek();
            match token.kind {
                Kind::End => return None,
                Kind::Semicolon => drop(self.bump()),
                Kind::Word if self.peek_second().kind == Kind::Open(Bracket::Round) => {
                    match self.call() {
                        Ok(call) => return Some(call),
                        Err(Abandoned) => self.resynchronise(),
                    }
                }
                _ => self.not_a_call(token),
            }
        }
    }

    fn call(&mut self) -> Result<Call, Abandoned> {
        (self.state, self.open) = (State::Sound, Vec::new());
        let name = self.bump().span();
        let arguments = self.items()?;
        let span = name.start..self.last_end;
        Ok(Call {
            name,
            arguments,
            span,
            state: self.state,
        })
    }

    /// Reports text where a command should begin, and continues with the next command.
    fn not_a_call(&mut self, token: Token) {
        self.bump();
        match token.kind {
            Kind::Fault => {}
            Kind::Word => return self.bare_word(token),
            Kind::Close(bracket) => {
                let message = format!("`{}` closes nothing", bracket.close());
                let finding = Finding::error(code::SURPLUS_BRACKET, token.span(), message);
                self.findings
                    .push(finding.help("delete it, or open a bracket for it"));
            }
            _ => {
                let finding = Finding::error(
                    code::NOT_A_COMMAND,
                    token.span(),
                    "here should be a command",
                );
                let found = format!("`{}`", clip(self.text(token.span())));
                self.findings.push(
                    finding
                        .expected("the name of a command")
                        .found(found)
                        .help("a program is a row of commands such as `Dwell (0.5)`"),
                );
            }
        }
        self.resynchronise();
    }

    /// A name without parentheses.
    fn bare_word(&mut self, token: Token) {
        let word = self.text(token.span());
        let info = CommandInfo::find(word);
        let finding = match info {
            Some(_) => Finding::error(
                code::PARENTHESES,
                token.span(),
                format!("{word} lacks its parentheses"),
            ),
            None => Finding::error(
                code::NOT_A_COMMAND,
                token.span(),
                format!("`{}` is not a command", clip(word)),
            ),
        };
        let next = self.peek();
        let found = match next.kind {
            Kind::End => "the end of the file".to_owned(),
            _ if next.leads => "the end of the line".to_owned(),
            _ => format!("`{}`", clip(self.text(next.span()))),
        };
        let sample = info.map_or_else(|| "Dwell (0.5)".to_owned(), CommandInfo::sample);
        let help = match info {
            Some(_) => format!("write `{sample}`"),
            None => format!("a command is a name and parentheses, such as `{sample}`"),
        };
        let expected = format!("`(` after `{}`", clip(word));
        self.findings
            .push(finding.expected(expected).found(found).help(help));
        self.resynchronise();
    }

    /// Skips to where the next command probably begins.
    fn resynchronise(&mut self) {
        loop {
            let token = self.peek();
            if matches!(token.kind, Kind::End | Kind::Semicolon) || self.begins_command(token) {
                return;
            }
            self.bump();
        }
    }

    /// Whether the next token is surely the name of a new command.
    fn begins_command(&mut self, token: Token) -> bool {
        if token.kind != Kind::Word {
            return false;
        }
        let word = self.text(token.span());
        if VALUE_NAMES
            .iter()
            .any(|name| name.eq_ignore_ascii_case(word))
        {
            return false;
        }
        let called = self.peek_second().kind == Kind::Open(Bracket::Round);
        (called && token.leads) || CommandInfo::find(word).is_some()
    }

    /// The values from an opening bracket, which is next, to its closing one.
    fn items(&mut self) -> Result<Vec<Node>, Abandoned> {
        let opening = self.bump();
        let Kind::Open(bracket) = opening.kind else {
            return Err(Abandoned);
        };
        self.enter(bracket, &opening)?;
        let (mut items, mut comma): (Vec<Node>, Option<Token>) = (Vec::new(), None);
        loop {
            let token = self.peek();
            let wants_value = items.is_empty() || comma.is_some();
            match token.kind {
                Kind::Close(closing) => {
                    if self.closes(bracket, closing, &token)? {
                        self.surplus_comma(comma);
                        self.open.pop();
                        return Ok(items);
                    }
                }
                Kind::Comma => {
                    self.bump();
                    if wants_value {
                        self.surplus_comma(Some(token));
                    }
                    comma = Some(token);
                }
                Kind::Semicolon | Kind::End => return Err(self.unclosed(&token)),
                Kind::Fault => return self.abandon(),
                Kind::Word if self.begins_command(token) => return Err(self.unclosed(&token)),
                _ => {
                    if !wants_value {
                        self.missing_comma(&token);
                    }
                    comma = None;
                    let node = self.value()?;
                    items.push(node);
                }
            }
        }
    }

    fn enter(&mut self, bracket: Bracket, token: &Token) -> Result<(), Abandoned> {
        self.open.push((bracket, token.start));
        if bracket == Bracket::Square {
            self.mend(State::Mended);
            let message = "poses and lists stand in braces";
            let finding = Finding::error(code::BRACKET, token.span(), message);
            self.findings.push(
                finding
                    .expected("`{`")
                    .found("`[`")
                    .help("write `{` and `}` for `[` and `]`"),
            );
        }
        if self.open.len() <= DEEPEST {
            return Ok(());
        }
        let message = format!("more than {DEEPEST} brackets within each other");
        let finding = Finding::error(code::TOO_DEEP, token.span(), message);
        self.findings
            .push(finding.help("the deepest value is a list of poses: {{{x, y, z}, ...}, ...}"));
        self.abandon()
    }

    /// Deals with a closing bracket: whether it ends the list that `bracket` opened.
    fn closes(
        &mut self,
        bracket: Bracket,
        closing: Bracket,
        token: &Token,
    ) -> Result<bool, Abandoned> {
        if closing == bracket {
            self.bump();
            return Ok(true);
        }
        let after = self.peek_second();
        let ends_call = matches!(after.kind, Kind::End | Kind::Semicolon) || after.leads;
        if closing == Bracket::Round && ends_call {
            self.bump();
            self.last_end = token.start;
            return Err(self.unclosed(token));
        }
        self.bump();
        if bracket == Bracket::Round && after.kind == Kind::Close(Bracket::Round) {
            self.mend(State::Mended);
            let message = format!("one `{}` too many", closing.close());
            let finding = Finding::error(code::SURPLUS_BRACKET, token.span(), message);
            self.findings
                .push(finding.help("delete it, or open a bracket for it"));
            return Ok(false);
        }
        self.wrong_closing(bracket, closing, token);
        Ok(true)
    }

    fn wrong_closing(&mut self, bracket: Bracket, closing: Bracket, token: &Token) {
        self.mend(State::Mended);
        let (want, have) = (bracket.close(), closing.close());
        let message = format!("`{have}` cannot close `{}`", bracket.open());
        let finding = Finding::error(code::BRACKET, token.span(), message)
            .expected(format!("`{want}`"))
            .found(format!("`{have}`"))
            .help(format!("write `{want}` for `{have}`"));
        self.report_with_opening(finding);
    }

    /// Reports brackets that are still open at `token`.
    fn unclosed(&mut self, token: &Token) -> Abandoned {
        self.state = State::Broken;
        let innermost = self
            .open
            .last()
            .map_or(Bracket::Round, |&(bracket, _)| bracket);
        let found = match token.kind {
            Kind::End => "the end of the file".to_owned(),
            Kind::Word => format!("the next command, `{}`", clip(self.text(token.span()))),
            _ => format!("`{}`", clip(self.text(token.span()))),
        };
        let missing: String = self.missing_closers(token.kind);
        let at = self.last_end..self.last_end;
        let message = format!("`{}` is never closed", innermost.open());
        let finding = Finding::error(code::UNCLOSED, at, message)
            .expected(format!("`{}`", innermost.close()))
            .found(found)
            .help(format!("write `{missing}` here"));
        self.report_with_opening(finding);
        Abandoned
    }

    /// The closing brackets that are missing, innermost first.
    fn missing_closers(&self, stopped_by: Kind) -> String {
        let given = usize::from(stopped_by == Kind::Close(Bracket::Round));
        self.open
            .iter()
            .skip(given)
            .rev()
            .map(|(bracket, _)| bracket.close())
            .collect()
    }

    fn report_with_opening(&mut self, finding: Finding) {
        self.findings.push(match self.open.last() {
            Some(&(bracket, start)) => finding.note(
                start..start + 1,
                format!("this `{}` is open", bracket.open()),
            ),
            None => finding,
        });
    }

    fn missing_comma(&mut self, token: &Token) {
        self.mend(State::Mended);
        let found = format!("`{}`", clip(self.text(token.span())));
        let at = self.last_end..self.last_end;
        let finding = Finding::error(code::COMMA, at, "a comma is missing between two values");
        self.findings
            .push(finding.expected("`,`").found(found).help("write `,` here"));
    }

    fn surplus_comma(&mut self, comma: Option<Token>) {
        let Some(comma) = comma else { return };
        self.mend(State::Mended);
        let finding = Finding::error(
            code::SURPLUS_COMMA,
            comma.span(),
            "no value beside this comma",
        );
        self.findings
            .push(finding.help("delete the comma, or write the missing value"));
    }

    fn value(&mut self) -> Result<Node, Abandoned> {
        let token = self.peek();
        let value = match token.kind {
            Kind::Open(Bracket::Round) => return self.parenthesised(&token),
            Kind::Open(_) => Tree::Braces(self.items()?),
            Kind::Word if self.peek_second().kind == Kind::Open(Bracket::Round) => {
                let name = self.bump().span();
                Tree::Call {
                    name,
                    arguments: self.items()?,
                }
            }
            Kind::Word => self.word(),
            Kind::Number => self.number(),
            _ => self.quoted(),
        };
        Ok(Node {
            value,
            span: token.start..self.last_end,
        })
    }

    /// Parentheses where braces should be.
    fn parenthesised(&mut self, token: &Token) -> Result<Node, Abandoned> {
        self.mend(State::Mended);
        let message = "poses and lists stand in braces";
        let finding = Finding::error(code::BRACKET, token.span(), message);
        self.findings.push(
            finding
                .expected("`{`")
                .found("`(`")
                .help("write `{` and `}` for `(` and `)`"),
        );
        let value = Tree::Braces(self.items()?);
        Ok(Node {
            value,
            span: token.start..self.last_end,
        })
    }

    fn word(&mut self) -> Tree {
        let span = self.bump().span();
        let word = self.text(span.clone());
        let bare = word.trim_start_matches(['+', '-']).to_ascii_lowercase();
        if !matches!(bare.as_str(), "nan" | "inf" | "infinity") {
            return Tree::Word;
        }
        let finding = Finding::error(code::NOT_FINITE, span, "only finite numbers have a meaning");
        self.findings
            .push(finding.expected("a number").found(format!("`{word}`")));
        self.faulty()
    }

    fn number(&mut self) -> Tree {
        let span = self.bump().span();
        let text = self.text(span.clone());
        let whole = !text.contains(['.', 'e', 'E']);
        match parse_number(text) {
            Some(number) if number.is_finite() => return Tree::Number { number, whole },
            Some(_) => {
                let message = format!("`{}` is too large for a number", clip(text));
                let finding = Finding::error(code::OVERFLOW, span, message);
                self.findings
                    .push(finding.help("the largest number is about 1.8e308"));
            }
            None => {
                let message = format!("`{}` is not a number", clip(text));
                let finding = Finding::error(code::NUMBER, span, message);
                self.findings
                    .push(finding.expected("a number").help(number_help(text)));
            }
        }
        self.faulty()
    }

    fn quoted(&mut self) -> Tree {
        let span = self.bump().span();
        let body = self.text(span.start + 1..span.end.saturating_sub(1));
        match unescape(body) {
            Ok(text) => Tree::Text(text),
            Err((range, help)) => {
                let start = span.start + 1;
                let escape = format!(
                    "`{}` is not an escape sequence",
                    self.text(start + range.start..start + range.end)
                );
                let at = start + range.start..start + range.end;
                self.findings
                    .push(Finding::error(code::ESCAPE, at, escape).help(help));
                self.faulty()
            }
        }
    }

    fn faulty(&mut self) -> Tree {
        self.mend(State::Mended);
        Tree::Faulty
    }

    fn mend(&mut self, state: State) {
        self.state = self.state.max(state);
    }

    fn abandon<T>(&mut self) -> Result<T, Abandoned> {
        self.state = State::Broken;
        Err(Abandoned)
    }

    fn peek(&mut self) -> Token {
        let token = match self.ahead[0] {
            Some(token) => token,
            None => self.lexer.next(self.findings),
        };
        self.ahead[0] = Some(token);
        token
    }

    fn peek_second(&mut self) -> Token {
        self.peek();
        let token = match self.ahead[1] {
            Some(token) => token,
            None => self.lexer.next(self.findings),
        };
        self.ahead[1] = Some(token);
        token
    }

    fn bump(&mut self) -> Token {
        let token = self.peek();
        self.ahead = [self.ahead[1].take(), None];
        self.last_end = token.end;
        token
    }
}
