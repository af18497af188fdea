//! A writer of C3D files, independent of the reader.

use super::{FRAMES, NAMES, millimetres};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Processor {
    Intel,
    Dec,
    Sgi,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Numbers {
    Integer,
    Real,
}

/// How a file is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct C3d {
    pub(crate) processor: Processor,
    pub(crate) numbers: Numbers,
    /// Analogue samples after the points of a frame.
    pub(crate) analogue: u16,
    /// Names that LABELS has; the rest goes to LABELS2.
    pub(crate) first_labels: usize,
    pub(crate) unit: Option<&'static str>,
    pub(crate) first_frame: u16,
}

impl C3d {
    pub(crate) const PLAIN: Self = Self {
        processor: Processor::Intel,
        numbers: Numbers::Real,
        analogue: 3,
        first_labels: NAMES.len(),
        unit: Some("mm"),
        first_frame: 4,
    };

    pub(crate) fn of(processor: Processor, numbers: Numbers) -> Self {
        Self { processor, numbers, ..Self::PLAIN }
    }

    fn word(self, value: u16) -> [u8; 2] {
        if self.processor == Processor::Sgi { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn float(self, value: f32) -> [u8; 4] {
        match self.processor {
            Processor::Intel => value.to_le_bytes(),
            Processor::Sgi => value.to_be_bytes(),
            Processor::Dec => {
                let [a, b, c, d] = (value * 4.).to_le_bytes();
                [c, d, a, b]
            }
        }
    }

    /// One coordinate or residual.
    fn sample(self, value: f32) -> Vec<u8> {
        match self.numbers {
            Numbers::Real => self.float(value).to_vec(),
            Numbers::Integer => self.word((value as i16).cast_unsigned()).to_vec(),
        }
    }

    pub(crate) fn bytes(self) -> Vec<u8> {
        const BLOCK: usize = 512;

        let mut parameters = vec![1, 80, 0, [84, 85, 86][self.processor as usize]];
        let mut entry = |name: &str, number: i8, content: &[u8]| {
            parameters.push(u8::try_from(name.len()).expect("short"));
            parameters.push(number.cast_unsigned());
            parameters.extend(name.bytes());
            let distance = u16::try_from(2 + content.len()).expect("short");
            parameters.extend(self.word(distance));
            parameters.extend(content);
        };
        let text = |lines: &[&str]| {
            let width = lines.iter().map(|line| line.len()).max().unwrap_or(1);
            let mut content =
                vec![255, 2, u8::try_from(width).expect("short"), u8::try_from(lines.len()).expect("few")];
            for line in lines {
                content.extend(format!("{line:<width$}").bytes());
            }
            content.push(0);
            content
        };
        let word = |value: u16| [&[2, 0][..], &self.word(value), &[0]].concat();
        let float = |value: f32| [&[4, 0][..], &self.float(value), &[0]].concat();
        entry("POINT", -1, &[0]);
        entry("USED", 1, &word(NAMES.len() as u16));
        entry("SCALE", 1, &float(if self.numbers == Numbers::Real { -1. } else { 1. }));
        entry("RATE", 1, &float(50.));
        entry("DATA_START", 1, &word(4));
        entry("LABELS", 1, &text(&NAMES[..self.first_labels]));
        if self.first_labels < NAMES.len() {
            entry("LABELS2", 1, &text(&NAMES[self.first_labels..]));
        }
        if let Some(unit) = self.unit {
            entry("UNITS", 1, &text(&[unit]));
        }
        parameters.push(0);
        assert!(parameters.len() <= 2 * BLOCK);
        parameters[2] = 2;
        parameters.resize(2 * BLOCK, 0);

        let mut bytes = vec![2, 80];
        for value in [NAMES.len() as u16, self.analogue, self.first_frame, self.first_frame + FRAMES as u16 - 1] {
            bytes.extend(self.word(value));
        }
        bytes.resize(BLOCK, 0);
        bytes.extend(parameters);
        for frame in 0..FRAMES {
            for marker in 0..NAMES.len() {
                // Every other missing sample lies at the origin, as some programs write it.
                let lost = if frame % 2 == 0 { [0., 0., 0., 0.] } else { [5., 5., 5., -1.] };
                let sample = millimetres(frame, marker).map_or(lost, |[x, y, z]| [x, y, z, 0.]);
                for value in sample {
                    bytes.extend(self.sample(value as f32));
                }
            }
            (0..self.analogue).for_each(|channel| bytes.extend(self.sample(f32::from(channel))));
        }
        bytes
    }
}
