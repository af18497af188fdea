//! Archives of numpy's arrays: points of any number of bodies.
//!
//! | array | shape | type | |
//! |---|---|---|---|
//! | `points`, else `tracks_XYZ` | (T, N, 3) | float64, float32 | positions over T frames of N features |
//! | `visibility` | (T, N) | bool, uint8 | optional; where 0, the sample is missing |
//! | `body_ids` | (N) | integer | optional; the body of each feature; without it there is one body |
//! | `body_names` | (B) | str, bytes | optional; body id i has the name i |
//! | `times` | (T) | float64, float32 | optional, in seconds |
//!
//! * **Arrays** are in C or Fortran order and in either byte order, stored or deflated. Further arrays are not looked
//!   at, but one whose name is nearly that of an absent one is an error, because it is most likely misspelled.
//! * **Frames** are 0 to T − 1: there are no frame numbers.
//! * **Samples** are missing where a coordinate is NaN or `visibility` is 0.
//! * **Bodies** are in the order of `body_names`, and each has a feature; without names they are in order of first
//!   appearance and named by their ids, and a single body without id is named after the file. A feature's label is its
//!   column in `points`.
//! * **Size.** Arrays may not unpack to more than 100 times the file, or 256 MiB; pickled objects and encrypted
//!   archives are not read.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::{Cursor, Read};
use std::path::Path;

use jointscope_motion::{Body, MotionError, Recording, Tracks};
use nalgebra::Point3;
use rayon::prelude::*;
use zip::read::ZipFile;
use zip::{CompressionMethod, ZipArchive};

use crate::npy::{Array, Elements, Header};
use crate::pose_text::body_name;
use crate::text::quoted;
use crate::{RecordingError, Unit};

/// The arrays that are looked at.
const KNOWN: [&str; 6] = ["points", "tracks_XYZ", "visibility", "body_ids", "body_names", "times"];

/// How alike (Jaro-Winkler, 0 to 1) the name of an array must be to a known one to be taken for a misspelling of it.
const ALIKE: f64 = 0.9;

/// Bytes that arrays may always unpack to.
const ALWAYS_ALLOWED: usize = 256 << 20;

/// Bytes that arrays may unpack to, per byte of the file.
const ALLOWED_PER_BYTE: usize = 100;

/// Bodies that one thread reads at a time: enough for their positions in a frame to be long pieces of the file.
const TOGETHER: usize = 8;

/// Reads points from an archive; `path` names a single body, and is named in errors.
///
/// # Errors
/// [`RecordingError::File`] for what is said of archives [above](self); [`RecordingError::Motion`], for instance for
/// an infinite coordinate or a body without any sample.
pub fn parse(bytes: &[u8], path: &Path, unit: Unit) -> Result<Recording, RecordingError> {
    let arrays = Archive::open(bytes).and_then(|mut archive| Arrays::read(&mut archive, path));
    let Arrays { points, bodies, times } = arrays.map_err(|problem| RecordingError::in_file(path, problem))?;
    // All of them before the first error is looked for, which is then the same one every time.
    let bodies: Vec<_> = bodies.par_chunks(TOGETHER).flat_map_iter(|bodies| points.bodies(bodies, unit)).collect();
    let bodies = bodies.into_iter().collect::<Result<_, _>>();
    bodies
        .and_then(|bodies| Recording::new((0..points.frames as u64).collect(), times, bodies))
        .map_err(RecordingError::motion(path))
}

/// The content of the arrays.
struct Arrays<'a> {
    points: Points<'a>,
    /// Name and features of each body.
    bodies: Vec<(String, Vec<usize>)>,
    times: Option<Vec<f64>>,
}

/// Positions of all features, of which there is at least one in at least one frame.
struct Points<'a> {
    frames: usize,
    features: usize,
    /// Frame by frame, three of each feature, in the file's unit; NaN if missing.
    coordinates: Elements<'a, f64>,
    /// Frame by frame, one of each feature.
    visibility: Option<Elements<'a, bool>>,
}

impl Points<'_> {
    /// Bodies by their names and columns; the file is read from front to back.
    fn bodies(&self, bodies: &[(String, Vec<usize>)], unit: Unit) -> Vec<Result<Body, MotionError>> {
        let mut positions: Vec<Vec<Point3<f64>>> =
            bodies.iter().map(|(_, columns)| Vec::with_capacity(self.frames * columns.len())).collect();
        let (mut coordinates, mut visible) = (Vec::new(), Vec::new());
        for frame in 0..self.frames {
            for ((_, columns), positions) in bodies.iter().zip(&mut positions) {
                for neighbours in columns.chunk_by(|column, next| column + 1 == *next) {
                    let first = frame * self.features + neighbours[0];
                    let features = first..first + neighbours.len();
                    coordinates.clear();
                    self.coordinates.append(3 * features.start..3 * features.end, &mut coordinates);
                    let point = |point: &[f64; 3]| Point3::from(point.map(|length| unit.to_metres(length)));
                    positions.extend(coordinates.as_chunks().0.iter().map(point));
                    if let Some(visibility) = &self.visibility {
                        visible.clear();
                        visibility.append(features, &mut visible);
                        let unseen = positions.iter_mut().rev().zip(visible.iter().rev()).filter(|(_, seen)| !**seen);
                        unseen.for_each(|(position, _)| *position = Point3::from([f64::NAN; 3]));
                    }
                }
            }
        }
        let body = |((name, columns), positions): (&(String, Vec<usize>), Vec<Point3<f64>>)| {
            let labels = columns.iter().map(ToString::to_string).collect();
            Body::from_points(name, labels, Tracks::new(columns.len(), positions)?)
        };
        bodies.iter().zip(positions).map(body).collect()
    }
}

