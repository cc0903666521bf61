//! The parser: position in the tokens, and expressions.

use super::ast::{Expression, Keyword, Name, Operator, Span, Term};
use super::token::{Kind, Token};
use crate::finding::Finding;

/// Deepest nesting of expressions and statements.
pub(super) const DEEPEST: usize = 100;

/// Most operators and property steps in one statement or field.
const MOST_OPERATORS: usize = 300;

/// An unexpected token was found; a finding was made.
pub(super) struct Misfit;

/// Result of reading something.
pub(super) type Read<T> = Result<T, Misfit>;

/// Reads tokens one by one and collects findings.
pub(super) struct Parser {
    pub(super) tokens: Vec<Token>,
    pub(super) at: usize,
    pub(super) findings: Vec<Finding>,
    pub(super) depth: usize,
    /// Operators and property steps of the statement or field so far.
    pub(super) operators: usize,
    /// In the condition of a requirement, `=` means `==`.
    pub(super) in_condition: bool,
}

impl Parser {
    pub(super) fn peek(&self) -> &Token {
        self.peek_at(0)
    }

    /// The token `ahead` further; the end is repeated for ever.
    pub(super) fn peek_at(&self, ahead: usize) -> &Token {
        let last = self.tokens.len() - 1;
        &self.tokens[(self.at + ahead).min(last)]
    }

    pub(super) fn next(&mut self) -> Token {
        let token = self.peek().clone();
        self.at += 1;
        token
    }

    pub(super) fn span(&self) -> Span {
        self.peek().span
    }

    /// Span of the token before the current one.
    pub(super) fn last_span(&self) -> Span {
        let last = self.tokens.len() - 1;
        self.tokens[self.at.saturating_sub(1).min(last)].span
    }

    pub(super) fn is_symbol(&self, symbol: &str) -> bool {
        matches!(&self.peek().kind, Kind::Symbol(found) if *found == symbol)
    }

    pub(super) fn is_ident(&self, name: &str) -> bool {
        matches!(&self.peek().kind, Kind::Ident(found) if found == name)
    }

    pub(super) fn take_symbol(&mut self, symbol: &str) -> bool {
        let found = self.is_symbol(symbol);
        self.at += usize::from(found);
        found
    }

    pub(super) fn warn(&mut self, code: &'static str, message: impl Into<String>, span: Span) {
        self.findings
            .push(Finding::warning(code, message, span.range()));
    }

    pub(super) fn fail<T>(&mut self, code: &'static str, message: String, span: Span) -> Read<T> {
        self.findings
            .push(Finding::error(code, message, span.range()));
        Err(Misfit)
    }

    /// Fails with "expected X, found Y" at the current token.
    pub(super) fn expected<T>(&mut self, what: &str) -> Read<T> {
        let found = match &self.peek().kind {
            Kind::Label(numbers) => {
                let numbers: Vec<String> = numbers.iter().map(u32::to_string).collect();
                format!("the label {}", numbers.join("."))
            }
            Kind::Ident(name) => format!("\"{name}\""),
            Kind::Number(number) => format!("{number}"),
            Kind::Text(text) => {
                format!("the text \"{}\"", text.chars().take(40).collect::<String>())
            }
            Kind::Symbol(symbol) => format!("\"{symbol}\""),
            Kind::End => "the end of the plan".into(),
        };
        let span = self.span();
        self.fail(
            "plan::syntax",
            format!("expected {what}, found {found}"),
            span,
        )
    }

    pub(super) fn expect_symbol(&mut self, symbol: &str) -> Read<()> {
        if self.take_symbol(symbol) {
            Ok(())
        } else {
            self.expected(&format!("\"{symbol}\""))
        }
    }

    pub(super) fn ident(&mut self, what: &str) -> Read<Name> {
        match self.peek().kind.clone() {
            Kind::Ident(text) => Ok(Name {
                text,
                span: self.next().span,
            }),
            _ => self.expected(what),
        }
    }

    /// A name that may be in quotes; whether it was is the second value.
    pub(super) fn name(&mut self, what: &str) -> Read<(Name, bool)> {
        match self.peek().kind.clone() {
            Kind::Ident(text) => Ok((
                Name {
                    text,
                    span: self.next().span,
                },
                false,
            )),
            Kind::Text(text) => Ok((
                Name {
                    text,
                    span: self.next().span,
                },
                true,
            )),
            _ => self.expected(what),
        }
    }

    pub(super) fn keyword(&mut self, allowed: &[Keyword]) -> Read<Keyword> {
        let names: Vec<&str> = allowed.iter().map(|keyword| keyword.name()).collect();
        let what = names.join(" or ");
        let name = match &self.peek().kind {
            Kind::Ident(name) | Kind::Text(name) => name.clone(),
            _ => return self.expected(&what),
        };
        match Keyword::from_name(&name).filter(|keyword| allowed.contains(keyword)) {
            Some(keyword) => {
                self.at += 1;
                Ok(keyword)
            }
            None => self.expected(&what),
        }
    }

