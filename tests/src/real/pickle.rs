//! Python's pickles of protocol 0, as far as lists, tuples, dictionaries, numbers and text go. Nothing in a file is
//! executed: objects stay opaque, except numpy's scalars, whose eight bytes are a number.
//!
//! A pickle is a program of one-letter instructions, some with arguments that end at the line's end, for a machine with
//! a stack and a memory; what it leaves on the stack is the value.

use std::collections::BTreeMap;

/// What a pickle holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    List(Vec<Value>),
    Dictionary(Vec<(Value, Value)>),
    Number(f64),
    Text(Vec<u8>),
    /// A class or function, by module and name.
    Named(String),
    Opaque,
}

impl Value {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, String> {
        Machine { bytes, at: 0, stack: Vec::new(), memory: BTreeMap::new() }.run()
    }

    /// The entry of a list.
    pub(super) fn entry(&self, index: usize) -> Result<&Self, String> {
        match self {
            Self::List(values) => values.get(index).ok_or_else(|| format!("no entry {index}")),
            _ => Err("needed a list".into()),
        }
    }

    /// The entry of a dictionary.
    pub(super) fn key(&self, key: &str) -> Result<&Self, String> {
        let Self::Dictionary(entries) = self else { return Err("needed a dictionary".into()) };
        let is_meant = |name: &Value| matches!(name, Self::Text(text) if text == key.as_bytes());
        entries.iter().find(|(name, _)| is_meant(name)).map(|(_, value)| value).ok_or_else(|| format!("no key `{key}`"))
    }

    /// The rows of a list of lists of numbers.
    pub(super) fn rows<const N: usize>(&self) -> Result<Vec<[f64; N]>, String> {
        let number = |value: &Value| match value {
            Self::Number(number) => Ok(*number),
            other => Err(format!("needed a number, found {other:?}")),
        };
        let row = |value: &Value| {
            let Self::List(values) = value else { return Err("needed a row".into()) };
            let row: Vec<f64> = values.iter().map(number).collect::<Result<_, _>>()?;
            row.try_into().map_err(|row: Vec<f64>| format!("needed {N} numbers in a row, found {}", row.len()))
        };
        let Self::List(rows) = self else { return Err("needed a list of rows".into()) };
        rows.iter().map(row).collect()
    }
}

/// What is on the stack.
enum Item {
    Mark,
    Value(Value),
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Item>,
    memory: BTreeMap<&'a [u8], Value>,
}

impl<'a> Machine<'a> {
    fn run(mut self) -> Result<Value, String> {
        loop {
            let instruction = *self.bytes.get(self.at).ok_or("the pickle is cut off")?;
            self.at += 1;
            match instruction {
                b'.' => return self.pop(),
                b'(' => self.stack.push(Item::Mark),
                b'F' | b'I' => {
                    let number = self.text_line()?.parse().map_err(|_| "needed a number")?;
                    self.push(Value::Number(number));
                }
                b'S' => {
                    let text = unquoted(self.line()?)?;
                    self.push(Value::Text(text));
                }
                b'N' => self.push(Value::Opaque),
                b'c' => {
                    let name = format!("{}.{}", self.text_line()?, self.text_line()?);
                    self.push(Value::Named(name));
                }
                b'l' | b't' => {
                    let values = self.pop_to_mark()?;
                    self.push(Value::List(values));
                }
                b'd' => {
                    let values = self.pop_to_mark()?;
                    let (pairs, rest) = values.as_chunks::<2>();
                    if !rest.is_empty() {
                        return Err("a key without value".into());
                    }
                    let entries = pairs.iter().map(|[key, value]| (key.clone(), value.clone())).collect();
                    self.push(Value::Dictionary(entries));
                }
                b'a' => {
                    let value = self.pop()?;
                    let Some(Item::Value(Value::List(list))) = self.stack.last_mut() else {
                        return Err("nothing to append to".into());
                    };
                    list.push(value);
                }
                b's' => {
                    let (value, key) = (self.pop()?, self.pop()?);
                    let Some(Item::Value(Value::Dictionary(entries))) = self.stack.last_mut() else {
                        return Err("no dictionary to set in".into());
                    };
                    entries.push((key, value));
                }
                b'R' => {
                    let (arguments, function) = (self.pop()?, self.pop()?);
                    self.push(made(&function, &arguments));
                }
                // What an object is built from says nothing about a number.
                b'b' => drop(self.pop()?),
                b'p' => self.remember()?,
                b'g' => {
                    let key = self.line()?;
                    let value = self.memory.get(key).ok_or("needed what may not change, or is not known")?.clone();
                    self.push(value);
                }
                other => return Err(format!("instruction `{}` is not understood", char::from(other))),
            }
        }
    }

