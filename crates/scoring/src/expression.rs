//! Arithmetic over what models say: the language of the rule `expressions`.
//!
//! Numbers, names, `+ - * / ^`, parentheses, and the functions of [`Function`]. A name is a model, whose value is its
//! confidence, or a model and one of its parts, `revolute.circle_fit`; names that are no plain words stand in
//! back-quotes, `` `thesis-revolute`.circle_fit ``. There are no loops, no variables and no access to anything else.
//!
//! The parser climbs by precedence (V. Pratt, Top down operator precedence, 1973). It is our own so that every mistake
//! is found with its exact place, and so that names with hyphens and parts belong to the language.

use std::ops::Range;

/// Depth of nested parentheses and signs, and number of terms, beyond which nobody meant it.
const DEEPEST: usize = 64;
const MOST_TERMS: usize = 1000;

/// What is wrong with an expression, and where in its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mistake {
    pub(crate) message: String,
    pub(crate) help: String,
    pub(crate) span: Range<usize>,
}

/// A model's confidence, or one of its parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Name {
    pub(crate) model: String,
    pub(crate) part: Option<String>,
    pub(crate) span: Range<usize>,
}

/// A parsed expression with its text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Expression {
    text: String,
    root: Term,
}

#[derive(Debug, Clone, PartialEq)]
struct Term {
    kind: Kind,
    span: Range<usize>,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Number(f64),
    Name(Name),
    Negated(Box<Term>),
    Pair(char, Box<[Term; 2]>),
    Call(Function, Vec<Term>),
}

/// The functions there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Function {
    /// Least of its arguments.
    Min,
    /// Greatest of its arguments.
    Max,
    Exp,
    Ln,
    Sqrt,
    Abs,
}

const FUNCTIONS: [(&str, Function); 6] = [
    ("min", Function::Min),
    ("max", Function::Max),
    ("exp", Function::Exp),
    ("ln", Function::Ln),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
];

impl Expression {
    /// Reads an expression; whether its names exist is for the caller to say.
    pub(crate) fn parse(text: &str) -> Result<Self, Mistake> {
        let mut parser = Parser { text, at: 0, depth: 0, terms: 0 };
        let root = parser.sum(0)?;
        match parser.peek() {
            None => Ok(Self { text: text.to_owned(), root }),
            Some(')') => Err(parser.here("nothing opens this parenthesis", "take it out, or open one before it")),
            Some(',') => Err(parser.here("a comma separates the arguments of a function only", "functions: min, max")),
            Some(other) if starts_value(other) || other == '(' => {
                Err(parser.here("needed an operator before this", "to multiply, write `*`"))
            }
            Some(_) => Err(parser.stray()),
        }
    }

    /// All names, in the order of the text.
    pub(crate) fn names(&self) -> Vec<&Name> {
        let mut names = Vec::new();
        self.root.visit(&mut |term| {
            if let Kind::Name(name) = &term.kind {
                names.push(name);
            }
        });
        names
    }

    /// The value, with names looked up in `values`, which must know them all.
    pub(crate) fn value(&self, values: &dyn Fn(&Name) -> f64) -> f64 {
        self.root.value(values)
    }

    /// The innermost place at which the value stops being finite, and what helps against it.
    pub(crate) fn culprit(&self, values: &dyn Fn(&Name) -> f64) -> (Range<usize>, &'static str) {
        let culprit = self.root.culprit(values);
        (culprit.span.clone(), culprit.remedy(values))
    }

    /// The text, with values instead of names.
    pub(crate) fn worked(&self, values: &dyn Fn(&Name) -> f64) -> String {
        let (mut worked, mut end) = (String::new(), 0);
        for name in self.names() {
            worked += &self.text[end..name.span.start];
            worked += &crate::explanation::number(values(name));
            end = name.span.end;
        }
        worked + &self.text[end..]
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// The place of the whole text.
    pub(crate) fn span(&self) -> Range<usize> {
        self.root.span.clone()
    }
}

impl Term {
    fn children(&self) -> &[Term] {
        match &self.kind {
            Kind::Number(_) | Kind::Name(_) => &[],
            Kind::Negated(term) => std::slice::from_ref(term),
            Kind::Pair(_, terms) => terms.as_slice(),
            Kind::Call(_, terms) => terms,
        }
    }

    fn visit<'t>(&'t self, see: &mut dyn FnMut(&'t Term)) {
        see(self);
        self.children().iter().for_each(|child| child.visit(see));
    }

