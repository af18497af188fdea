//! Numbers as the three kinds of processors wrote them.

use super::{CUT, quoted};

/// Whose numbers a file holds.
#[derive(Clone, Copy)]
pub(super) enum Processor {
    Intel,
    Dec,
    Sgi,
}

impl Processor {
    pub(super) fn of(byte: u8) -> Result<Self, String> {
        match byte {
            84 => Ok(Self::Intel),
            85 => Ok(Self::Dec),
            86 => Ok(Self::Sgi),
            other => {
                let other = quoted(&other.to_string());
                Err(format!("needed processor 84 (Intel), 85 (DEC) or 86 (SGI), found {other}; the file is damaged"))
            }
        }
    }
}

/// The numbers of a file.
pub(super) struct Numbers<'a> {
    pub bytes: &'a [u8],
    pub processor: Processor,
}

impl Numbers<'_> {
    pub(super) fn at<const N: usize>(&self, at: usize) -> Result<[u8; N], String> {
        self.bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().ok_or_else(|| CUT.into())
    }

    pub(super) fn unsigned(&self, at: usize) -> Result<u16, String> {
        Ok(match self.processor {
            Processor::Intel | Processor::Dec => u16::from_le_bytes(self.at(at)?),
            Processor::Sgi => u16::from_be_bytes(self.at(at)?),
        })
    }

    pub(super) fn float(&self, at: usize) -> Result<f64, String> {
        let bytes: [u8; 4] = self.at(at)?;
        Ok(f64::from(match self.processor {
            Processor::Intel => f32::from_le_bytes(bytes),
            Processor::Sgi => f32::from_be_bytes(bytes),
            // The halves are swapped, and the exponent is counted from another number.
            Processor::Dec => f32::from_le_bytes([bytes[2], bytes[3], bytes[0], bytes[1]]) / 4.,
        }))
    }
}