    /// Runs `read` one level deeper, unless it is too deep.
    pub(super) fn deeper<T>(&mut self, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        if self.depth >= DEEPEST {
            let span = self.span();
            return self.fail("plan::depth", format!("nested deeper than {DEEPEST}"), span);
        }
        self.depth += 1;
        let result = read(self);
        self.depth -= 1;
        result
    }

    fn count_operator(&mut self, span: Span) -> Read<()> {
        self.operators += 1;
        if self.operators > MOST_OPERATORS {
            let message = format!("more than {MOST_OPERATORS} operators");
            return self.fail("plan::depth", message, span);
        }
        Ok(())
    }

    pub(super) fn expression(&mut self) -> Read<Expression> {
        self.deeper(|parser| parser.binary(1))
    }

    /// Binary operators of at least this strength, by precedence climbing.
    fn binary(&mut self, weakest: u8) -> Read<Expression> {
        let mut left = self.unary()?;
        while let Some((operator, strength)) = self.operator(weakest) {
            self.count_operator(self.span())?;
            self.at += 1;
            let right = self.deeper(|parser| parser.binary(strength + 1))?;
            let span = left.span.to(right.span);
            let term = Term::Binary(operator, Box::new(left), Box::new(right));
            left = Expression { term, span };
        }
        Ok(left)
    }

    fn operator(&mut self, weakest: u8) -> Option<(Operator, u8)> {
        let Kind::Symbol(symbol) = self.peek().kind else {
            return None;
        };
        if symbol == "=" && self.in_condition && weakest <= 3 {
            let message = "a condition compares with ==; = is read as ==";
            self.warn("plan::single_equal", message, self.span());
            return Some((Operator::Equal, 3));
        }
        let known = Operator::BINARY.iter().find(|(_, text, _)| *text == symbol);
        known
            .filter(|(_, _, strength)| *strength >= weakest)
            .map(|(o, _, s)| (*o, *s))
    }

    fn unary(&mut self) -> Read<Expression> {
        let start = self.span();
        let operator = match self.peek().kind {
            Kind::Symbol("-") => Operator::Minus,
            Kind::Symbol("!") => Operator::Not,
            _ => return self.postfix(),
        };
        self.at += 1;
        let operand = self.deeper(Self::unary)?;
        let span = start.to(operand.span);
        if let (Operator::Minus, Term::Number(number)) = (operator, &operand.term) {
            return Ok(Expression {
                term: Term::Number(-number),
                span,
            });
        }
        Ok(Expression {
            term: Term::Unary(operator, Box::new(operand)),
            span,
        })
    }

    fn postfix(&mut self) -> Read<Expression> {
        let mut value = self.primary()?;
        while self.take_symbol(".") {
            let property = self.ident("the name of a property")?;
            self.count_operator(property.span)?;
            let span = value.span.to(property.span);
            value = Expression {
                term: Term::Property(Box::new(value), property.text),
                span,
            };
        }
        Ok(value)
    }

    fn primary(&mut self) -> Read<Expression> {
        let span = self.span();
        let term = match self.peek().kind.clone() {
            Kind::Number(number) => Term::Number(number),
            Kind::Text(text) => Term::Text(text),
            Kind::Ident(name) => {
                self.at += 1;
                return self.named(name, span);
            }
            Kind::Symbol("(") => {
                self.at += 1;
                let inner = self.expression()?;
                self.expect_symbol(")")?;
                let span = span.to(self.last_span());
                return Ok(Expression { span, ..inner });
            }
            _ => return self.expected("an expression"),
        };
        self.at += 1;
        Ok(Expression { term, span })
    }

    fn named(&mut self, name: String, span: Span) -> Read<Expression> {
        let called = self.is_symbol("(") && !self.peek().first;
        let term = match name.as_str() {
            "Null" => Term::Null,
            "true" => Term::Truth(true),
            "false" => Term::Truth(false),
            _ if called => {
                let arguments = self.arguments()?;
                let span = span.to(self.last_span());
                return Ok(Expression {
                    term: Term::Call(name, arguments),
                    span,
                });
            }
            _ => Keyword::from_name(&name).map_or(Term::Name(name), Term::Keyword),
        };
        Ok(Expression { term, span })
    }

    /// `( a, b, c )`
    pub(super) fn arguments(&mut self) -> Read<Vec<Expression>> {
        self.expect_symbol("(")?;
        let mut arguments = Vec::new();
        if self.take_symbol(")") {
            return Ok(arguments);
        }
        loop {
            arguments.push(self.expression()?);
            if self.take_symbol(")") {
                return Ok(arguments);
            }
            if !self.take_symbol(",") {
                return self.expected("\",\" or \")\"");
            }
        }
    }
}