    fn value(&self, values: &dyn Fn(&Name) -> f64) -> f64 {
        match &self.kind {
            Kind::Number(number) => *number,
            Kind::Name(name) => values(name),
            Kind::Negated(term) => -term.value(values),
            Kind::Pair(operator, terms) => {
                let [a, b] = [terms[0].value(values), terms[1].value(values)];
                match operator {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    '/' => a / b,
                    _ => a.powf(b),
                }
            }
            Kind::Call(function, terms) => {
                let arguments = terms.iter().map(|term| term.value(values));
                // Unlike `f64::min`, which passes over what is not a number.
                let choose = |better: fn(f64, f64) -> bool| {
                    move |a: f64, b: f64| {
                        if a.is_nan() || better(a, b) { a } else { b }
                    }
                };
                let one = |f: fn(f64) -> f64| f(terms[0].value(values));
                match function {
                    Function::Min => arguments.reduce(choose(|a, b| a <= b)).unwrap_or(f64::NAN),
                    Function::Max => arguments.reduce(choose(|a, b| a >= b)).unwrap_or(f64::NAN),
                    Function::Exp => one(f64::exp),
                    Function::Ln => one(f64::ln),
                    Function::Sqrt => one(f64::sqrt),
                    Function::Abs => one(f64::abs),
                }
            }
        }
    }

    fn culprit(&self, values: &dyn Fn(&Name) -> f64) -> &Term {
        let child = self.children().iter().find(|child| !child.value(values).is_finite());
        child.map_or(self, |child| child.culprit(values))
    }

    /// What makes the value of this term finite, whose arguments are.
    fn remedy(&self, values: &dyn Fn(&Name) -> f64) -> &'static str {
        match &self.kind {
            Kind::Pair('/', terms) if terms[1].value(values) == 0.0 => {
                "the divisor is 0: keep it above, as in a / max(b, 1e-6)"
            }
            Kind::Call(Function::Ln, _) => "`ln` needs a number above 0, as in ln(max(a, 1e-6))",
            Kind::Call(Function::Sqrt, _) => "`sqrt` needs 0 or more, as in sqrt(max(a, 0))",
            Kind::Name(_) => "the part itself is not finite: limit it, as in min(a, 1000)",
            _ => "keep its parts in bounds with min(...) and max(...)",
        }
    }
}

fn starts_value(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '`' | '.')
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    depth: usize,
    terms: usize,
}

/// How strongly an operator binds what stands on its left and on its right.
fn strength(operator: char) -> Option<(u8, u8)> {
    match operator {
        '+' | '-' => Some((1, 2)),
        '*' | '/' => Some((3, 4)),
        // From the right: 2 ^ 3 ^ 2 is 2 ^ (3 ^ 2); stronger than a sign: -x ^ 2 is -(x ^ 2).
        '^' => Some((8, 7)),
        _ => None,
    }
}
const SIGN: u8 = 5;

