use std::sync::Arc;

use jointscope_motion::Observation;
use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use super::*;

/// The cells of a column; `None` is null, in columns that are optional.
enum Cells {
    Int32(Vec<i32>),
    Int64(Vec<Option<i64>>),
    Double(Vec<Option<f64>>),
    Text(Vec<Option<&'static str>>),
}

use Cells::{Double, Int32, Int64, Text};

/// A file with these columns, in the words of Parquet's schemas.
fn file(schema: &str, columns: &[Cells], packing: Compression) -> Vec<u8> {
    let schema = Arc::new(parse_message_type(&format!("message m {{ {schema} }}")).expect("a schema"));
    let properties = Arc::new(WriterProperties::builder().set_compression(packing).build());
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties).expect("a writer");
    let mut group = writer.next_row_group().expect("a group");
    for cells in columns {
        let mut column = group.next_column().expect("a column").expect("as many columns as the schema has");
        let levels = |present: Vec<bool>| present.into_iter().map(i16::from).collect::<Vec<_>>();
        match cells {
            Int32(cells) => column.typed::<Int32Type>().write_batch(cells, None, None),
            Int64(cells) => {
                let values: Vec<i64> = cells.iter().flatten().copied().collect();
                let levels = levels(cells.iter().map(Option::is_some).collect());
                column.typed::<Int64Type>().write_batch(&values, Some(&levels), None)
            }
            Double(cells) => {
                let values: Vec<f64> = cells.iter().flatten().copied().collect();
                let levels = levels(cells.iter().map(Option::is_some).collect());
                column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)
            }
            Text(cells) => {
                let values: Vec<ByteArray> = cells.iter().flatten().map(|text| ByteArray::from(*text)).collect();
                let levels = levels(cells.iter().map(Option::is_some).collect());
                column.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)
            }
        }
        .expect("written");
        column.close().expect("closed");
    }
    group.close().expect("closed");
    writer.close().expect("closed");
    bytes
}

fn read(bytes: &[u8]) -> Result<Recording, RecordingError> {
    parse(bytes, Path::new("a.parquet"), Unit::Metre)
}

fn refused(bytes: &[u8]) -> String {
    read(bytes).expect_err("refused").to_string()
}

const POINTS: &str = "optional int64 frame; optional double time; optional binary body (UTF8);
    optional binary feature (UTF8); optional double x; optional double y; optional double z;";

/// A table of two rows, of which the second may be changed.
fn points(change: impl Fn(&mut [Cells])) -> Vec<u8> {
    let mut columns = [
        Int64(vec![Some(0), Some(7)]),
        Double(vec![Some(0.5), Some(1.)]),
        Text(vec![Some("door"), Some("door")]),
        Text(vec![Some("a"), Some("a")]),
        Double(vec![Some(1.), Some(4.)]),
        Double(vec![Some(2.), Some(5.)]),
        Double(vec![Some(3.), Some(6.)]),
    ];
    change(&mut columns);
    file(POINTS, &columns, Compression::UNCOMPRESSED)
}

fn seen(recording: &Recording) -> Vec<bool> {
    let Observation::Points { tracks, .. } = recording.bodies()[0].observation() else { panic!("points") };
    (0..tracks.frames()).map(|frame| tracks.is_visible(frame, 0)).collect()
}

#[test]
fn columns_of_any_type_that_holds_the_numbers_are_the_same_table() {
    let plain = read(&points(|_| ())).expect("plain");
    assert_eq!((plain.frame_numbers(), plain.times()), (&[0, 7][..], Some(&[0.5, 1.][..])));
    let schema = "required double Z; required double y; required double x; required int32 frame (UINT_8);
        required double __index_level_0__; required binary feature (ENUM); required binary body; required double time;";
    let column = |values: [f64; 2]| Double(values.map(Some).to_vec());
    let text = |text| Text(vec![Some(text); 2]);
    let columns = [
        column([3., 6.]),
        column([2., 5.]),
        column([1., 4.]),
        Int32(vec![0, 7]),
        column([8., 9.]),
        text("a"),
        text("door"),
        column([0.5, 1.]),
    ];
    for packing in [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::ZSTD(ZstdLevel::default())] {
        assert_eq!(read(&file(schema, &columns, packing)).expect("the same"), plain);
    }
}

