//! Thrift's compact protocol, in which Parquet writes what it says about its data:
//! <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>.

/// Structures in one another, beyond which a file is not sound; Parquet has fewer than ten.
const DEEPEST: u8 = 32;

/// A value, as far as it matters here.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Truth,
    Whole(i64),
    Text,
    List(Vec<Self>),
    Structure(Structure),
    Other,
}

/// The fields of a structure by their numbers; of a repeated field the last one counts.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Structure(Vec<(i64, Value)>);

impl Structure {
    /// Reads a structure from the beginning of `bytes`, which then begin behind it; `None` if they are no structure.
    pub(super) fn read(bytes: &mut &[u8]) -> Option<Self> {
        structure(bytes, DEEPEST)
    }

    pub(super) fn get(&self, number: i64) -> Option<&Value> {
        self.0.iter().rev().find(|(other, _)| *other == number).map(|(_, value)| value)
    }

    /// A whole number of 32 bits, if the field is one.
    pub(super) fn whole(&self, number: i64) -> Option<i32> {
        match self.get(number) {
            Some(Value::Whole(value)) => i32::try_from(*value).ok(),
            _ => None,
        }
    }

    /// Whether all fields that are there are as needed.
    pub(super) fn all(&self, as_needed: impl Fn(i64, &Value) -> bool) -> bool {
        self.0.iter().all(|(number, value)| as_needed(*number, value))
    }
}

fn structure(bytes: &mut &[u8], depth: u8) -> Option<Structure> {
    let (mut fields, mut number) = (Vec::new(), 0_i64);
    loop {
        let head = byte(bytes)?;
        let (step, kind) = (head >> 4, head & 15);
        if kind == 0 {
            return Some(Structure(fields));
        }
        number = if step == 0 { whole(bytes)? } else { number.checked_add(step.into())? };
        // Truths have no byte of their own.
        fields.push((number, if kind <= 2 { Value::Truth } else { value(bytes, kind, depth.checked_sub(1)?)? }));
    }
}

fn value(bytes: &mut &[u8], kind: u8, depth: u8) -> Option<Value> {
    Some(match kind {
        1 | 2 => byte(bytes).map(|_| Value::Truth)?,
        3 => byte(bytes).map(|_| Value::Other)?,
        4..=6 => Value::Whole(whole(bytes)?),
        7 => skipped(bytes, 8)?,
        8 => {
            let length = usize::try_from(unsigned(bytes)?).ok()?;
            skipped(bytes, length).map(|_| Value::Text)?
        }
        9 | 10 => {
            let head = byte(bytes)?;
            let length = if head >> 4 == 15 { unsigned(bytes)? } else { u64::from(head >> 4) };
            let element = |_| value(bytes, head & 15, depth.checked_sub(1)?);
            Value::List((0..length).map(element).collect::<Option<_>>()?)
        }
        11 => {
            let length = unsigned(bytes)?;
            let kinds = if length == 0 { 0 } else { byte(bytes)? };
            for _ in 0..length {
                value(bytes, kinds >> 4, depth.checked_sub(1)?)?;
                value(bytes, kinds & 15, depth.checked_sub(1)?)?;
            }
            Value::Other
        }
        12 => Value::Structure(structure(bytes, depth)?),
        13 => skipped(bytes, 16)?,
        _ => return None,
    })
}

fn byte(bytes: &mut &[u8]) -> Option<u8> {
    let (first, rest) = bytes.split_first()?;
    *bytes = rest;
    Some(*first)
}

fn skipped(bytes: &mut &[u8], length: usize) -> Option<Value> {
    *bytes = bytes.get(length..)?;
    Some(Value::Other)
}

/// A number in groups of seven bits, the lowest first.
fn unsigned(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let next = byte(bytes)?;
        number |= u64::from(next & 127) << shift;
        if next < 128 {
            return Some(number);
        }
    }
    None
}

/// A number whose lowest bit is its sign.
fn whole(bytes: &mut &[u8]) -> Option<i64> {
    let folded = unsigned(bytes)?;
    Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn structures_are_read_up_to_their_end() {
        let mut bytes: &[u8] =
            &[0x15, 3, 0x11, 0x19, 0x25, 2, 4, 0x1c, 0x15, 0x80, 1, 0, 0x18, 2, b'o', b'k', 0x05, 40, 5, 0, 9];
        let found = Structure::read(&mut bytes).expect("sound");
        assert_eq!(bytes, [9]);
        assert_eq!((found.whole(1), found.get(2)), (Some(-2), Some(&Value::Truth)));
        assert_eq!(found.get(3), Some(&Value::List(vec![Value::Whole(1), Value::Whole(2)])));
        let Some(Value::Structure(inner)) = found.get(4) else { panic!("a structure") };
        assert_eq!(inner.whole(1), Some(64));
        assert_eq!((found.get(5), found.whole(20), found.get(6)), (Some(&Value::Text), Some(-3), None));
    }

    #[test]
    fn what_is_cut_off_or_has_no_end_is_no_structure() {
        let endless = vec![0x1c; 100_000];
        let list = [0x19, 0xf0, 255, 255, 255, 255, 15];
        let number = [[0x16].as_slice(), &[255; 11]].concat();
        for mut bytes in [&[][..], &[0x15], &[0x18, 200, 1, 0], &endless, &list, &number, &[0x1e, 0]] {
            assert_eq!(Structure::read(&mut bytes), None);
        }
    }
}
