//! Files that are cut off, have flipped bits, or lie end in an answer or an error, in bounded time and memory.

#![expect(clippy::cast_possible_truncation, reason = "samples are few and small")]

mod samples;

use std::fs;
use std::time::{Duration, Instant};

use jointscope_recordings::{Format, Grouping, Markers, ReadOptions, group, inspect, read_markers};
use samples::{C3d, Numbers, Processor};

/// Versions of every file and kind of damage.
const VERSIONS: usize = 150;

/// Samples that a file may give per byte, or always.
const SAMPLES_PER_BYTE: usize = 64;
const ALWAYS: usize = 1_000_000;

/// No small file takes so long.
const LONGEST: Duration = Duration::from_secs(5);

/// A simple generator of numbers, the same everywhere (xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit.max(1) as u64) as usize
    }
}

type Damage = fn(&[u8], &mut Random) -> Vec<u8>;

fn cut(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    bytes[..random.below(bytes.len())].to_vec()
}

fn flip(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len());
        bytes[at] ^= 1 << random.below(8);
    }
    bytes
}

/// Numbers that promise more, or other things, than there are, most of them near the beginning, where headers are.
fn lie(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let reach = if random.below(3) == 0 { bytes.len() } else { bytes.len().min(1200) };
    if bytes.is_ascii() {
        let digits: Vec<usize> = (0..reach).filter(|&at| bytes[at].is_ascii_digit()).collect();
        let at = digits.get(random.below(digits.len())).copied().unwrap_or(0);
        let lies: [&[u8]; 8] = [b"18446744073709551615", b"-1", b"1e308", b"nan", b"inf", b"0", b"", b"9e18"];
        bytes.splice(at..=at, lies[random.below(lies.len())].iter().copied());
    } else {
        let at = random.below(reach.saturating_sub(8));
        let lies: [&[u8]; 6] = [&[255; 2], &[255; 4], &[255, 127], &[0; 4], &[0, 128], &[255; 8]];
        let lie = lies[random.below(lies.len())];
        bytes[at..at + lie.len()].copy_from_slice(lie);
    }
    bytes
}

/// A piece moved elsewhere.
fn shuffle(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let (from, length) = (random.below(bytes.len()), random.below(64));
    let piece = bytes[from..(from + length).min(bytes.len())].to_vec();
    let at = random.below(bytes.len());
    [&bytes[..at], &piece, &bytes[at..]].concat()
}

fn originals() -> Vec<(&'static str, Format, Vec<u8>)> {
    let c3d = |processor, numbers| C3d::of(processor, numbers).bytes();
    #[cfg_attr(not(feature = "parquet"), expect(unused_mut, reason = "more follow"))]
    let mut files = vec![
        ("a.csv", Format::Csv, samples::csv_of_points()),
        ("b.csv", Format::Csv, samples::csv_of_poses()),
        ("a.log", Format::Poses, samples::tum().into()),
        ("a.npz", Format::Npz, samples::npz()),
        ("a.c3d", Format::C3d, c3d(Processor::Intel, Numbers::Real)),
        ("b.c3d", Format::C3d, c3d(Processor::Dec, Numbers::Integer)),
        ("c.c3d", Format::C3d, c3d(Processor::Sgi, Numbers::Real)),
        ("a.trc", Format::Trc, samples::trc().into()),
        ("a.tsv", Format::Qualisys, samples::qualisys().into()),
        ("c.csv", Format::Vicon, samples::vicon().into()),
        ("d.csv", Format::Motive, samples::motive().into()),
        ("e.csv", Format::Euroc, samples::euroc().into()),
    ];
    #[cfg(feature = "parquet")]
    files.extend(samples::in_columns().map(|(name, bytes)| (name, Format::Parquet, bytes)));
    files
}

/// Reads a file, looks at it and puts its markers together.
fn all_that_is_done(path: &std::path::Path, options: &ReadOptions) -> Option<Markers> {
    let markers = read_markers(path, options).ok()?;
    inspect(&markers, path, true);
    for grouping in [Grouping::Own, Grouping::All, Grouping::Suggested] {
        let _ = group(markers.clone(), &grouping, path);
    }
    Some(markers)
}

#[test]
fn damaged_files_end_in_an_answer_or_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut random = Random(20_250_806);
    let (mut answers, mut errors) = (0, 0);
    let originals = originals();
    for (name, format, bytes) in &originals {
        let path = folder.path().join(name);
        for damage in [cut as Damage, flip, lie, shuffle] {
            for version in 0..VERSIONS {
                let damaged = damage(bytes, &mut random);
                fs::write(&path, &damaged).expect("written");
                // The format is also given, so that damage to its mark does not spare its reader.
                let format = (version % 2 == 0).then_some(*format);
                let start = Instant::now();
                let found = all_that_is_done(&path, &ReadOptions { format, ..ReadOptions::default() });
                assert!(start.elapsed() < LONGEST, "{name}, version {version}: took {:?}", start.elapsed());
                if let Some(markers) = found {
                    answers += 1;
                    let samples = markers.positions.len();
                    assert!(samples <= ALWAYS.max(SAMPLES_PER_BYTE * damaged.len()), "{name}: {samples} samples");
                    assert_eq!(samples, markers.frames() * markers.markers.len(), "{name}");
                } else {
                    errors += 1;
                }
            }
        }
    }
    println!("{answers} answers, {errors} errors");
    assert_eq!(answers + errors, originals.len() * 4 * VERSIONS);
    assert!(answers > 500 && errors > 2000, "{answers} answers, {errors} errors");
}

#[test]
fn every_file_cut_off_at_every_length_of_its_header_is_no_panic() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, format, bytes) in originals() {
        let path = folder.path().join(name);
        for length in 0..bytes.len().min(700) {
            fs::write(&path, &bytes[..length]).expect("written");
            let _ = read_markers(&path, &ReadOptions { format: Some(format), ..ReadOptions::default() });
        }
    }
}

#[test]
fn a_c3d_file_cannot_promise_more_frames_than_it_has() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.c3d");
    let mut bytes = C3d::PLAIN.bytes();
    bytes[2..10].copy_from_slice(&[255; 8]);
    bytes[6..8].copy_from_slice(&[1, 0]);
    fs::write(&path, &bytes).expect("written");
    let error = read_markers(&path, &ReadOptions::default()).expect_err("a lie").to_string();
    assert!(error.contains("needed 65535 frames of 65535 points, found 0; the file is cut off"), "{error}");
}