impl<'a> Arrays<'a> {
    fn read(archive: &mut Archive<'a>, path: &Path) -> Result<Self, String> {
        let (name, points) = match archive.array("points")? {
            Some(points) => ("points", points),
            None => ("tracks_XYZ", archive.array("tracks_XYZ")?.ok_or_else(|| archive.no_points())?),
        };
        archive.refuse_misspelled()?;
        let &[frames, features, 3] = points.shape() else {
            let shape = points.shape();
            return Err(format!("array `{name}`: needed shape (frames, features, 3), found {shape:?}; transpose it"));
        };
        if frames == 0 || features == 0 {
            return Err(format!("array `{name}`: needed a frame and a feature, found {frames} frames of {features}"));
        }
        let coordinates = points.into_floats().map_err(|problem| format!("array `{name}`: {problem}"))?;
        let visibility = archive.elements("visibility", &[frames, features], Array::into_bools)?;
        let ids = archive.elements("body_ids", &[features], Array::into_integers)?.map(|ids| ids.all());
        let names = match archive.array("body_names")? {
            Some(names) if names.shape().len() == 1 => {
                Some(names.texts().map_err(|problem| format!("array `body_names`: {problem}"))?)
            }
            Some(names) => return Err(format!("array `body_names`: needed shape (bodies), found {:?}", names.shape())),
            None => None,
        };
        let times = archive.elements("times", &[frames], Array::into_floats)?.map(|times| times.all());
        let points = Points { frames, features, coordinates, visibility };
        Ok(Self { points, bodies: bodies(ids, names, features, path)?, times })
    }
}

/// The name and the features of each body.
fn bodies(
    ids: Option<Vec<i128>>,
    names: Option<Vec<String>>,
    features: usize,
    path: &Path,
) -> Result<Vec<(String, Vec<usize>)>, String> {
    let Some(names) = names else {
        let Some(ids) = ids else { return Ok(vec![(body_name(path), (0..features).collect())]) };
        let mut order = BTreeMap::new();
        let mut bodies: Vec<(String, Vec<usize>)> = Vec::new();
        for (feature, id) in ids.into_iter().enumerate() {
            let body = *order.entry(id).or_insert(bodies.len());
            if body == bodies.len() {
                bodies.push((id.to_string(), Vec::new()));
            }
            bodies[body].1.push(feature);
        }
        return Ok(bodies);
    };
    let count = names.len();
    let ids = match ids {
        Some(ids) => ids,
        None if count == 1 => vec![0; features],
        None => return Err(format!("array `body_names` has {count} names, but array `body_ids` is missing; add it")),
    };
    let mut bodies: Vec<_> = names.into_iter().map(|name| (name, Vec::new())).collect();
    for (feature, id) in ids.into_iter().enumerate() {
        let body = usize::try_from(id).ok().and_then(|id| bodies.get_mut(id)).ok_or_else(|| {
            format!("array `body_ids`: feature {feature} has body {id}, but `body_names` names bodies 0 to {count} - 1")
        })?;
        body.1.push(feature);
    }
    match bodies.iter().find(|(_, features)| features.is_empty()) {
        Some((name, _)) => {
            Err(format!("body {} of `body_names` has no feature in `body_ids`; remove it", quoted(name)))
        }
        None => Ok(bodies),
    }
}

/// The file, and how many bytes it may still unpack to.
struct Archive<'a> {
    bytes: &'a [u8],
    zip: ZipArchive<Cursor<&'a [u8]>>,
    allowed: usize,
}