#[test]
fn integers_are_names_and_numbers_up_to_their_last() {
    let schema = "required int64 frame (UINT_64); required int32 body; required int64 feature (UINT_64);
        required int32 x; required int32 y; required int32 z;";
    let columns = [
        Int64(vec![Some(-1)]),
        Int32(vec![-3]),
        Int64(vec![Some(-2)]),
        Int32(vec![1]),
        Int32(vec![2]),
        Int32(vec![-3]),
    ];
    let recording = read(&file(schema, &columns, Compression::UNCOMPRESSED)).expect("integers");
    assert_eq!((recording.frame_numbers(), recording.bodies()[0].name()), (&[u64::MAX][..], "-3"));
    let Observation::Points { labels, tracks } = recording.bodies()[0].observation() else { panic!("points") };
    assert_eq!(labels, &["18446744073709551614"]);
    assert_eq!(tracks.get(0, 0), Some(&Point3::new(1., 2., -3.)));
}

#[test]
fn nulls_and_nan_are_missing_samples_and_the_unit_scales() {
    let nan = points(|columns| columns[5] = Double(vec![Some(2.), Some(f64::NAN)]));
    let null = points(|columns| columns[6] = Double(vec![Some(3.), None]));
    for bytes in [nan, null] {
        assert_eq!(seen(&read(&bytes).expect("sound")), [true, false]);
    }
    let timeless = read(&points(|columns| columns[1] = Double(vec![None, None]))).expect("sound");
    assert_eq!(timeless.times(), None);
    let millimetres = parse(&points(|_| ()), Path::new("a.parquet"), Unit::Millimetre).expect("sound");
    let Observation::Points { tracks, .. } = millimetres.bodies()[0].observation() else { panic!("points") };
    assert_eq!(tracks.get(0, 0), Some(&Point3::new(0.001, 0.002, 0.003)));
}

#[test]
fn poses_are_told_by_their_quaternions() {
    let schema = "required int64 frame; required binary body (STRING); required double x; required double y;
        required double z; required double qx; required double qy; required double qz; required double qw;";
    let numbers = [1., 2., 3., 0., 0., 0.6].map(|value| Double(vec![Some(value)]));
    let columns = |qw| {
        let mut columns = vec![Int64(vec![Some(4)]), Text(vec![Some("tag")])];
        columns.extend(numbers.iter().map(|cells| match cells {
            Double(cells) => Double(cells.clone()),
            _ => unreachable!("doubles"),
        }));
        columns.push(Double(vec![Some(qw)]));
        file(schema, &columns, Compression::UNCOMPRESSED)
    };
    let recording = read(&columns(0.8)).expect("poses");
    let Observation::Poses(poses) = recording.bodies()[0].observation() else { panic!("poses") };
    assert_eq!(poses[0].expect("seen").translation.vector, nalgebra::Vector3::new(1., 2., 3.));
    assert!(refused(&columns(3.)).starts_with("a.parquet, row 1: needed a unit quaternion"));
}