    /// Remembers the top of the stack. Lists and dictionaries, which change afterwards, are not remembered.
    fn remember(&mut self) -> Result<(), String> {
        let key = self.line()?;
        match self.stack.last() {
            Some(Item::Value(Value::List(_) | Value::Dictionary(_))) => {}
            Some(Item::Value(value)) => drop(self.memory.insert(key, value.clone())),
            _ => return Err("nothing to remember".into()),
        }
        Ok(())
    }

    fn line(&mut self) -> Result<&'a [u8], String> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|byte| *byte == b'\n').ok_or("the pickle is cut off")?;
        self.at += end + 1;
        Ok(&rest[..end])
    }

    fn text_line(&mut self) -> Result<&'a str, String> {
        std::str::from_utf8(self.line()?).map_err(|error| error.to_string())
    }

    fn push(&mut self, value: Value) {
        self.stack.push(Item::Value(value));
    }

    fn pop(&mut self) -> Result<Value, String> {
        match self.stack.pop() {
            Some(Item::Value(value)) => Ok(value),
            _ => Err("the stack is empty".into()),
        }
    }

    fn pop_to_mark(&mut self) -> Result<Vec<Value>, String> {
        let mut values = Vec::new();
        loop {
            match self.stack.pop() {
                Some(Item::Value(value)) => values.push(value),
                Some(Item::Mark) => break,
                None => return Err("no mark".into()),
            }
        }
        values.reverse();
        Ok(values)
    }
}

/// What a function would give: a number for numpy's scalars, otherwise nothing that is looked into.
fn made(function: &Value, arguments: &Value) -> Value {
    let (Value::Named(name), Value::List(arguments)) = (function, arguments) else { return Value::Opaque };
    match (name.as_str(), &arguments[..]) {
        ("numpy.core.multiarray.scalar", [_, Value::Text(bytes)]) => {
            bytes.as_slice().try_into().map_or(Value::Opaque, |bytes| Value::Number(f64::from_le_bytes(bytes)))
        }
        _ => Value::Opaque,
    }
}

/// The bytes of a quoted text with Python's escapes.
fn unquoted(text: &[u8]) -> Result<Vec<u8>, String> {
    let ([quote @ (b'\'' | b'"'), inside @ .., end], true) = (text, text.len() >= 2) else {
        return Err("needed a quoted text".into());
    };
    if quote != end {
        return Err("a quote does not end".into());
    }
    let mut bytes = Vec::new();
    let mut rest = inside.iter();
    while let Some(&byte) = rest.next() {
        if byte != b'\\' {
            bytes.push(byte);
            continue;
        }
        bytes.push(match rest.next() {
            Some(b'n') => b'\n',
            Some(b'r') => b'\r',
            Some(b't') => b'\t',
            Some(b'x') => {
                let digits = [rest.next(), rest.next()].map(|digit| char::from(*digit.unwrap_or(&b' ')).to_digit(16));
                let [Some(high), Some(low)] = digits else { return Err("needed two digits after \\x".into()) };
                u8::try_from(16 * high + low).map_err(|error| error.to_string())?
            }
            Some(&same @ (b'\\' | b'\'' | b'"')) => same,
            other => return Err(format!("escape {other:?} is not understood")),
        });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_in_a_dictionary_are_read() {
        let value = Value::parse(b"(dp1\nS'path'\np2\n(lp3\n(lp4\nF1.5\naI2\naas.").expect("sound");
        assert_eq!(value.key("path").expect("there").rows(), Ok(vec![[1.5, 2.0]]));
        assert!(value.key("other").is_err() && value.entry(0).is_err());
        assert!(value.key("path").expect("there").rows::<3>().is_err());
    }

    #[test]
    fn scalars_of_numpy_are_numbers_and_other_objects_are_opaque() {
        let scalar = b"cnumpy.core.multiarray\nscalar\np1\n(Ntp2\n0g1\n(NS'\\x00\\x00\\x00\\x00\\x00\\x00\\xf8?'\ntR.";
        assert!(Value::parse(scalar).is_err(), "instruction 0 is not known");
        let scalar = b"cnumpy.core.multiarray\nscalar\n(NS'\\x00\\x00\\x00\\x00\\x00\\x00\\xf8?'\ntR.";
        assert_eq!(Value::parse(scalar), Ok(Value::Number(1.5)));
        assert_eq!(Value::parse(b"cos\nsystem\n(S'true'\ntR."), Ok(Value::Opaque));
    }

    #[test]
    fn escapes_are_undone_and_what_is_cut_off_is_refused() {
        assert_eq!(Value::parse(b"S'\\'\\n\\x7fa'\n."), Ok(Value::Text(b"'\n\x7fa".into())));
        for cut in [&b""[..], b"S'a", b"S'\n.", b"S'\\x1'\n.", b"a.", b"l.", b"(S'a'\nd.", b"g1\n."] {
            assert!(Value::parse(cut).is_err(), "{cut:?}");
        }
    }
}
