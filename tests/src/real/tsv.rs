//! Qualisys's tables of markers: lines `KEY value`, then a row of names `Frame Time a X a Y a Z b X …`, then one row per
//! frame, all separated by tabs; seconds and millimetres. A sample is missing if its cells are empty or all zero.

use jointscope_recordings::Unit;
use nalgebra::Point3;

use super::markers::Markers;

pub(super) fn parse(text: &str) -> Result<Markers, String> {
    let mut lines = text.lines().skip_while(|line| !line.starts_with("Frame\tTime\t"));
    let names = lines.next().ok_or("no row of names that begins with Frame and Time")?;
    let names: Vec<&str> = names.split('\t').skip(2).collect();
    let label = |columns: &[&str]| columns[0].strip_suffix(" X").map(str::to_owned);
    let labels: Vec<String> =
        names.chunks_exact(3).map(label).collect::<Option<_>>().ok_or("a marker does not begin with its X")?;
    let (mut frames, mut times, mut positions) = (Vec::new(), Vec::new(), Vec::new());
    for line in lines {
        let cells: Vec<&str> = line.split('\t').collect();
        if cells.len() < 2 + 3 * labels.len() {
            return Err(format!("a row has {} cells for {} markers", cells.len(), labels.len()));
        }
        frames.push(cells[0].parse().map_err(|_| format!("`{}` is no frame", cells[0]))?);
        times.push(number(cells[1])?);
        for cells in cells[2..].chunks_exact(3).take(labels.len()) {
            let position = [number(cells[0])?, number(cells[1])?, number(cells[2])?];
            let missing = position == [0.0; 3];
            positions
                .push(Point3::from(position.map(|x| if missing { f64::NAN } else { Unit::Millimetre.to_metres(x) })));
        }
    }
    Ok(Markers { frames, times, labels, positions })
}

/// The number in a cell; NaN if the cell is empty.
fn number(cell: &str) -> Result<f64, String> {
    let cell = cell.trim();
    if cell.is_empty() { Ok(f64::NAN) } else { cell.parse().map_err(|_| format!("`{cell}` is no number")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_and_zero_samples_are_missing() {
        let text = "FREQUENCY\t100\nFrame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\r\n\
                    7\t0.5\t1000\t2000\t3000\t\t\t\n8\t0.6\t0\t0\t0\t1\t0\t0\t\n";
        let markers = parse(text).expect("sound");
        assert_eq!((markers.frames, markers.times), (vec![7, 8], vec![0.5, 0.6]));
        assert_eq!(markers.labels, ["a", "b"]);
        assert_eq!(markers.positions[0], Point3::new(1., 2., 3.));
        assert!(markers.positions[1].x.is_nan() && markers.positions[2].x.is_nan());
        assert_eq!(markers.positions[3], Point3::new(0.001, 0., 0.));
    }

    #[test]
    fn tables_without_names_and_short_rows_are_refused() {
        assert!(parse("1\t2\t3\n").is_err());
        assert!(parse("Frame\tTime\ta X\ta Y\ta Z\n1\t0.0\t5\n").is_err());
    }
}