#[test]
fn wrong_cells_are_refused_with_their_row_and_column() {
    let changed = |column: usize, cells: fn() -> Cells| refused(&points(|columns| columns[column] = cells()));
    for (found, start, end) in [
        (changed(0, || Int64(vec![Some(0), Some(-1)])), "column `frame`: needed a whole number", "found `-1`"),
        (changed(0, || Int64(vec![Some(0), None])), "column `frame`: needed a whole number", "found an empty cell"),
        (changed(2, || Text(vec![Some("door"), None])), "column `body`: needed a name", "found an empty cell"),
        (changed(3, || Text(vec![Some("a"), Some(" ")])), "column `feature`: needed a name", "found an empty cell"),
        (changed(4, || Double(vec![Some(1.), Some(f64::INFINITY)])), "column `x`: needed a finite number", "`inf`"),
        (changed(1, || Double(vec![Some(1.), Some(f64::NEG_INFINITY)])), "column `time`: needed a finite", "`-inf`"),
        (changed(0, || Int64(vec![Some(0), Some(0)])), "needed one time per frame, found 1 for frame 0", "in row 1"),
    ] {
        assert!(found.starts_with(&format!("a.parquet, row 2: {start}")) && found.contains(end), "{found}");
    }
    let twice = points(|columns| {
        columns[0] = Int64(vec![Some(7), Some(7)]);
        columns[1] = Double(vec![Some(1.), None]);
    });
    let found = refused(&twice);
    assert!(
        found.starts_with("a.parquet, row 2: needed one row per sample") && found.contains("after row 1"),
        "{found}"
    );
    let long = points(|columns| columns[2] = Text(vec![Some("door"), Some("name ".repeat(300).leak())]));
    assert!(refused(&long).contains("column `body`: needed a name of at most 1000 bytes, found one of 1500"));
}

#[test]
fn columns_that_are_no_numbers_or_names_are_refused() {
    let of = |frame: &str, more: &str| {
        let schema = POINTS.replace("optional int64 frame", frame) + more;
        let mut columns = vec![Int64(Vec::new()), Double(Vec::new()), Text(Vec::new()), Text(Vec::new())];
        columns.extend([Double(Vec::new()), Double(Vec::new()), Double(Vec::new())]);
        columns.extend((!more.is_empty()).then(|| Int64(Vec::new())));
        refused(&file(&schema, &columns, Compression::UNCOMPRESSED))
    };
    let nested = "optional group other { required int64 one; }";
    for (found, needed) in [
        (of("optional int64 frame (TIMESTAMP(MICROS,true))", ""), "column `frame`: needed integers or floating-point"),
        (of("optional int64 frame (DECIMAL(9,2))", ""), "found INT64 as Decimal; convert the column"),
        (of("repeated int64 frame", ""), "column `frame`: needed one value per row, found lists"),
        (of("optional int64 tme", ""), "column `tme` is unknown"),
        (of("optional int64 qw", ""), "column `qw` makes this a table of poses"),
        (of("optional int64 frame", "optional int64 Frame;"), "columns 1 and 8 are both named `frame`"),
        (of("optional int64 frame", nested), "needed plain columns, found nested ones"),
        (of("optional int64 frame", ""), "the table has columns but no rows"),
    ] {
        assert!(found.starts_with("a.parquet: ") && found.contains(needed), "{found}");
    }
}

#[test]
fn what_is_no_parquet_file_is_refused() {
    let sound = points(|_| ());
    for (bytes, needed) in [
        (&b""[..], "needed a Parquet file"),
        (&b"PAR1"[..], "needed a Parquet file"),
        (&b"PAR1PAR1"[..], "cut off or damaged"),
        (&b"PARE\0\0\0\0PARE"[..], "the file is encrypted"),
        (&sound[..sound.len() - 1], "needed a Parquet file"),
    ] {
        assert!(refused(bytes).contains(needed), "{}", refused(bytes));
    }
}

/// A table of as many rows as asked for, all alike but for their frames.
fn many(rows: usize, frame: impl Fn(i64) -> i64) -> Vec<u8> {
    let mut columns = vec![Int64((0..).map(|row| Some(frame(row))).take(rows).collect()), Double(vec![None; rows])];
    columns.extend(["door", "a"].map(|text| Text(vec![Some(text); rows])));
    columns.extend([1., 2., 3.].map(|value| Double(vec![Some(value); rows])));
    file(POINTS, &columns, Compression::ZSTD(ZstdLevel::default()))
}

#[test]
fn a_file_has_as_many_rows_as_bytes_or_a_million() {
    let recording = read(&many(10_000, |row| row)).expect("many rows in few bytes");
    assert_eq!(recording.frames(), 10_000);
    let found = refused(&many(1_000_001, |_| 0));
    assert!(found.contains("needed at least one byte per row, found 1000001 rows in "), "{found}");
}