impl Parser<'_> {
    /// The next letter that is no blank.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn here(&self, message: impl Into<String>, help: impl Into<String>) -> Mistake {
        let width = self.text[self.at..].chars().next().map_or(0, char::len_utf8);
        Mistake { message: message.into(), help: help.into(), span: self.at..self.at + width }
    }

    fn stray(&self) -> Mistake {
        let stray = self.text[self.at..].chars().next().unwrap_or(' ');
        let help =
            "expressions have numbers, names of models, + - * / ^, parentheses, and min, max, exp, ln, sqrt, abs";
        self.here(format!("`{stray}` has no meaning here"), help)
    }

    /// Terms joined by operators that bind more strongly than `least`.
    fn sum(&mut self, least: u8) -> Result<Term, Mistake> {
        let mut left = self.value()?;
        while let Some(operator) = self.peek() {
            let Some((_, after)) = strength(operator).filter(|(before, _)| *before >= least) else { break };
            self.at += 1;
            let right = self.deeper(|parser| parser.sum(after))?;
            let span = left.span.start..right.span.end;
            left = self.term(Kind::Pair(operator, Box::new([left, right])), span)?;
        }
        Ok(left)
    }

    fn value(&mut self) -> Result<Term, Mistake> {
        let start = match self.peek() {
            None if self.text.trim().is_empty() => {
                return Err(self.here("the expression is empty", "for example: \"1 - rigid\""));
            }
            None => return Err(self.here("a value is missing at the end", "a number, a model's name, or a part")),
            Some(_) => self.at,
        };
        match self.peek().unwrap_or(' ') {
            sign @ ('-' | '+') => {
                self.at += 1;
                let term = self.deeper(|parser| parser.sum(SIGN))?;
                let span = start..term.span.end;
                if sign == '-' { self.term(Kind::Negated(Box::new(term)), span) } else { Ok(term) }
            }
            '(' => {
                self.at += 1;
                let inner = self.deeper(|parser| parser.sum(0))?;
                self.close(start)?;
                Ok(Term { span: start..self.at, ..inner })
            }
            first if first.is_ascii_digit() || first == '.' => self.number(),
            first if first.is_alphabetic() || matches!(first, '_' | '`') => self.name(),
            '*' | '/' | '^' | ')' | ',' => {
                Err(self.here("needed a value before this", "a number, a model's name, or a part"))
            }
            _ => Err(self.stray()),
        }
    }

    fn close(&mut self, open: usize) -> Result<(), Mistake> {
        match self.peek() {
            Some(')') => {
                self.at += 1;
                Ok(())
            }
            None => Err(Mistake {
                message: "this parenthesis is never closed".into(),
                help: "add `)` where it ends".into(),
                span: open..open + 1,
            }),
            Some(other) if starts_value(other) || other == '(' => {
                Err(self.here("needed an operator before this", "to multiply, write `*`"))
            }
            Some(',') => Err(self.here("a comma separates the arguments of a function only", "functions: min, max")),
            Some(_) => Err(self.stray()),
        }
    }

    fn number(&mut self) -> Result<Term, Mistake> {
        let start = self.at;
        let rest = &self.text.as_bytes()[start..];
        let digits = |from: usize| rest[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let mut length = digits(0);
        if rest.get(length) == Some(&b'.') {
            length += 1 + digits(length + 1);
        }
        if matches!(rest.get(length), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(rest.get(length + 1), Some(b'+' | b'-')));
            let exponent = digits(length + 1 + sign);
            length += if exponent > 0 { 1 + sign + exponent } else { 0 };
        }
        self.at += length;
        let span = start..self.at;
        match self.text[span.clone()].parse::<f64>() {
            Ok(number) if number.is_finite() => self.term(Kind::Number(number), span),
            _ => Err(Mistake {
                message: format!("`{}` is not a number that can be held", &self.text[span.clone()]),
                help: "for example: 0.5, 2, 1e-3".into(),
                span,
            }),
        }
    }

    /// A plain word, or anything in back-quotes.
    fn word(&mut self) -> Result<String, Mistake> {
        let start = self.at;
        let rest = &self.text[start..];
        if let Some(quoted) = rest.strip_prefix('`') {
            let Some(length) = quoted.find('`') else {
                return Err(self.here("this back-quote is never closed", "add another one behind the name"));
            };
            self.at += length + 2;
            return Ok(quoted[..length].to_owned());
        }
        let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if length == 0 {
            return Err(self.here("needed the name of a part", "for example: revolute.circle_fit"));
        }
        self.at += length;
        Ok(rest[..length].to_owned())
    }

    fn name(&mut self) -> Result<Term, Mistake> {
        let start = self.at;
        let model = self.word()?;
        if self.text[self.at..].starts_with('.') {
            self.at += 1;
            let part = Some(self.word()?);
            let span = start..self.at;
            return self.term(Kind::Name(Name { model, part, span: span.clone() }), span);
        }
        let span = start..self.at;
        if self.peek() != Some('(') {
            self.at = span.end;
            return self.term(Kind::Name(Name { model, part: None, span: span.clone() }), span);
        }
        let Some((_, function)) = FUNCTIONS.iter().find(|(name, _)| *name == model) else {
            let known = FUNCTIONS.map(|(name, _)| format!("`{name}`")).join(", ");
            return Err(Mistake {
                message: format!("unknown function `{model}`"),
                help: format!("functions: {known}; to multiply by a parenthesis, write `*`"),
                span,
            });
        };
        self.call(*function, &model, span)
    }

    fn call(&mut self, function: Function, name: &str, span: Range<usize>) -> Result<Term, Mistake> {
        let open = self.at;
        self.at += 1;
        let mut arguments = vec![self.deeper(|parser| parser.sum(0))?];
        while self.peek() == Some(',') {
            self.at += 1;
            arguments.push(self.deeper(|parser| parser.sum(0))?);
        }
        self.close(open)?;
        let span = span.start..self.at;
        let many = matches!(function, Function::Min | Function::Max);
        if many == (arguments.len() > 1) {
            return self.term(Kind::Call(function, arguments), span);
        }
        let needed = if many { "two values or more" } else { "one value" };
        let message = format!("`{name}` takes {needed}, found {}", arguments.len());
        let help = if many { "for example: max(rigid, prismatic)" } else { "for example: exp(-2 * rigid)" };
        Err(Mistake { message, help: help.into(), span })
    }

    fn term(&mut self, kind: Kind, span: Range<usize>) -> Result<Term, Mistake> {
        self.terms += 1;
        if self.terms > MOST_TERMS {
            let message = format!("the expression has more than {MOST_TERMS} terms");
            return Err(Mistake { message, help: "split it, or write it shorter".into(), span });
        }
        Ok(Term { kind, span })
    }

    fn deeper<T>(&mut self, parse: impl FnOnce(&mut Self) -> Result<T, Mistake>) -> Result<T, Mistake> {
        self.depth += 1;
        if self.depth > DEEPEST {
            let message = format!("the expression is nested more than {DEEPEST} deep");
            return Err(self.here(message, "write it flatter"));
        }
        let parsed = parse(self);
        self.depth -= 1;
        parsed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        let values = |name: &Name| match (name.model.as_str(), name.part.as_deref()) {
            ("a", None) => 0.5,
            ("thesis-rigid", Some("ratio")) => 3.0,
            ("big", None) => f64::INFINITY,
            other => panic!("{other:?}"),
        };
        Expression::parse(text).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}")).value(&values)
    }

    #[test]
    fn arithmetic_binds_as_in_print() {
        for (text, expected) in [
            ("1 - 2 - 3", -4.0),
            ("8 / 4 / 2", 1.0),
            ("1 + 2 * 3 ^ 2", 19.0),
            ("2 ^ 3 ^ 2", 512.0),
            ("-2 ^ 2", -4.0),
            ("2 * -3", -6.0),
            ("2 ^ -1", 0.5),
            ("- - 2", 2.0),
            ("(1 - a) * (1 - a)", 0.25),
            ("`thesis-rigid`.ratio-a", 2.5),
            ("min(a, 2, 0.25) + max(1, a)", 1.25),
            ("exp(ln(2)) + sqrt(4) + abs(-1)", 5.0),
            ("1.5e1 + .5 + 2.", 17.5),
            ("exp(-big)", 0.0),
        ] {
            assert!((value(text) - expected).abs() < 1e-14, "{text}: {}", value(text));
        }
    }

    #[test]
    fn mistakes_have_their_exact_place() {
        for (text, message, at) in [
            ("", "the expression is empty", ""),
            ("1 -", "a value is missing at the end", ""),
            ("(1 - a", "this parenthesis is never closed", "("),
            ("1 - (a))", "nothing opens this parenthesis", ")"),
            ("a b", "needed an operator before this", "b"),
            ("2 a", "needed an operator before this", "a"),
            ("a * * 2", "needed a value before this", "*"),
            ("a; b", "`;` has no meaning here", ";"),
            ("a > b", "`>` has no meaning here", ">"),
            ("foo(a)", "unknown function `foo`", "foo"),
            ("a(1)", "unknown function `a`", "a"),
            ("min(a)", "`min` takes two values or more, found 1", "min(a)"),
            ("exp(a, a)", "`exp` takes one value, found 2", "exp(a, a)"),
            ("1, 2", "a comma separates the arguments of a function only", ","),
            ("`a", "this back-quote is never closed", "`"),
            ("a. + 1", "needed the name of a part", " "),
            ("1e999", "`1e999` is not a number that can be held", "1e999"),
            ("1 + ü€", "`€` has no meaning here", "€"),
        ] {
            let mistake = Expression::parse(text).expect_err(text);
            assert_eq!((mistake.message.as_str(), &text[mistake.span]), (message, at), "{text}");
        }
    }

    #[test]
    fn what_is_too_deep_or_too_long_is_refused() {
        let deep = format!("{}1{}", "(".repeat(100_000), ")".repeat(100_000));
        assert!(Expression::parse(&deep).expect_err("deep").message.contains("nested"));
        assert!(Expression::parse(&"-".repeat(100_000)).expect_err("deep").message.contains("nested"));
        let long = vec!["1"; 100_000].join("+");
        assert!(Expression::parse(&long).expect_err("long").message.contains("terms"));
        assert_eq!(value(&vec!["1"; 400].join("+")), 400.0);
    }

    #[test]
    fn the_innermost_term_that_is_not_finite_is_the_culprit() {
        let values = |name: &Name| if name.model == "a" { 0.0 } else { 1.0 };
        for (text, at, remedy) in [
            ("b + 2 * (1 / a) - b", "(1 / a)", "the divisor is 0"),
            ("ln(-b)", "ln(-b)", "`ln` needs a number above 0"),
            ("min(b, sqrt(-b))", "sqrt(-b)", "`sqrt` needs 0 or more"),
            ("b + exp(999 * b)", "exp(999 * b)", "keep its parts in bounds"),
        ] {
            let expression = Expression::parse(text).expect("sound");
            assert!(!expression.value(&values).is_finite(), "{text}");
            let (culprit, help) = expression.culprit(&values);
            assert_eq!(&text[culprit], at);
            assert!(help.starts_with(remedy), "{text}: {help}");
        }
    }

    #[test]
    fn names_are_replaced_by_their_values() {
        let expression = Expression::parse("(1 - rigid) * revolute.circle_fit").expect("sound");
        assert_eq!(expression.worked(&|name| if name.part.is_some() { 0.25 } else { 0.5 }), "(1 - 0.500) * 0.250");
    }
}