impl<'a> Archive<'a> {
    fn open(bytes: &'a [u8]) -> Result<Self, String> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
            format!("needed an archive of numpy's arrays, found none ({error}); write it with numpy.savez")
        })?;
        Ok(Self { bytes, zip, allowed: ALWAYS_ALLOWED.max(bytes.len().saturating_mul(ALLOWED_PER_BYTE)) })
    }

    /// The array of this name, if there is one.
    fn array(&mut self, name: &str) -> Result<Option<Array<'a>>, String> {
        self.unpack(name).map_err(|problem| format!("array `{name}`: {problem}"))
    }

    fn unpack(&mut self, name: &str) -> Result<Option<Array<'a>>, String> {
        let cannot_unpack = |problem: &dyn Display| format!("cannot be unpacked ({problem})");
        let Some(index) = self.zip.index_for_name(&format!("{name}.npy")) else { return Ok(None) };
        let mut file = self.zip.by_index(index).map_err(|error| cannot_unpack(&error))?;
        let stored = (file.compression() == CompressionMethod::Stored).then(|| Stored::of(&file, self.bytes));
        let mut stored = stored.transpose().map_err(|problem| cannot_unpack(&problem))?;
        let header = match &mut stored {
            Some(Stored { content, .. }) => Header::read(content),
            None => Header::read(&mut file),
        }?;
        let announced = header.bytes().filter(|bytes| *bytes <= self.allowed).ok_or_else(|| {
            format!("shape {:?} is too large for this file; if it is genuine, save without compression", header.shape)
        })?;
        self.allowed -= announced;
        let data = if let Some(stored) = &stored {
            Cow::Borrowed(stored.content)
        } else {
            // One more byte than announced, so that the end of the file and its checksum are seen.
            let mut data = Vec::new();
            file.take(announced as u64 + 1).read_to_end(&mut data).map_err(|error| cannot_unpack(&error))?;
            Cow::Owned(data)
        };
        let (shape, found) = (format!("{:?}", header.shape), data.len());
        let short = || {
            let more = if found > announced { "more" } else { &found.to_string() };
            format!("shape {shape} needs {announced} bytes, found {more}; the file is damaged, write it again")
        };
        let array = Array::new(header, data).ok_or_else(short)?;
        stored.map_or(Ok(()), |stored| stored.check()).map_err(|problem| cannot_unpack(&problem))?;
        Ok(Some(array))
    }

    /// The elements of an optional array that must have this shape.
    fn elements<T>(
        &mut self,
        name: &str,
        shape: &[usize],
        elements: impl Fn(Array<'a>) -> Result<Elements<'a, T>, String>,
    ) -> Result<Option<Elements<'a, T>>, String> {
        let Some(array) = self.array(name)? else { return Ok(None) };
        if array.shape() != shape {
            return Err(format!("array `{name}`: needed shape {shape:?} to fit the points, found {:?}", array.shape()));
        }
        elements(array).map(Some).map_err(|problem| format!("array `{name}`: {problem}"))
    }

    fn names(&self) -> Vec<String> {
        let names = self.zip.file_names_raw().map(|name| String::from_utf8_lossy(name).into_owned());
        names.map(|name| name.strip_suffix(".npy").map(ToOwned::to_owned).unwrap_or(name)).collect()
    }

    fn no_points(&self) -> String {
        const SHOWN: usize = 10;
        let names = self.names();
        let found: Vec<_> = names.iter().take(SHOWN).map(|name| quoted(name)).collect();
        let found = if found.is_empty() { "no array".into() } else { found.join(", ") };
        format!("needed array `points` (frames, features, 3), found {found}; rename the array of positions")
    }

    fn refuse_misspelled(&self) -> Result<(), String> {
        let names = self.names();
        let absent = |known: &&&str| !names.iter().any(|name| name == *known);
        for name in names.iter().filter(|name| !KNOWN.contains(&name.as_str())) {
            if let Some(known) =
                KNOWN[2..].iter().filter(absent).find(|known| strsim::jaro_winkler(name, known) >= ALIKE)
            {
                let name = quoted(name);
                return Err(format!(
                    "array {name} is unknown, did you mean `{known}`? rename it, or name it otherwise"
                ));
            }
        }
        Ok(())
    }
}

/// A file of the archive that lies there as it is.
struct Stored<'a> {
    whole: &'a [u8],
    /// What is left to read of it.
    content: &'a [u8],
    checksum: u32,
}

impl<'a> Stored<'a> {
    fn of<R: Read>(file: &ZipFile<'_, R>, archive: &'a [u8]) -> Result<Self, &'static str> {
        let size = usize::try_from(file.size()).ok().filter(|_| file.size() == file.compressed_size());
        let start = file.data_start().and_then(|start| usize::try_from(start).ok());
        let whole = start.zip(size).and_then(|(start, size)| archive.get(start..)?.get(..size));
        let whole = whole.ok_or("its bytes would lie outside of the archive")?;
        Ok(Self { whole, content: whole, checksum: file.crc32() })
    }

    /// Whether the bytes have the checksum that the archive states.
    fn check(&self) -> Result<(), &'static str> {
        /// Bytes that one thread sums up at a time.
        const PIECE: usize = 1 << 20;

        let sum = |bytes: &[u8]| {
            let mut sum = crc32fast::Hasher::new();
            sum.update(bytes);
            sum
        };
        let join = |mut sum: crc32fast::Hasher, next: crc32fast::Hasher| {
            sum.combine(&next);
            sum
        };
        let found = self.whole.par_chunks(PIECE).map(sum).reduce(crc32fast::Hasher::new, join).finalize();
        if found == self.checksum { Ok(()) } else { Err("its checksum is another one") }
    }
}

#[cfg(test)]
mod tests;
